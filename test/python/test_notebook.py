#!/usr/bin/python3
"""The example notebooks run, and show what they show in docs/notebooks. Usage: test_notebook.py [--write]; --write keeps what they show.

The pictures are written to the folder NOTEBOOK_PICTURES of the environment, if it is set."""

import base64
import glob
import io
import os
import re
import subprocess
import sys
import tempfile
import unittest

import matplotlib.image
import nbformat

FOLDER = os.path.join(os.path.dirname(os.path.abspath(__file__)), '..', '..', 'docs', 'notebooks')
WRITE = False


def shown(notebook):
    """Texts that each cell of code shows, without those that stand for a picture. Numbers are left out: those of a long train
    are not the same on every processor, whose mathematical functions may differ in the last bit."""
    cells = []
    for cell in notebook.cells:
        for output in cell.get('outputs', ()):
            data = output.get('data', {})
            if 'image/png' not in data:
                cells.append((cell.source, re.sub(r'[-\d. ]+', ' ', output.get('text', data.get('text/plain')))))
    return cells


def pictures(notebook):
    return [base64.b64decode(output['data']['image/png']) for cell in notebook.cells for output in cell.get('outputs', ())
            if 'image/png' in output.get('data', {})]


class NotebookTest(unittest.TestCase):

    def test_each_runs(self):
        paths = sorted(glob.glob(os.path.join(FOLDER, '*.ipynb')))
        self.assertTrue(paths)
        for path in paths:
            with self.subTest(path), tempfile.TemporaryDirectory(prefix='derail notebook ') as folder:
                name = os.path.basename(path)
                environment = {**os.environ, 'HOME': folder, 'IPYTHONDIR': folder, 'MPLCONFIGDIR': folder, 'JUPYTER_RUNTIME_DIR': folder}
                result = subprocess.run([sys.executable, '-m', 'nbconvert', '--to', 'notebook', '--execute', '--ExecutePreprocessor.timeout=300',
                                         '--output-dir', folder, path], cwd=folder, env=environment, text=True, timeout=550,
                                        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, check=False)
                self.assertEqual(result.returncode, 0, result.stdout)
                now, kept = nbformat.read(os.path.join(folder, name), 4), nbformat.read(path, 4)
                images = pictures(now)
                self.assertGreater(len(images), 0)
                for k, image in enumerate(images):
                    pixels = matplotlib.image.imread(io.BytesIO(image), format='png')
                    self.assertGreater(pixels.std(), 0.01, f'picture {k} is empty')
                    if os.environ.get('NOTEBOOK_PICTURES'):
                        with open(os.path.join(os.environ['NOTEBOOK_PICTURES'], f'{name}.{k}.png'), 'wb') as file:
                            file.write(image)
                if WRITE:
                    for cell in now.cells:
                        cell.metadata.pop('execution', None)  # times of day
                    now.metadata = kept.metadata
                    nbformat.write(now, path)
                else:
                    self.assertEqual(shown(now), shown(kept), 'test_notebook.py --write keeps what is shown now')
                    self.assertEqual(len(images), len(pictures(kept)))


if __name__ == '__main__':
    WRITE = '--write' in sys.argv
    unittest.main(argv=sys.argv[:1])
