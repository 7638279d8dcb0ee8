#!/usr/bin/python3
"""choose_ranges.py: the choice on numbers worked out by hand, and on real, short ensembles.

  test_choose_ranges.py path/to/derail
"""

import json
import os

import numpy as np

from plot_testing import PlotTest, refusal, run_tests, script

import choose_ranges


class ChooseRangesTest(PlotTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.table, cls.study = cls.accidents([(4 + 3 * i, 6, 130, 1 + i % 4) for i in range(14)])

    def test_the_choice_is_that_of_the_other_folds(self):
        # Ten rows, two a fold. The narrow one holds 8: all but rows 0 and 5, which are fold 0. The wide one holds all and is less sharp.
        hits = np.ones((2, 10), bool)
        hits[0, [0, 5]] = False
        crps = np.array([np.full(10, 1.0), np.full(10, 2.0)])
        best, chosen, unseen = choose_ranges.choose(hits, crps, 0.98)
        # 80 % is too few, 100 % near enough. Without fold 0: both hold 100 %, the sharper one; without another: 6 of 8, or all.
        self.assertEqual(best, 1)
        self.assertEqual(chosen, [0, 1, 1, 1, 1])
        self.assertEqual(list(unseen), [0, 1, 1, 1, 1] * 2)
        # Nobody near 50 %: the nearest, however sharp.
        self.assertEqual(choose_ranges.choose(hits, crps[::-1], 0.5)[0], 0)

    def test_scores_by_hand(self):
        rows = {
            'speed_mph': np.array([10.0, 20.0, 40.0]),
            'cars_derailed': np.array([3.0, 2.0, 9.0]),
            'predicted_median': np.array([2.0, 4.0, 8.0]),
            'predicted_low': np.array([1.0, 3.0, 5.0]),
            'predicted_high': np.array([3.0, 6.0, 10.0]),
            'crps': np.array([1.0, 2.0, 3.0]),
        }
        found = choose_ranges.scores(rows, np.ones(3, bool))
        self.assertAlmostEqual(found['speed_exponent'], 1.0)
        self.assertAlmostEqual(found['mean_absolute_error'], 4 / 3)
        self.assertAlmostEqual(found['bias'], 0.0)
        self.assertAlmostEqual(found['coverage'], 2 / 3)
        self.assertAlmostEqual(found['width'], 10 / 3)
        self.assertAlmostEqual(found['crps'], 2.0)

    def test_on_ensembles_of_the_program(self):
        out = self.path('chosen')
        with open(self.study, encoding='utf-8') as file:
            weak = self.path('weak.yaml', file.read().replace('0.8', '0.4'))
        command = (self.table, '--study', weak, self.study, '--out', out, '--spread', '2', '1', '--derail', self.program)
        done = script('choose_ranges.py', *command)
        self.assertEqual(done.returncode, 0, done.stderr)
        with open(os.path.join(out, 'ranges.json'), encoding='utf-8') as file:
            found = json.load(file)
        names = ['weak_1', 'weak_2', 'study_1', 'study_2']
        self.assertEqual([c['name'] for c in found['candidates']], names)
        self.assertEqual(found['held_out']['fast']['rows'], 12)
        self.assertNotIn('fast, long tail', found['held_out'])
        self.assertIn(found['chosen'], names)
        tables = [choose_ranges.read_rows(os.path.join(out, n)) for n in names]
        fast = tables[0]['speed_mph'] >= 10.0
        for candidate, rows in zip(found['candidates'], tables):
            self.assertEqual(candidate['all']['rows'], 14)
            self.assertEqual(candidate['fast']['coverage'], choose_ranges.inside(rows)[fast].mean())
        # Held out: each row by the choice of the other folds.
        choices = [names.index(n) for n in found['chosen_without_fold']]
        medians = np.array([tables[choices[i % 5]]['predicted_median'][fast][i] for i in range(12)])
        error = np.abs(medians - tables[0]['cars_derailed'][fast]).mean()
        self.assertAlmostEqual(found['held_out']['fast']['mean_absolute_error'], error)
        self.assertIn(f"Chosen from all rows: {found['chosen']}.", done.stdout)
        before = os.path.getmtime(os.path.join(out, 'weak_1', 'rows.csv'))
        self.assertEqual(script('choose_ranges.py', *command).stdout, done.stdout)
        self.assertEqual(os.path.getmtime(os.path.join(out, 'weak_1', 'rows.csv')), before)

    def test_what_is_wrong_is_named(self):
        out = self.path('wrong')
        command = (self.table, '--study', self.study, '--out', out, '--spread', '1', '--derail', self.program)
        code, said = refusal(choose_ranges.main, *command, '--min-speed', '40')
        self.assertEqual(code, 2)
        self.assertIn('2 rows from 40 mph on are too few for 5 folds', said)
        with open(os.path.join(out, 'study_1', 'rows.csv'), 'w', encoding='utf-8') as file:
            file.write('a,b\n1,2\n')
        code, said = refusal(choose_ranges.main, *command)
        self.assertEqual(code, 2)
        self.assertIn('rows.csv: not a table', said)
        code, said = refusal(choose_ranges.main, *command[:2], self.study, *command[2:])
        self.assertEqual(code, 2)
        self.assertIn('two studies have the same file name', said)
        self.assertEqual(script('choose_ranges.py', 'nowhere.csv', *command[1:4], self.path('none'), *command[5:]).returncode, 1)


if __name__ == '__main__':
    run_tests()
