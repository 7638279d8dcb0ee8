#!/usr/bin/python3
"""The documentation site is made without a warning, has a page for each page of docs/, and a dead link in it is found.
Usage: test_site.py DERAIL"""

import glob
import os
import subprocess
import sys
import tempfile
import unittest

DOCS = os.path.realpath(os.path.join(os.path.dirname(os.path.abspath(__file__)), '..', '..', 'docs'))
DERAIL = ''

sys.dont_write_bytecode = True
sys.path.insert(0, DOCS)
import make_site  # noqa: E402


class SiteTest(unittest.TestCase):

    def test_it_is_made_of_all_pages(self):
        with tempfile.TemporaryDirectory() as folder:
            made = subprocess.run([os.path.join(DOCS, 'make_site.py'), DERAIL, folder], stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                                  text=True, check=False, timeout=1200)
            self.assertEqual(made.returncode, 0, made.stdout)
            for page in glob.glob(os.path.join(DOCS, '**', '*.md'), recursive=True):
                html = os.path.join(folder, 'html', os.path.relpath(page, DOCS)[:-2] + 'html')
                self.assertTrue(os.path.exists(html), html)
            with open(os.path.join(folder, 'html', 'reference', 'keys.html'), encoding='utf-8') as f:
                self.assertIn('coupler.slack', f.read())
            with open(os.path.join(folder, 'html', 'api', 'model.html'), encoding='utf-8') as f:
                self.assertIn('TrainModel', f.read())

    def test_a_dead_link_is_found(self):
        with tempfile.TemporaryDirectory() as folder:
            with open(os.path.join(folder, 'a.html'), 'w', encoding='utf-8') as f:
                f.write('<p id="here"><a href="#here"><a href="b.html#there"><a href="https://example.org/x"><a href="b.html#nowhere"><img src="c.png">')
            with open(os.path.join(folder, 'b.html'), 'w', encoding='utf-8') as f:
                f.write('<p id="there">')
            self.assertEqual(make_site.dead_links(folder), ['a.html: dead link: b.html#nowhere', 'a.html: dead link: c.png'])


if __name__ == '__main__':
    DERAIL = sys.argv.pop(1)
    unittest.main()
