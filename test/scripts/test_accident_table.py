#!/usr/bin/python3
"""accident_table.py; and the scenarios of config/ that no other test reads: they are valid and hold the same parts.

  test_accident_table.py path/to/derail
"""

import argparse
import csv
import glob
import os
import re
import shutil
import subprocess

import numpy as np
import yaml

from plot_testing import KIP, PlotTest, run_tests, script

import accident_table

CONFIG = os.path.join(accident_table.ROOT, 'config')
STUDY = """
title: Tiny
scenario: scenario.yaml
plan: grid
factors:
  - {key: initial.speed, label: speed, values: [20 mph, 30 mph]}
  - {key: coupler.swing_moment_max, label: plateau, values: [.inf, 5e4 lbf ft]}
replicates: 3
perturbation: {spacing: 3 mm}
outcomes: [cars_off_track, coupler_force_peak]
"""


def accidents():
    return sorted(glob.glob(os.path.join(CONFIG, 'accidents', '*.yaml')))


def load(path):
    with open(path, encoding='utf-8') as file:
        return yaml.safe_load(file)


class AccidentTable(PlotTest):
    def test_every_scenario_that_ships_is_valid(self):
        for path in glob.glob(os.path.join(CONFIG, '*.yaml')) + accidents():
            done = subprocess.run([self.program, 'check', path], capture_output=True, text=True, check=False)
            self.assertEqual(done.returncode, 0, done.stderr)

    def test_every_accident_has_the_preset_as_its_base_and_a_real_number(self):
        for path in accidents():
            own = load(path)
            self.assertIn(own['base'], ('../accident.yaml', '../accident3d.yaml'))
            # What is not of the accident itself stands in the preset alone.
            self.assertLessEqual(set(own), {'base', 'title', 'consist', 'track', 'initial', 'brakes', 'stop'}, path)
            self.assertLessEqual(set(own.get('brakes', {})), {'emergency_time', 'signal'}, path)
            self.assertLessEqual(set(own['initial']), {'speed', 'cars_ahead'}, path)
            done = subprocess.run([self.program, 'check', path], capture_output=True, text=True, check=True)
            self.assertEqual(yaml.safe_load(done.stdout)['solver']['method'], 'semi_implicit')
        table = os.path.join(accident_table.ROOT, 'docs', 'data', 'accidents.csv')
        with open(table, encoding='utf-8', newline='') as file:
            listed = {a['file'] + '.yaml': a for a in csv.DictReader(file)}
        self.assertEqual(sorted(listed), [os.path.basename(p) for p in accidents()])
        for path in accidents():
            known = listed[os.path.basename(path)]
            if load(path)['base'] == '../accident3d.yaml':
                self.assertLessEqual(int(known['over']), int(known['derailed']))

    def test_every_accident_runs(self):
        for path in accidents():
            out = self.path(os.path.basename(path) + '.json')
            self.derail('run', path, '--json', out, '--set', 'stop.time_max=2 s')
            outcome = load(out)
            self.assertEqual(outcome['cars'], sum(b['count'] for b in load(path)['consist']), path)
            self.assertGreater(outcome['cars_derailed'], 0, path)

    def test_how_cars_lay_is_compared(self):
        short = ('--seeds', '2', '--set', 'stop.time_max=15 s')
        names = ('minot_2002', 'lawtell_2013', 'columbus_2012')
        only = [argument for name in names for argument in ('--only', name)]
        done = script('accident_table.py', 'posture', '--derail', self.program, *only, *short)
        self.assertEqual(done.returncode, 0, done.stderr)
        rows = [[c.strip() for c in line.split('|')[1:-1]] for line in done.stdout.splitlines() if line[:1] == '|'][2:]
        # Of Columbus no report says it.
        self.assertEqual([r[0] for r in rows], ['[Minot, 2002](../config/variants/minot_2002_3d.yaml)',
                                                '[Lawtell, 2013](../config/accidents/lawtell_2013.yaml)'])
        self.assertEqual([rows[1][i] for i in (1, 2, 4, 6)], ['50', '27', '24', '0.89'])
        derailed, over = [], []
        for seed in ('1', '2'):
            path, out = os.path.join(CONFIG, 'accidents', 'lawtell_2013.yaml'), self.path(f'lawtell{seed}.json')
            self.derail('run', path, '--json', out, *short[2:], '--set', f'initial.perturbation.seed={seed}')
            derailed.append(load(out)['cars_derailed'])
            over.append(load(out)['cars_over'])
        self.assertGreater(sum(over), 0)
        self.assertEqual([rows[1][i] for i in (3, 5, 7)], [accident_table.band(derailed), accident_table.band(over),
                                                           f'{sum(over) / sum(derailed):.2f}'])
        # Those in three dimensions are not among those of the plane.
        done = script('accident_table.py', 'run', '--derail', self.program, *only[2:], *short)
        self.assertNotIn('Lawtell', done.stdout)

    def test_study_becomes_a_table_in_its_page(self):
        self.path('study.yaml', STUDY)
        out = self.path('tiny')
        self.derail('study', self.path('study.yaml'), '--out', out)
        page = self.path('page.md', 'before\n<!-- begin: study tiny -->\nold\n<!-- end -->\nafter\n')
        done = script('accident_table.py', 'study', out, '--fill', page)
        self.assertEqual(done.returncode, 0, done.stderr)
        with open(page, encoding='utf-8') as file:
            text = file.read()
        self.assertNotIn('old', text)
        self.assertTrue(text.startswith('before\n') and text.endswith('after\n'))
        rows = [line for line in text.splitlines() if line.startswith('| ')]
        self.assertEqual(rows[0], '| changed | cars off track | coupler force peak, kip |')
        self.assertEqual(
            [r.split(' | ')[0] for r in rows[2:]],
            ['| nothing', '| plateau: 50000 lbf ft', '| speed: 30 mph', '| speed: 30 mph, plateau: 50000 lbf ft'],
        )
        with open(os.path.join(out, 'runs.csv'), encoding='utf-8', newline='') as file:
            forces = [float(r['coupler_force_peak']) / KIP for r in csv.DictReader(file) if r['point'] == '0']
        self.assertIn(f'| {np.median(forces):.0f} (', rows[2])

        wrong = script('accident_table.py', 'study', out, '--fill', self.path('bare.md', 'no mark\n'))
        self.assertEqual(wrong.returncode, 2)
        self.assertIn('0 times "<!-- begin: study tiny -->"', wrong.stderr)

    def test_points_of_a_study_are_compared_with_its_base(self):
        out = self.path('compared')
        text = STUDY.replace('plan: grid', 'plan: one_at_a_time')
        self.derail('study', self.path('compared.yaml', text), '--out', out)
        done = script('accident_table.py', 'compare', out)
        self.assertEqual(done.returncode, 0, done.stderr)
        rows = [[c.strip() for c in line.split('|')[1:-1]] for line in done.stdout.splitlines() if line[:1] == '|']
        self.assertEqual(rows[0][:5], ['mean', 'base', 'speed: 30 mph', 'p, distance', 'p, ranks'])
        self.assertEqual([r[0] for r in rows[2:]], ['cars off track', 'coupler force peak, kip'])
        with open(os.path.join(out, 'runs.csv'), encoding='utf-8', newline='') as file:
            runs = list(csv.DictReader(file))
        forces = [[float(r['coupler_force_peak']) / KIP for r in runs if r['point'] == p] for p in ('0', '1')]
        self.assertEqual(rows[3][1:3], [accident_table.mean(np.array(f)) for f in forces])
        # No value of one sample among those of the other: of 20 ways to deal six runs two are as far apart.
        self.assertTrue(min(forces[0]) > max(forces[1]) or max(forces[0]) < min(forces[1]))
        self.assertEqual(rows[3][3:5], ['0.1', '0.1'])
        for line in (rows[1], rows[3]):
            self.assertEqual(len(line), len(rows[0]))

        text = STUDY.replace('[20 mph, 30 mph]', '[20 mph]').replace('[.inf, 5e4 lbf ft]', '[.inf]')
        self.derail('study', self.path('single.yaml', text), '--out', self.path('single'))
        wrong = script('accident_table.py', 'compare', self.path('single'))
        self.assertEqual(wrong.returncode, 2)
        self.assertIn('one point only', wrong.stderr)

    def test_an_accident_is_run_once_a_seed(self):
        columbus = ('accident_table.py', 'run', '--derail', self.program, '--only', 'columbus_2012')
        short = ('--set', 'stop.time_max=3 s')
        done = script(*columbus, *short, '--seeds', '2')
        self.assertEqual(done.returncode, 0, done.stderr)
        cells = done.stdout.splitlines()[2].split(' | ')
        self.assertEqual(cells[:4], ['| [Columbus, 2012](../config/accidents/columbus_2012.yaml)', '23', '96', '17'])
        counts = []
        for seed in ('1', '2'):
            path = os.path.join(CONFIG, 'accidents', 'columbus_2012.yaml')
            out = self.path(f'outcome{seed}.json')
            self.derail('run', path, '--json', out, *short, '--set', f'initial.perturbation.seed={seed}')
            counts.append(load(out)['cars_derailed'])
        self.assertEqual(cells[4], accident_table.band(counts))

        failed = script(*columbus, '--set', 'initial.speed=-1')
        self.assertEqual(failed.returncode, 1)
        self.assertIn('initial.speed', failed.stderr)


if __name__ == '__main__':
    run_tests()
