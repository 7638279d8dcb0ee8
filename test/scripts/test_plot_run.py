#!/usr/bin/python3
"""plot_run.py on a real, short run: pictures, their geometry, clear refusals.

  test_plot_run.py path/to/derail
"""

import filecmp
import os

import numpy as np

from plot_testing import FOOT, PlotTest, refusal, run_tests, script

import plot_run
from derail_plots import run_data, run_pictures


class PlotRunTest(PlotTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.scenario = cls.path('scenario.yaml')
        cls.four, cls.one = cls.path('four.csv'), cls.path('one.csv')
        cls.derail('run', cls.scenario, '--csv', cls.four)
        cls.derail('run', cls.scenario, '--csv', cls.one, '--set', 'consist[0].count=1')
        cls.states = run_data.read_states(cls.four)
        cls.sizes = run_data.sizes_from_scenario(cls.scenario, [], cls.program, 4)

    def test_pictures_are_there_not_blank_and_the_same_twice(self):
        for out in ('first', 'second'):
            arguments = ['--scenario', self.scenario, '--derail', self.program]
            done = script('plot_run.py', self.four, '--out', self.path(out), *arguments)
            self.assertEqual(done.returncode, 0, done.stderr)
        names = ['four_forces.png', 'four_forces.svg', 'four_layout.png', 'four_layout.svg']
        self.assertEqual(sorted(os.listdir(self.path('first'))), names)
        for name in names:
            first, second = self.path('first/' + name), self.path('second/' + name)
            self.assertTrue(filecmp.cmp(first, second, shallow=False), name)
            if name.endswith('.png'):
                self.check_picture(first)

    def test_sizes_are_those_of_the_scenario(self):
        lengths, widths = self.sizes
        np.testing.assert_allclose(lengths, 61.1 * FOOT)
        np.testing.assert_allclose(widths, 9 * FOOT)
        changed = run_data.sizes_from_scenario(
            self.scenario, ['consist[0].width=8 ft'], self.program, 4
        )
        np.testing.assert_allclose(changed[1], 8 * FOOT)

    def test_without_scenario_the_gaps_give_the_length(self):
        lengths, widths = run_data.sizes_from_states(self.four, self.states)
        np.testing.assert_allclose(lengths, 61.1 * FOOT, rtol=1e-6)
        np.testing.assert_allclose(widths, 10 * FOOT)

    def test_layout_is_to_scale(self):
        corners = run_pictures._corners(self.states, *self.sizes, -1)
        centres = np.stack([self.states.x_m[-1], self.states.y_m[-1]], axis=1)
        np.testing.assert_allclose(corners.mean(axis=1) * FOOT, centres)
        sides = np.hypot(*np.moveaxis(corners - np.roll(corners, 1, axis=1), 2, 0))
        np.testing.assert_allclose(np.sort(sides, axis=1), np.tile([9.0, 9.0, 61.1, 61.1], (4, 1)))
        diagonals = np.hypot(*(corners[:, :2] - corners[:, 2:]).T)
        np.testing.assert_allclose(diagonals, np.hypot(61.1, 9.0), err_msg='right angles')
        along = corners[:, 0] - corners[:, 3]
        angle = np.arctan2(along[:, 1], along[:, 0])
        np.testing.assert_allclose(np.cos(angle - self.states.theta_rad[-1]), 1.0)
        figure = run_pictures.layout(self.states, *self.sizes, '')
        self.assertEqual({ax.get_aspect() for ax in figure.axes}, {1.0})

    def test_no_peak_is_lost_in_the_force_map(self):
        pooled, step = run_pictures._pooled(np.array([[0.0], [-3.0], [2.0]] * 1000))
        self.assertTrue(np.all(pooled == -3.0))
        self.assertEqual(len(pooled), -(-3000 // step))
        self.assertLessEqual(len(pooled), run_pictures.CELLS)

    def test_what_is_wrong_is_named(self):
        with open(self.one, encoding='utf-8') as file:
            torn = self.path('torn.csv', file.read()[:-200])
        program = ['--derail', self.program]
        none_yaml = self.path('none.yaml')
        for arguments, wanted in [
            ([self.path('none.csv')], 'none.csv: No such file'),
            ([self.scenario], 'scenario.yaml: no column time_s'),
            ([torn], 'torn.csv: '),
            ([self.one], 'one.csv: the length of a single car is not in it; give --scenario'),
            ([self.one, '--scenario', self.scenario, *program], '4 cars, but the states are of 1'),
            ([self.one, '--scenario', none_yaml, *program], 'none.yaml'),
            ([self.one, '--scenario', 'x', '--derail', '/no/derail'], '/no/derail: no such'),
        ]:
            code, said = refusal(plot_run.main, *arguments)
            self.assertEqual((code, said.count('\n')), (2, 1), said)
            self.assertIn(wanted, said)


if __name__ == '__main__':
    run_tests()
