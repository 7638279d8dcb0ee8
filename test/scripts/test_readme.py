#!/usr/bin/python3
"""What README.md and the pages for users promise is what the program has: keys of the JSON, options, exit codes, files; topics, services, parameters,
arguments of launch files. Usage: test_readme.py DERAIL"""

import glob
import json
import os
import re
import shlex
import subprocess
import sys
import tempfile
import unittest
import xml.etree.ElementTree

ROOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), '..', '..')
DERAIL = ''
PAGES = ('README.md', 'CONTRIBUTING.md', 'docs/command_line.md', 'docs/node.md')


def read(*names):
    with open(os.path.join(ROOT, *names), encoding='utf-8') as f:
        return f.read()


def read_all(pattern):
    return ''.join(read(os.path.relpath(path, ROOT)) for path in sorted(glob.glob(os.path.join(ROOT, pattern))))


def derail(*arguments):
    return subprocess.run([DERAIL, *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, check=True, timeout=120).stdout


def flattened(text):
    return re.sub(r'\s+', ' ', text)


class ReadmeTest(unittest.TestCase):
    maxDiff = None

    def setUp(self):
        self.text = ''.join(read(page) for page in PAGES)

    def table(self, first_heading):
        """Backticked words of the first column of the table with that heading."""
        match = re.search(r'^\| %s \|.*\n\|[-|]+\n((?:\|.*\n)+)' % first_heading, self.text, re.M)
        self.assertTrue(match, first_heading)
        words = [re.findall('`([^`]+)`', row.split('|')[1]) for row in match.group(1).splitlines()]
        return [word for row in words for word in row]

    def section(self, heading):
        return self.text.split('\n## %s\n' % heading)[1].split('\n## ')[0]

    def test_prose_is_at_most_100_columns_wide_and_tables_are_whole(self):
        """Also of pages that the program writes: who wraps those by hand makes them untrue."""
        wide, broken = [], []
        for page in ['README.md', 'CONTRIBUTING.md', *sorted(glob.glob(os.path.join(ROOT, 'docs', '**', '*.md'), recursive=True))]:
            fenced = False
            for number, line in enumerate(read(page).splitlines(), 1):
                if line.startswith('```'):
                    fenced = not fenced
                whole = fenced or line.startswith(('    ', '#', '!', '<')) or line.lstrip().startswith('|') or 'http' in line
                if not fenced and re.search(r'\|---\|.*[^-|: ]', line):
                    broken.append('%s:%d: %s' % (page, number, line))
                if len(line) > 100 and not whole:
                    wide.append('%s:%d: %d columns' % (os.path.relpath(os.path.join(ROOT, page), ROOT), number, len(line)))
        self.assertEqual((wide, broken), ([], []))

    def test_the_page_of_outcomes_is_the_program_s(self):
        page = derail('fields')
        self.assertEqual(read('docs', 'outcomes.md'), page)
        outcome = json.loads(derail('run', os.path.join(ROOT, 'config/baseline.yaml'), '--json', '-'))
        table = page.split('## Outcome')[1].split('\n## ')[0]
        self.assertEqual(re.findall('^\\| `([a-z0-9_]+)`', table, re.M), list(outcome))

    def test_commands_and_options(self):
        commands = re.findall(r'\bderail (run|check|keys|fields|study|merge|report|validate|verify|import (?:consist|track))\b([^\n#]*)', self.text)
        self.assertGreater(len(commands), 8)
        for command, rest in commands:
            known = derail(*command.split(), '--help')
            for option in re.findall(r'(?<![\w-])--[a-z][a-z-]*', rest):
                self.assertIn(option, known, 'derail ' + command)
        everywhere = ''.join(derail(c, '--help') for c in ('run', 'check', 'keys', 'fields', 'study', 'merge', 'report', 'validate', 'verify'))
        for option in re.findall(r'`(--[a-z][a-z-]*)', self.text):
            if option not in ('--clock', '--help'):  # of rosbag play
                self.assertIn(option, everywhere)

    def test_what_is_imported_runs(self):
        """The examples of train lists and track files: as the README has them, in a folder of their own."""
        lines = re.findall(r'rosrun train_derail derail (import [^\n#]*)', read('README.md'))
        self.assertEqual(len(lines), 2)
        with tempfile.TemporaryDirectory() as folder:
            for name in ('config', 'examples'):
                os.symlink(os.path.join(ROOT, name), os.path.join(folder, name))
            for line in lines:
                words = shlex.split(line)
                subprocess.run([DERAIL, *words], cwd=folder, check=True, timeout=300, stderr=subprocess.PIPE)
                out = os.path.join(folder, words[words.index('-o') + 1])
                derail('run', out, '--quiet', '--set', 'stop.time_max=0.1 s')

    def test_exit_codes(self):
        def codes(text):
            listed = text.split('Exit codes:')[1].split('\n\n')[0]
            return set(re.findall(r'(?:^|[,;]) ?(\d+) [a-zA-Z`]', flattened(listed)))
        told = codes(self.text)
        self.assertEqual(told, codes(derail('--help')))
        self.assertTrue({'0', '1', '2', '3', '4'} <= told, told)

    def test_files_that_are_named_are_there(self):
        named = set(re.findall(r'(?<![\w/.-])(?:docs|config|examples|scripts)/[\w./-]*\w', self.text))
        self.assertGreater(len(named), 15)
        for name in named:
            self.assertTrue(os.path.exists(os.path.join(ROOT, name)) or os.path.exists(os.path.join(ROOT, name + '.md')), name)
        for name in set(re.findall(r'(?<![\w/-])(\w+\.(?:py|sh))\b', self.text)):
            self.assertTrue(glob.glob(os.path.join(ROOT, '*', '**', name), recursive=True), name)

    def test_tests_that_the_page_on_reliability_names_are_there(self):
        named = set(re.findall(r'(?<![\w/.-])(?:test|include)/[\w./-]*\w', read('docs/reliability.md')))
        self.assertGreater(len(named), 8)
        self.assertEqual({name for name in named if not os.path.exists(os.path.join(ROOT, name))}, set())

    def test_subcommands_of_run(self):
        usage = subprocess.run([os.path.join(ROOT, 'run'), '--help'], stdout=subprocess.PIPE, text=True, check=True).stdout
        has = set(re.findall(r'\./run (\w+)', usage))
        self.assertEqual(has, set(re.findall(r'\./run (\w+)', self.text)) & (has | {'build', 'sim', 'test'}))

    def test_topics(self):
        advertised = set(re.findall(r'TopicFacts facts\{\s*"([^"]+)"', read('include/train_derail/ros/topics.hpp')))
        advertised |= set(re.findall(r'advertise<[^>]+>\(\s*"([^"]+)"', read('src/ros/diagnostics.cpp')))
        self.assertGreater(len(advertised), 8)
        self.assertEqual(set(self.table('topic')), advertised)

    def test_services(self):
        offered = {'~' + n for n in re.findall(r'advertiseService\(\s*"([^"]+)"', read_all('src/ros/*.cpp'))}
        self.assertEqual(set(self.table('service')), offered)

    def test_parameters(self):
        code = read('src/ros/parameters.cpp')
        taken = {'~' + n for n in re.findall(r'\breader\.\w+\(\s*"([^"]+)"', code)}
        told = {re.sub(r'/\.\.\.$', '', n) for n in self.table('parameter')}
        self.assertEqual(told, taken)

    def arguments(self, *names):
        tree = xml.etree.ElementTree.parse(os.path.join(ROOT, *names))
        return {a.get('name') for a in tree.iter('arg') if a.get('doc')}

    def test_arguments_of_launch_files(self):
        told = flattened(self.section('Node')).split('Arguments: ')[1].split(' (`roslaunch')[0]
        self.assertEqual(set(re.findall('`([a-z_]+)`', told)), self.arguments('launch', 'sim.launch'))
        told = flattened(self.section('Examples')).split('each launch file takes ')[1].split(' as sim.launch does')[0]
        for name in ('coupler_overload', 'pile_up_extent'):
            missing = set(re.findall('`([a-z_]+)`', told)) - self.arguments('examples', 'launch', name + '.launch')
            self.assertEqual(missing, set(), name)
        for file, line in re.findall(r'roslaunch train_derail (\w+\.launch)([^\n#]*)', self.text):
            where = ('launch',) if os.path.exists(os.path.join(ROOT, 'launch', file)) else ('examples', 'launch')
            for name in re.findall(r'(\w+):=', line):
                self.assertIn(name, self.arguments(*where, file), file)


if __name__ == '__main__':
    DERAIL = os.path.abspath(sys.argv.pop(1))
    unittest.main()
