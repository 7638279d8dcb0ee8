#!/usr/bin/python3
"""plot_verify.py on a real, short verification: pictures, what is drawn, clear refusals.

  test_plot_verify.py path/to/derail
"""

import json
import os
import shutil

import numpy as np

from plot_testing import SCRIPTS, PlotTest, refusal, run_tests, script

import plot_verify
from derail_plots import verification


class PlotVerifyTest(PlotTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.results = cls.path('results')
        short = ['--set', 'stop.time_max=1 s', '--set', 'consist[0].count=3', '--runs', '8']
        cls.derail('verify', cls.path('scenario.yaml'), *short, '--out', cls.results)
        cls.in_space = cls.path('in_space')
        scenario = os.path.join(SCRIPTS, '..', 'config', 'verify3d.yaml')
        cls.derail('verify', scenario, '--set', 'stop.time_max=0.5 s', '--runs', '2', '--out', cls.in_space)

    def test_pictures_are_there_and_not_blank(self):
        done = script('plot_verify.py', self.results)
        self.assertEqual(done.returncode, 0, done.stderr)
        folder = os.path.join(self.results, 'pictures')
        kinds = [f'{n}.{k}' for n in ('ensembles', 'growth') for k in ('png', 'svg')]
        self.assertEqual(sorted(os.listdir(folder)), [f'verification_{kind}' for kind in kinds])
        for name in os.listdir(folder):
            if name.endswith('.png'):
                self.check_picture(os.path.join(folder, name))

    def test_what_is_drawn_is_what_was_found(self):
        trains = verification.read_differences(self.results)
        self.assertEqual(sorted(trains), [1, 2, 3])
        for d in trains.values():
            np.testing.assert_allclose(np.diff(d['time_s']), 0.01)
            self.assertLess(d['position_m'].max(), 1e-3)
        summary = verification.read_summary(self.results)
        figure = verification.ensembles(summary)
        for ax, q in zip(figure.axes, summary['ensemble']['quantities']):
            for line, engine in zip(ax.lines, ('purpose_built', 'multibody')):
                np.testing.assert_allclose(
                    np.sort(line.get_xdata())[:-1] * q['per_shown'], np.sort(q[engine])
                )

    def test_limits_are_those_by_which_each_was_judged(self):
        for folder, second in ((self.results, 'force'), (self.in_space, 'angle')):
            summary = verification.read_summary(folder)
            figure = verification.growth(summary, verification.read_differences(folder))
            early, criteria = summary['early'], summary['criteria']
            allowed = (early['position_allowed'], early['angle_allowed'] if second == 'angle' else criteria['force'])
            for ax, limit in zip(figure.axes, allowed):
                drawn = ax.lines[3]  # after three trains
                np.testing.assert_allclose(drawn.get_xdata(), [0.0, early['time_judged']])
                np.testing.assert_allclose(drawn.get_ydata(), [limit, limit])
                whole_train = ax.lines[2]
                inside = whole_train.get_xdata() <= early['time_judged']
                self.assertLess(whole_train.get_ydata()[inside].max(), limit)
            self.assertIn(second, figure.axes[1].get_title())

    def test_what_is_wrong_is_named(self):
        broken = self.path('broken')
        shutil.copytree(self.results, broken)
        code, said = refusal(plot_verify.main, self.path('nowhere'))
        self.assertEqual(code, 2)
        self.assertIn('verify.json: No such file', said)
        with open(os.path.join(broken, 'verify.json'), encoding='utf-8') as file:
            summary = json.load(file)
        del summary['ensemble']['quantities']
        with open(os.path.join(broken, 'verify.json'), 'w', encoding='utf-8') as file:
            json.dump(summary, file)
        code, said = refusal(plot_verify.main, broken)
        self.assertEqual((code, said.count('\n')), (2, 1), said)
        self.assertIn("'quantities' is missing", said)
        with open(os.path.join(broken, 'differences.csv'), 'w', encoding='utf-8') as file:
            file.write('a,b\n1,2\n')
        self.assertIn('differences.csv: not a table', refusal(plot_verify.main, broken)[1])


if __name__ == '__main__':
    run_tests()
