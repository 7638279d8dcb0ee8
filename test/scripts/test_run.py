#!/usr/bin/python3
"""The script `run`: where it may lie, what it says of its use, how it waits for another apt-get. Usage: test_run.py DERAIL (not used)"""

import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

RUN = os.path.join(os.path.dirname(os.path.abspath(__file__)), '..', '..', 'run')

# Fails as apt-get does while another one holds its lock, as often as there are lines in the file `held`.
APT = '''
sleep() { sed -i 1d held; }
apt-get() {
  [[ -s held ]] || { echo "apt-get $*"; return "$ends_with"; }
  echo "E: Could not get lock /var/lib/dpkg/lock-frontend. It is held by process 1 (apt-get)" >&2
  return 100
}
'''


class RunTest(unittest.TestCase):

    def setUp(self):
        self.folder = tempfile.mkdtemp(prefix='derail_run_')
        self.addCleanup(shutil.rmtree, self.folder)
        with open(RUN, encoding='utf-8') as f:
            self.text = f.read()

    def start(self, folder, *arguments):
        os.mkdir(folder)
        script = shutil.copy(RUN, folder)
        return subprocess.run([script, *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, check=False, timeout=60)

    def test_a_checkout_may_have_spaces_but_nothing_that_breaks_what_it_starts(self):
        shown = self.start(os.path.join(self.folder, 'a checkout, 100% mine'), '--help')
        self.assertEqual(shown.returncode, 0, shown.stderr)
        self.assertIn('./run test', shown.stdout)
        for odd in ':;"\'\\$`\n':
            refused = self.start(os.path.join(self.folder, 'a%sb' % odd), 'build')
            self.assertEqual(refused.returncode, 2, odd)
            self.assertEqual(refused.stderr.count('\n'), 1, refused.stderr)
            self.assertIn('move it', refused.stderr)

    def test_unknown_subcommands_are_refused(self):
        refused = self.start(os.path.join(self.folder, 'here'), 'biuld')
        self.assertEqual((refused.returncode, refused.stdout), (2, ''))
        self.assertIn('usage: ./run build', refused.stderr)
        self.assertEqual(os.listdir(os.path.join(self.folder, 'here')), ['run'])

    def apt_get(self, held, status):
        function = re.search(r'^apt_get\(\) \{.*?^\}', self.text, re.M | re.S).group(0)
        function = function.replace(' 1800 ', ' 20 ')
        with open(os.path.join(self.folder, 'held'), 'w', encoding='utf-8') as f:
            f.write('x\n' * held)
        return subprocess.run(['bash', '-c', 'set -euo pipefail; ends_with=%d; %s\n%s\napt_get apt-get install it' % (status, APT, function)],
                              cwd=self.folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, check=False, timeout=60)

    def test_another_apt_get_is_waited_for(self):
        done = self.apt_get(3, 0)
        self.assertEqual((done.returncode, done.stdout), (0, 'apt-get install it\n'), done.stderr)
        self.assertEqual(len(re.findall('waiting for another program.*lock-frontend', done.stderr)), 1, done.stderr)
        self.assertEqual(self.apt_get(0, 7).returncode, 7)
        for_ever = self.apt_get(10, 0)
        self.assertEqual(for_ever.returncode, 100)
        self.assertIn('E: Could not get lock', for_ever.stderr)


if __name__ == '__main__':
    del sys.argv[1:]
    unittest.main()
