#!/usr/bin/python3
"""choose_spread.py: the choice on numbers worked out by hand, and on real, short ensembles.

  test_choose_spread.py path/to/derail
"""

import json
import os

import numpy as np

from plot_testing import PlotTest, refusal, run_tests, script

import choose_spread


class ChooseSpreadTest(PlotTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.table, cls.study = cls.accidents([(4 + 3 * i, 6, 130, 1 + i % 4) for i in range(14)])

    def test_the_choice_is_that_of_the_other_folds(self):
        # Ten rows, two a fold. The narrow one holds 8: all but rows 0 and 5, which are fold 0. The wide one holds all.
        hits = np.ones((2, 10), bool)
        hits[0, [0, 5]] = False
        best, chosen, held = choose_spread.choose(hits, 0.9)
        self.assertEqual(best, 0)  # 80 % and 100 % are equally far
        # Without fold 0: 100 % each, the narrow one; without another: 6 of 8 or all.
        self.assertEqual(chosen, [0, 1, 1, 1, 1])
        self.assertEqual(held.sum(), 8)  # rows 0 and 5 saw only the narrow one
        self.assertEqual(choose_spread.choose(hits, 1.0)[0], 1)

    def test_on_ensembles_of_the_program(self):
        out = self.path('chosen')
        command = (self.table, '--study', self.study, '--out', out, '--spread', '2', '1', '--derail', self.program)
        done = script('choose_spread.py', *command)
        self.assertEqual(done.returncode, 0, done.stderr)
        with open(os.path.join(out, 'spread.json'), encoding='utf-8') as file:
            found = json.load(file)
        self.assertEqual([c['spread'] for c in found['candidates']], [1.0, 2.0])
        self.assertEqual(found['held_out_rows'], 12)
        self.assertEqual(found['candidates'][0]['all']['rows'], 14)
        self.assertIn(found['chosen'], (1.0, 2.0))
        rows = choose_spread.read_rows(os.path.join(out, 'spread_2'))
        fast = rows['speed_mph'] >= 10.0
        self.assertEqual(found['candidates'][1]['fast']['coverage'], choose_spread.inside(rows)[fast].mean())
        self.assertIn(f"Chosen from all rows: {found['chosen']:g}.", done.stdout)
        before = os.path.getmtime(os.path.join(out, 'spread_1', 'rows.csv'))
        self.assertEqual(script('choose_spread.py', *command).stdout, done.stdout)
        self.assertEqual(os.path.getmtime(os.path.join(out, 'spread_1', 'rows.csv')), before)

    def test_what_is_wrong_is_named(self):
        out = self.path('wrong')
        command = (self.table, '--study', self.study, '--out', out, '--spread', '1', '--derail', self.program)
        code, said = refusal(choose_spread.main, *command, '--min-speed', '40')
        self.assertEqual(code, 2)
        self.assertIn('2 rows from 40 mph on are too few for 5 folds', said)
        with open(os.path.join(out, 'spread_1', 'rows.csv'), 'w', encoding='utf-8') as file:
            file.write('a,b\n1,2\n')
        code, said = refusal(choose_spread.main, *command)
        self.assertEqual(code, 2)
        self.assertIn('rows.csv: not a table', said)
        self.assertEqual(script('choose_spread.py', 'nowhere.csv', *command[1:4], self.path('none'), *command[5:]).returncode, 1)


if __name__ == '__main__':
    run_tests()
