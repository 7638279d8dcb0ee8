#!/usr/bin/python3
"""plot_run.py on a real, short run: pictures, their geometry, clear refusals.

  test_plot_run.py path/to/derail
"""

import filecmp
import os

import numpy as np

from plot_testing import FOOT, KIP, PlotTest, refusal, run_tests, script

import plot_run
from derail_plots import run_data, run_pictures


CURVED = """
consist:
  - {count: 12, length: 55 ft, weight: 286 kip, truck_spacing: 42 ft}
ground: {on_track_law: rails, off_track_law: by_slip}
track:
  curves:
    - {start: -150 m, length: 120 m, curvature: 4 deg/(100 ft)}
    - {start: 40 m, length: 200 m, curvature: -4 deg/(100 ft)}
initial: {speed: 20 mph, yaw_rate: 0.1}
stop: {time_max: 1 s}
solver: {method: semi_implicit, fixed_step: 0.002}
"""


class PlotRunTest(PlotTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.scenario = cls.path('scenario.yaml')
        cls.four, cls.one = cls.path('four.csv'), cls.path('one.csv')
        cls.derail('run', cls.scenario, '--csv', cls.four)
        cls.derail('run', cls.scenario, '--csv', cls.one, '--set', 'consist[0].count=1')
        cls.states = run_data.read_states(cls.four)
        cls.sizes = cls.sizes_of(cls.scenario, [], 4)

    @classmethod
    def sizes_of(cls, scenario, overrides, cars):
        tree = run_data.scenario_in_si(scenario, overrides, cls.program)
        return run_data.sizes_from_scenario(scenario, tree, cars)

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
        changed = self.sizes_of(self.scenario, ['consist[0].width=8 ft'], 4)
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
        figure = run_pictures.layout(self.states, *self.sizes, run_pictures.STRAIGHT, '')
        self.assertEqual({ax.get_aspect() for ax in figure.axes}, {1.0})

    def test_the_track_is_where_the_cars_on_it_are(self):
        scenario = self.path('curved.yaml', CURVED)
        states_csv = self.path('curved.csv')
        self.derail('run', scenario, '--csv', states_csv)
        states = run_data.read_states(states_csv)
        tree = run_data.scenario_in_si(scenario, [], self.program)
        track = run_pictures.track_under(states, tree) * FOOT
        # A truck centre of a car on the rails is on the centre line; the middle of the car a little inside of the curve.
        middles = np.stack([states.x_m[0], states.y_m[0]], axis=1)
        self.assertGreater(np.ptp(middles[:, 1]), 20.0, 'the scenario is curved')
        distance = np.array([np.hypot(*(track - m).T).min() for m in middles])
        self.assertLess(distance.max(), 0.5 * run_pictures.TRACK_STEP + 0.6)
        steps = np.hypot(*np.diff(track, axis=0).T)
        np.testing.assert_allclose(steps, run_pictures.TRACK_STEP, rtol=1e-3)
        zero = run_data.centre_line(tree, [0.0, 1.0, -1.0])
        np.testing.assert_allclose(zero, [[0, 0], [1, 0], [-1, 0]], atol=2e-3)
        # Without the scenario no line is drawn that is not there.
        self.assertFalse(run_data.is_straight(states))
        self.assertTrue(run_data.is_straight(self.states))
        for arguments, lines in ((['--scenario', scenario, '--derail', self.program], 1), ([], 0)):
            a = plot_run.parsed([states_csv, *arguments])
            figure = next(iter(plot_run.pictures(a)))[2]
            drawn = [line for line in figure.axes[0].lines if line.get_color() == '0.55']
            self.assertEqual(len(drawn), lines)
            if lines:
                self.assertGreater(np.ptp(drawn[0].get_ydata()), 100.0)

    def test_a_train_in_space_is_drawn_from_above(self):
        scenario = os.path.join(os.path.dirname(plot_run.__file__), '..', 'config', 'accident3d.yaml')
        change = ['--set', 'consist[1].count=12', '--set', 'initial.cars_ahead=2']
        self.derail('run', scenario, '--csv', self.path('space.csv'), *change)
        done = script('plot_run.py', self.path('space.csv'), '--out', self.path('space'), '--scenario', scenario, '--derail',
                      self.program, *change)
        self.assertEqual(done.returncode, 0, done.stderr)
        for kind in ('forces', 'layout'):
            self.check_picture(self.path(f'space/space_{kind}.png'))

    def test_cars_on_their_side_and_inverted_are_marked(self):
        zero = np.zeros((1, 4))
        x = np.array([[0.0, -20.0, -40.0, -60.0]])
        tilt = np.radians([[2.0, 80.0, 170.0, 100.0]])
        sizes = np.full(4, 17.0), np.full(4, 3.0)
        arrays = (np.zeros(1), x, zero, zero, zero + 1, zero + 1, zero, zero)
        for states, labels, drawn in (
            (run_data.States(*arrays, tilt_rad=tilt), {'car on its side', 'car inverted'}, {'car on its side': 2, 'car inverted': 1}),
            (run_data.States(*arrays, tilt_rad=0.0 * tilt), set(), {}),
            (run_data.States(*arrays), set(), {}),
        ):
            figure = run_pictures.layout(states, *sizes, run_pictures.STRAIGHT, '')
            texts = {t.get_text() for t in figure.legends[0].get_texts()}
            self.assertEqual(texts & {'car on its side', 'car inverted'}, labels)
            hatched = [c for c in figure.axes[-1].collections if c.get_hatch()]
            self.assertEqual(sorted(len(c.get_paths()) for c in hatched), sorted(drawn.values()))

    def test_points_at_which_cars_leave_the_track_are_not_joined(self):
        figure = run_pictures.forces(self.states)
        line = figure.legends[0].get_lines()[0]
        self.assertEqual(line.get_linestyle(), 'None')
        self.assertEqual([d.get_linestyle() for d in figure.axes[0].lines], ['None', '--'])

    def test_the_larger_view_is_of_what_lies_together_not_of_what_has_rolled_away(self):
        far = 20
        x = np.concatenate([[9000.0, 8980.0], np.arange(far) * -5.0, -150.0 - 20.0 * np.arange(30)])
        cars = len(x)
        off = np.zeros((1, cars))
        off[0, 0] = off[0, 2:2 + far] = 1  # the first of two locomotives has derailed and is 9 km away
        rows = [np.full((1, cars), v) for v in (0.0, 0.0)]
        states = run_data.States(np.zeros(1), x[None], rows[0], rows[1], off, off, rows[0], rows[0])
        figure = run_pictures.layout(states, np.full(cars, 17.0), np.full(cars, 3.0), run_pictures.STRAIGHT, '')
        low, high = figure.axes[-1].get_xlim()
        self.assertLess(high - low, 1000.0, 'ft')
        self.assertTrue(low < -95.0 / FOOT and high > 0.0, 'all that lie together')
        numbers = {t.get_text() for t in figure.axes[-1].texts}
        self.assertNotIn('1', numbers)
        self.assertIn('5', numbers)

    def test_no_peak_is_lost_in_the_force_map(self):
        pooled, step = run_pictures._pooled(np.array([[0.0], [-3.0], [2.0]] * 1000))
        self.assertTrue(np.all(pooled == -3.0))
        self.assertEqual(len(pooled), -(-3000 // step))
        self.assertLessEqual(len(pooled), run_pictures.CELLS)

    def test_peaks_are_those_of_the_steps_where_the_table_has_them(self):
        zero = np.zeros((2, 2))
        axial = np.array([[10.0, np.nan], [-30.0, np.nan]]) * KIP
        states = run_data.States(np.arange(2.0), zero, zero, zero, zero, zero, zero, axial)
        self.assertEqual([list(p) for p in run_pictures.peak_forces(states)], [[10.0], [30.0]])
        more = np.array([[0.0, np.nan], [200.0, np.nan]]) * KIP
        states = run_data.States(np.arange(2.0), zero, zero, zero, zero, zero, zero, axial, more, 0.5 * more)
        self.assertEqual([list(p) for p in run_pictures.peak_forces(states)], [[200.0], [100.0]])

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
