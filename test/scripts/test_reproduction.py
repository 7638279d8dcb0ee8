#!/usr/bin/python3
"""reproduction.py on a real, tiny study, on made-up samples, and on a folder that lacks something.

  test_reproduction.py path/to/derail
"""

import csv
import statistics

import numpy as np

from plot_testing import KIP, MPH, PlotTest, run_tests, script

import reproduction

STUDY = """
scenario: scenario.yaml
plan: one_at_a_time
factors:
  - {key: initial.speed, label: train speed, scale: [0.5, 1.5]}
  - {key: "consist[0].count", label: train length, scale: [0.5, 1.5]}
  - {key: "consist[0].weight", label: car weight, scale: [0.5, 1.5]}
  - {key: initial.yaw_rate, label: initial angular velocity, scale: [0.5, 1.5]}
  - {key: ground.on_track_friction, label: on-track friction, scale: [0.5, 1.5]}
  - {key: ground.off_track_friction, label: off-track friction, scale: [0.5, 1.5]}
replicates: 5
perturbation: {spacing: 3 mm, yaw_rate: 0.01}
"""
READING = {'count': 'cars_off_track', 'closing': 'relative_speed_max', 'force': 'coupler_force_peak'}


class Reproduction(PlotTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.path('study.yaml', STUDY)
        cls.out = cls.path('out')
        cls.derail('study', cls.path('study.yaml'), '--out', cls.out)
        with open(cls.path('out/runs.csv'), encoding='utf-8', newline='') as file:
            cls.rows = list(csv.DictReader(file))
        cls.results = reproduction.Results(cls.out)

    def median(self, outcome, per, **inputs):
        """Over the runs whose named input is not the base's; of the base for none."""
        base = self.rows[0]
        varied = [f for f in self.results.factors if f not in inputs]
        rows = [r for r in self.rows if all(r[f] == base[f] for f in varied)]
        rows = [r for r in rows if all(abs(float(r[f]) / float(base[f]) - s) < 1e-6 for f, s in inputs.items())]
        self.assertEqual(len(rows), 5)
        return statistics.median(float(r[outcome]) / per for r in rows)

    def evaluate(self, **entry):
        return reproduction.evaluate(self.results, {'quantity': 'force', **entry}, READING)

    def test_values_and_ratios_are_those_of_the_table(self):
        slow = self.median('coupler_force_peak', KIP, **{'initial.speed': 0.5})
        base = self.median('coupler_force_peak', KIP)
        fast = self.median('coupler_force_peak', KIP, **{'initial.speed': 1.5})
        value = self.evaluate(kind='value', of=[], band=[0.99 * base, 1.01 * base])
        self.assertTrue(value.met)
        self.assertTrue(value.text.startswith(reproduction.number(base) + ' ('), value.text)
        self.assertFalse(self.evaluate(kind='value', of=[], band=[1.01 * base, 1.02 * base]).met)
        ratio = {'kind': 'ratio', 'of': ['initial.speed', 1.5], 'over': ['initial.speed', 0.5]}
        self.assertTrue(self.evaluate(**ratio, band=[0.999 * fast / slow, 1.001 * fast / slow]).met)
        self.assertFalse(self.evaluate(**ratio, band=[1.001 * fast / slow, 99.0]).met)
        change = 100.0 * (slow / base - 1.0)
        of = ['initial.speed', 0.5]
        self.assertTrue(self.evaluate(kind='change', of=of, band=[change - 0.1, change + 0.1]).met)
        self.assertFalse(self.evaluate(kind='change', of=of, band=[change + 0.1, change + 9.0]).met)

    def test_closing_over_speed_takes_each_run_at_its_own_speed(self):
        shares = [float(r['relative_speed_max']) / float(r['initial.speed']) for r in self.rows]
        half = statistics.median(shares)
        entry = {'quantity': 'closing', 'kind': 'half'}
        self.assertTrue(self.evaluate(**entry, band=[half - 1e-6, half + 1e-6]).met)

    def test_trends_and_the_input_that_matters_most(self):
        base = self.median('relative_speed_max', MPH)
        reach = {}
        for key in self.results.factors:
            ends = [self.median('relative_speed_max', MPH, **{key: scale}) for scale in (0.5, 1.5)]
            reach[key] = max(base, *ends) - min(base, *ends)
        first = max(reach, key=reach.get)
        for key in self.results.factors:
            found = self.evaluate(quantity='closing', kind='first', inputs=[key])
            self.assertEqual(found.met, key == first, found.text)
        entry = {'quantity': 'closing', 'inputs': ['initial.speed'], 'least': 0.5}
        self.assertTrue(self.evaluate(**entry, kind='rising').met)
        self.assertFalse(self.evaluate(**entry, kind='falling').met)
        self.assertFalse(self.evaluate(**{**entry, 'least': 1e3}, kind='rising').met)

    def test_pairs_that_agree(self):
        self.assertEqual(reproduction.agreeing(np.array([1.0, 1.0, 1.0]), 0.0), 1.0)
        self.assertAlmostEqual(reproduction.agreeing(np.array([1.0, 1.01, 2.0]), 0.02), 1 / 3)

    def test_the_paper_fits_itself(self):
        count, closing = np.array([6.0, 13.0, 24.0]), np.array([13.3, 19.0, 30.0])
        force = np.array([2 * 1821 / 6, 1821, 2 * 1821])
        self.assertAlmostEqual(float(reproduction.misfit(count, closing, force)), 0.0)
        self.assertAlmostEqual(float(reproduction.misfit(count + [0, 1, 0], closing, force)), 1.0)
        two = reproduction.misfit(*(np.array([q, 1.1 * q]).T for q in (count, closing, force)))
        self.assertAlmostEqual(two[0], 0.0)
        self.assertGreater(two[1], 0.5)

    def test_table_has_every_statement(self):
        run = script('reproduction.py', 'table', self.out)
        self.assertEqual(run.returncode, 0, run.stderr)
        numbers = reproduction.load('paper_numbers.yaml')['numbers']
        lines = run.stdout.splitlines()
        # A row of what the paper says, and one of what came out.
        for entry in numbers:
            said, found = (line for line in lines if line.startswith(f"| {entry['id']} |"))
            self.assertIn(entry['text'], said)
            if 'why' in entry:
                self.assertIn(f"- {entry['id']}: {entry['why'].split()[0]}", run.stdout)
        closing = self.median('relative_speed_max', MPH)
        _, row = (line for line in lines if line.startswith('| 6a |'))
        self.assertIn(f'| {reproduction.number(closing)} (', row)

    def test_refusals(self):
        run = script('reproduction.py', 'table', self.path('nowhere'))
        self.assertEqual(run.returncode, 2)
        self.assertIn('nowhere/about.json: missing', run.stderr)
        with self.assertRaisesRegex(reproduction.WrongFile, 'does not vary coupler.slack'):
            self.results.at(['coupler.slack', 0.5])
        with self.assertRaisesRegex(reproduction.WrongFile, 'no run at'):
            self.results.at(['initial.speed', 0.7])


if __name__ == '__main__':
    run_tests()
