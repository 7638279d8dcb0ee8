#!/usr/bin/python3
"""plot_validate.py on real, short ensembles: pictures, what is drawn, clear refusals.

  test_plot_validate.py path/to/derail
"""

import os
import shutil

import numpy as np

from plot_testing import SCRIPTS, PlotTest, refusal, run_tests, script

import plot_validate
from derail_plots import validation

SPEEDS = (4, 10, 15, 16, 31, 44)
REAL = (1, 2, 3, 2, 5, 6)
POSTURE = f"""
title: short, in space
scenario: {os.path.realpath(os.path.join(SCRIPTS, '..', 'config', 'accident3d.yaml'))}
plan: latin_hypercube
samples: 3
factors:
  - {{key: rails.derail_ratio, low: 0.9, high: 1.2}}
perturbation: {{kick: 1 ft/s}}
"""


class PlotValidateTest(PlotTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        rows = [(v, i + 6, 130 + i * i, n) for i, (v, n) in enumerate(zip(SPEEDS, REAL))]
        table, study = cls.accidents(rows)
        cls.results = cls.path('results')
        cls.derail('validate', table, '--study', study, '--out', cls.results)

    def broken(self, name):
        folder = self.path(name)
        shutil.copytree(self.results, folder)
        return folder

    def test_pictures_are_there_and_not_blank(self):
        done = script('plot_validate.py', self.results)
        self.assertEqual(done.returncode, 0, done.stderr)
        folder = os.path.join(self.results, 'pictures')
        kinds = [f'validation_{n}.{k}' for n in ('counts', 'speed', 'tail') for k in ('png', 'svg')]
        self.assertEqual(sorted(os.listdir(folder)), kinds)
        for name in kinds[::2]:
            self.check_picture(os.path.join(folder, name))

    def test_what_is_drawn_is_what_was_found(self):
        rows, summary = validation.read_rows(self.results), validation.read_summary(self.results)
        np.testing.assert_array_equal(rows['speed_mph'], SPEEDS)
        np.testing.assert_array_equal(rows['cars_derailed'], REAL)

        ax = validation.against_real(summary, rows).axes[0]
        drawn = np.sort(np.concatenate([line.get_ydata() for line in ax.lines[1:]]))
        np.testing.assert_allclose(drawn, np.sort(rows['predicted_median']))
        ends = np.array(ax.collections[0].get_segments())[:, :, 1]
        np.testing.assert_allclose(ends[:, 0], rows['predicted_low'])
        np.testing.assert_allclose(ends[:, 1], rows['predicted_high'])

        ax = validation.over_speed(summary, rows).axes[0]
        bands = summary['groups'][0]['speeds']
        self.assertEqual([b['rows'] for b in bands], [1, 2, 1, 1, 1])
        for line, band in zip(ax.lines, bands):
            np.testing.assert_allclose(line.get_ydata(), band['predicted'])

        ax = validation.error_over_tail(summary, rows).axes[0]
        np.testing.assert_allclose(
            ax.lines[1].get_ydata(), rows['predicted_median'] - rows['cars_derailed']
        )

    def posture(self, name, *more):
        """Results of a table of posture, by the loaded unit train in space."""
        study = self.path('posture.yaml', POSTURE)
        rows = [(14, 12, 8, 0), (19, 14, 5, 2), (25, 16, 9, 9), (28, 12, 6, 3), (45, 15, 4, 4)]
        lines = ['date,speed_mph,cars_in_train,cars_derailed_narrative,loads_derailed_form,'
                 'empties_derailed_form,on_side_or_over,cause']
        lines += [f'2002-01-{i + 1:02},{v},{n},{derailed},{derailed},0,{over},T207'
                  for i, (v, n, derailed, over) in enumerate(rows)]
        table = self.path(f'{name}.csv', '\n'.join(lines) + '\n')
        results = self.path(name)
        self.derail('validate', table, '--study', study, '--out', results, *more)
        return results

    def test_posture_is_drawn_where_there_is_one(self):
        results = self.posture('space')
        done = script('plot_validate.py', results)
        self.assertEqual(done.returncode, 0, done.stderr)
        pictures = os.path.join(results, 'pictures')
        self.assertEqual(sorted(os.listdir(pictures)), [f'validation_posture.{k}' for k in ('png', 'svg')])
        self.check_picture(os.path.join(pictures, 'validation_posture.png'))

        summary = validation.read_summary(results)
        bands = summary['posture']
        self.assertEqual([b['real']['count'] for b in bands], [2, 2, 4])
        axes = validation.posture(summary).axes
        for ax, key in zip(axes, ('over', 'none_over', 'all_over')):
            for line, side in zip(ax.lines, ('real', 'predicted')):
                np.testing.assert_allclose(line.get_ydata(), [b[side][key] for b in bands])
        np.testing.assert_allclose(axes[0].lines[0].get_ydata(), [2 / 13, 12 / 15, 14 / 28])
        self.assertGreater(axes[0].lines[1].get_ydata()[-1], 0.0, 'no car of any member is over')
        np.testing.assert_allclose(axes[1].lines[0].get_ydata(), [1 / 2, 0.0, 1 / 4])
        np.testing.assert_allclose(axes[2].lines[0].get_ydata(), [0.0, 1 / 2, 1 / 4])
        for spread, side in zip(axes[0].collections, ('real', 'predicted')):
            for segment, band in zip(spread.get_segments(), bands):
                share, sd = band[side]['over'], band[side]['sd']
                np.testing.assert_allclose(segment[:, 1], np.clip([share - sd, share + sd], 0.0, 1.0))

    def test_a_table_with_nothing_to_draw_is_refused_with_the_reason(self):
        code, said = refusal(plot_validate.main, self.posture('plane', '--set', 'model=extended'))
        self.assertEqual(code, 2)
        self.assertIn('nothing to draw: rows.csv has not all of the columns', said)

    def test_what_is_wrong_is_named(self):
        code, said = refusal(plot_validate.main, self.path('nowhere'))
        self.assertEqual(code, 2)
        self.assertIn('validation.json: No such file', said)
        broken = self.broken('no_groups')
        with open(os.path.join(broken, 'validation.json'), 'w', encoding='utf-8') as file:
            file.write('{"rows": 6, "members": 3}')
        code, said = refusal(plot_validate.main, broken)
        self.assertEqual((code, said.count('\n')), (2, 1), said)
        self.assertIn("'groups' is missing", said)
        with open(os.path.join(broken, 'rows.csv'), 'w', encoding='utf-8') as file:
            file.write('a,b\n1,2\n')
        self.assertIn('rows.csv: not a table', refusal(plot_validate.main, broken)[1])


if __name__ == '__main__':
    run_tests()
