#!/usr/bin/python3
"""measure_cost.py: tables and picture from figures that are known, the page that is filled, the process that is timed.

  test_measure_cost.py path/to/derail
"""

import json
import os
import sys

from plot_testing import PlotTest, run_tests, script

import compare_cost
import measure_cost

CARS = [20, 100, 1000]
MEASURED = {
    'machine': 'a machine',
    'start': 0.002,
    'lengths': [
        {'name': name, 'cars': CARS, 'seconds': [f * cars + 0.002 for cars in CARS], 'steps': [1000, 1000, 1000]}
        for name, f in (('fast', 1e-4), ('slow', 1e-3))
    ],
    'progress': [{'name': 'a run', 'until': [0.0, 10.0, 20.0], 'seconds': [0.002, 0.05, 0.06]}],
    'compared': [['first', 0.01, 10.0, 'this'], ['second', 1.0, 20.0, 'that']],
}


class MeasureCostTest(PlotTest):
    def test_tables_are_those_of_the_figures(self):
        table = measure_cost.runs_table(MEASURED).splitlines()
        self.assertIn('| start of the program alone | | 2 ms | |', table)
        self.assertIn('| fast | 100 | 12 ms | 100 ns |', table)
        self.assertIn('| slow | 1000 | 1 s | 1000 ns |', table)
        self.assertIn('| second | 1000 | 20.0 | 50 | that |', compare_cost.table(MEASURED['compared']))

    def test_a_page_is_filled_between_its_marks(self):
        out = self.path('measured')
        os.makedirs(os.path.join(out, 'pictures'))
        self.path('measured/cost.json', json.dumps(MEASURED))
        marks = ''.join(f'<!-- begin: {name} -->\nold\n<!-- end -->\n' for name in ('machine', 'runs'))
        page = self.path('measured/page.md', f'{marks}Before\n<!-- begin: compared -->\nold\n<!-- end -->\nafter\n')
        filled = script('measure_cost.py', out, '--fill', page)
        self.assertEqual(filled.returncode, 0, filled.stderr)
        with open(page, encoding='utf-8') as file:
            text = file.read()
        self.assertIn('<!-- begin: machine -->\na machine\n<!-- end -->\n', text)
        self.assertIn('Before\n<!-- begin: compared -->\n| one train', text)
        self.assertTrue(text.endswith('that |\n<!-- end -->\nafter\n'), text)
        self.check_picture(os.path.join(out, 'pictures', 'cost.png'))
        unmarked = script('measure_cost.py', out, '--fill', self.path('measured/page.md', 'no marks\n'))
        self.assertEqual(unmarked.returncode, 2)
        self.assertIn('marks none; wanted: each of machine, runs, compared once', unmarked.stderr)

    def test_the_time_is_that_of_the_process(self):
        spin = 'import time\nwhile time.process_time() < 0.3: pass\nprint("done")'
        seconds, out = measure_cost.Meter(sys.executable, 1).run('-c', spin)
        self.assertGreaterEqual(seconds, 0.29)
        self.assertEqual(out, b'done\n')
        seconds, outcome = measure_cost.Meter(self.program, 2).outcome('baseline.yaml', 'stop.time_max=0.1')
        self.assertGreater(seconds, 0.0)
        self.assertAlmostEqual(outcome['stop_time'], 0.1)

    def test_a_run_that_fails_is_named(self):
        failed = script('measure_cost.py', self.path('none'), '--derail', '/bin/false')
        self.assertEqual(failed.returncode, 2)
        self.assertIn('/bin/false --version: exit code 1', failed.stderr)
        failed = script('measure_cost.py', self.path('none'), '--derail', os.path.abspath(self.program), '--runs', '1', '--cars', '2')
        self.assertEqual(failed.returncode, 2)
        self.assertIn('consist[1].count', failed.stderr, "the program's own words")


if __name__ == '__main__':
    run_tests()
