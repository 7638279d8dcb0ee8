#!/usr/bin/python3
"""plot_validate.py on real, short ensembles: pictures, what is drawn, clear refusals.

  test_plot_validate.py path/to/derail
"""

import os
import shutil

import numpy as np

from plot_testing import PlotTest, refusal, run_tests, script

import plot_validate
from derail_plots import validation

SPEEDS = (4, 10, 15, 16, 31, 44)
REAL = (1, 2, 3, 2, 5, 6)


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
