#!/usr/bin/python3
"""What is written about the module for Python holds: examples in the documentation, type hints. Usage: test_docs.py"""

import doctest
import importlib
import os
import subprocess
import sys
import tempfile
import unittest

import train_derail

ROOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), '..', '..')


class DocsTest(unittest.TestCase):

    def setUp(self):
        holder = tempfile.TemporaryDirectory(prefix='derail docs ')
        self.addCleanup(holder.cleanup)
        self.folder = holder.name

    def test_examples_in_docstrings(self):
        for name in ('train_derail', 'train_derail._api'):
            failed, tried = doctest.testmod(importlib.import_module(name))
            self.assertEqual(failed, 0)
            self.assertGreater(tried, 0)

    def test_examples_in_the_page(self):
        here = os.getcwd()
        os.chdir(self.folder)
        try:
            failed, tried = doctest.testfile(os.path.join(ROOT, 'docs', 'python.md'), module_relative=False, optionflags=doctest.ELLIPSIS)
        finally:
            os.chdir(here)
        self.assertEqual(failed, 0)
        self.assertGreater(tried, 10)

    def test_everything_has_a_docstring(self):
        for name in train_derail.__all__:
            thing = getattr(train_derail, name)
            if not callable(thing):
                continue
            self.assertTrue(thing.__doc__, name)
            for member, value in vars(thing).items() if isinstance(thing, type) else ():
                if not member.startswith('_') and (callable(value) or isinstance(value, property)):
                    self.assertTrue(value.__doc__, f'{name}.{member}')

    def test_type_hints_are_those_of_the_module(self):
        # The module alone: beside it may lie messages, which genpy makes without hints.
        package, alone = os.path.dirname(os.path.abspath(train_derail.__file__)), os.path.join(self.folder, 'train_derail')
        os.mkdir(alone)
        for name in os.listdir(package):
            if os.path.isfile(os.path.join(package, name)):
                os.symlink(os.path.join(package, name), os.path.join(alone, name))
        environment = {**os.environ, 'MYPYPATH': self.folder, 'PYTHONPATH': self.folder}
        with open(os.path.join(self.folder, 'allowed'), 'w', encoding='utf-8') as file:
            # pybind11's metaclass, and its way to say that there is no constructor.
            file.write('train_derail\\._core\\.(Scenario|Simulation|Scenario\\.__init__)\n')
        for tool in (('mypy', '--strict', '-p', 'train_derail'), ('mypy.stubtest', 'train_derail', '--ignore-missing-stub', '--allowlist', 'allowed')):
            result = subprocess.run([sys.executable, '-m', *tool], cwd=self.folder, env=environment, text=True, timeout=600,
                                    stdout=subprocess.PIPE, stderr=subprocess.STDOUT, check=False)
            self.assertEqual(result.returncode, 0, result.stdout)


if __name__ == '__main__':
    unittest.main(argv=sys.argv[:1])
