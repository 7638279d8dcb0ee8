#!/usr/bin/python3
"""plot_study.py on real, tiny studies: which pictures, what is in them, clear refusals.

  test_plot_study.py path/to/derail
"""

import csv
import filecmp
import html.parser
import json
import os
import re
import shutil
import tempfile
import xml.etree.ElementTree

import matplotlib.text
import numpy as np

from plot_testing import KIP, PlotTest, refusal, run_tests, script

import plot_study
from derail_plots import one_at_a_time, sensitivity, study_data, style

STUDIES = {
    'alone': """
title: "$ugly$ & <b>"
scenario: scenario.yaml
plan: one_at_a_time
factors:
  - {key: initial.speed, label: train speed, scale: [0.5, 0.8, 1.5]}
  - {key: "consist[0].weight", label: a rather long label for a narrow panel, scale: [0.5, 1.2]}
  - {key: ground.on_track_law, values: [isotropic, guided]}
  - {key: solver.steps_max, label: 'limit of $\\steps$', values: [20]}
replicates: 4
perturbation: {spacing: 3 mm, yaw_rate: 0.01}
outcomes: [cars_past_pod, coupler_force_peak, closing_speed_max]
""",
    'grid': """
scenario: scenario.yaml
plan: grid
factors:
  - {key: initial.speed, label: train speed, values: [10 mph, 20 mph, 30 mph]}
  - {key: ground.off_track_friction, values: [0.4, 0.6]}
  - {key: ground.on_track_law, values: [isotropic, guided]}
replicates: 3
perturbation: {spacing: 3 mm, yaw_rate: 0.01}
outcomes: [coupler_force_peak, pile_up_length]
""",
    'random': """
scenario: scenario.yaml
plan: saltelli
samples: 8
factors:
  - {key: initial.speed, label: train speed, low: 10 mph, high: 30 mph}
  - {key: coupler.stiffness, distribution: log_uniform, low: 5e6 lbf/ft, high: 1e8 lbf/ft}
perturbation: {spacing: 3 mm, yaw_rate: 0.01}
outcomes: [cars_past_pod, coupler_force_peak]
""",
}
EXPECTED = {
    'alone': [
        f'{kind}_{outcome}'
        for kind in ('tornado', 'overview', 'bands')
        for outcome in ('cars_past_pod', 'coupler_force_peak', 'closing_speed_max')
    ],
    'grid': ['curves_coupler_force_peak', 'curves_pile_up_length'],
    'random': ['distributions', 'sobol', 'scatter_cars_past_pod', 'scatter_coupler_force_peak'],
}


def overlaps(a, b):
    """Of two boxes in pixels; a touch is none."""
    return min(a.x1, b.x1) - max(a.x0, b.x0) > 0.5 and min(a.y1, b.y1) - max(a.y0, b.y0) > 0.5


class Page(html.parser.HTMLParser):
    """What a page would load."""

    def __init__(self):
        super().__init__()
        self.images, self.loads = [], []

    def handle_starttag(self, tag, attrs):
        attrs = dict(attrs)
        if tag == 'img':
            self.images.append(attrs['src'])
        self.loads += [attrs[a] for a in ('src', 'href', 'data', 'srcset') if a in attrs]


class PlotStudyTest(PlotTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.figures = {}
        for name, text in STUDIES.items():
            cls.derail('study', cls.path(f'{name}.yaml', text), '--out', cls.path(name))
            done = script('plot_study.py', cls.path(name))
            assert done.returncode == 0, done.stderr
            study = study_data.read(cls.path(name))
            cls.figures.update((n, figure) for n, _, figure in plot_study.pictures(study))
        for figure in cls.figures.values():
            figure.draw_without_rendering()

    def copy(self, name):
        """A study without its pictures, to be spoilt."""
        folder = tempfile.mkdtemp(dir=self.folder)
        return shutil.copytree(
            self.path(name), os.path.join(folder, name), ignore=shutil.ignore_patterns('pictures')
        )

    def test_every_picture_is_there_and_not_blank(self):
        for study, names in EXPECTED.items():
            folder = self.path(f'{study}/pictures')
            self.assertEqual(
                sorted(os.listdir(folder)),
                sorted(f'{n}.{kind}' for n in names for kind in ('png', 'svg')),
            )
            for name in names:
                self.check_picture(os.path.join(folder, name + '.png'))
                root = xml.etree.ElementTree.parse(os.path.join(folder, name + '.svg')).getroot()
                self.assertIn(' runs', root.find('{http://www.w3.org/2000/svg}title').text)

    def test_same_input_same_bytes_whatever_the_user_has_set(self):
        self.path(
            'matplotlibrc',
            'font.size: 20\nsvg.hashsalt: other\naxes.facecolor: black\nbackend: pdf\n',
        )
        for study in STUDIES:
            copy = self.copy(study)
            done = script(
                'plot_study.py',
                '.',
                cwd=copy,
                env={
                    **os.environ,
                    'PYTHONHASHSEED': '7',
                    'TZ': 'Asia/Tokyo',
                    'MATPLOTLIBRC': self.folder,
                },
            )
            self.assertEqual(done.returncode, 0, done.stderr)
            for name in os.listdir(os.path.join(copy, 'pictures')):
                self.assertTrue(
                    filecmp.cmp(
                        os.path.join(copy, 'pictures', name),
                        self.path(f'{study}/pictures/{name}'),
                        shallow=False,
                    ),
                    name,
                )

    def test_spreads_are_those_of_the_runs(self):
        study = study_data.read(self.path('alone'))
        self.assertEqual((study.runs, study.failed), (32, 4))
        self.assertIn('32 runs, 4 a point, 4 failed', study.counted)
        with open(self.path('alone/runs.csv'), encoding='utf-8') as file:
            base = [
                float(r['coupler_force_peak']) / KIP
                for r in csv.DictReader(file)
                if r['point'] == '0'
            ]
        spread = one_at_a_time.base_spread(study, study.outcomes[1])
        np.testing.assert_allclose(
            (spread.low, spread.median, spread.high), np.quantile(base, (0.0, 0.5, 1.0))
        )

    def test_lines_hold_change_over_change(self):
        study = study_data.read(self.path('alone'))
        speed, weight, law, limit = one_at_a_time.lines(study, study.outcomes[1])
        np.testing.assert_allclose(
            [s.x for s in speed.settings], [-50.0, -20.0, 0.0, 50.0], atol=1e-9
        )
        np.testing.assert_allclose([s.x for s in weight.settings], [-50.0, 0.0, 20.0], atol=1e-9)
        self.assertEqual(
            (law.kind, [s.text for s in law.settings]), ('choice', ['isotropic', 'guided'])
        )
        self.assertEqual(len(limit.known), 1, 'all runs of the other value have failed')
        self.assertEqual(
            [end and end.x for end in weight.ends],
            [s.x for s in (weight.settings[0], weight.settings[-1])],
        )
        scale = one_at_a_time.Scale(
            study.outcomes[1], one_at_a_time.base_spread(study, study.outcomes[1])
        )
        self.assertAlmostEqual(scale(1.5 * scale.base.median), 50.0)
        figure = sensitivity.overview(study, study.outcomes[1])
        drawn = next(
            line
            for line in figure.axes[0].lines
            if line.get_marker() == 'o' and len(line.get_xdata()) == 4
        )
        np.testing.assert_allclose(
            drawn.get_ydata(), [scale(s.spread.median) for s in speed.settings]
        )

    def test_random_plans_show_every_run(self):
        for ax in self.figures['distributions'].axes:
            self.assertEqual(sum(bar.get_height() for bar in ax.patches), 32)
        study = study_data.read(self.path('random'))
        for ax, factor in zip(self.figures['scatter_coupler_force_peak'].axes, study.factors):
            x, y = ax.lines[0].get_data()
            np.testing.assert_allclose(x, study.samples[factor.name])
            np.testing.assert_allclose(y, study.samples['coupler_force_peak'])
        self.assertEqual(len(self.figures['sobol'].axes[0].patches), 2 * len(study.factors))

    def test_axes_say_what_they_show_in_units_that_people_read(self):
        labels = {
            name: ' | '.join(t.get_text() for t in figure.findobj(matplotlib.text.Text))
            for name, figure in self.figures.items()
        }
        for name, wanted in {
            'bands_coupler_force_peak': [
                '32 runs',
                'kip',
                '(base:\u00a020\u00a0mph)',
                'limit of $\\steps$',
            ],
            'tornado_coupler_force_peak': ['peak coupler force (kip)', '10 mph | 30 mph'],
            'overview_closing_speed_max': ['base: ', ' mph', 'change of the input (%)'],
            'curves_pile_up_length': [
                'train speed (mph)',
                'pile-up length (ft)',
                '36 runs, 3 a point',
            ],
            'scatter_coupler_force_peak': [
                'coupler.stiffness (lbf/ft)',
                'peak coupler force (kip)',
                '10⁷',
            ],
            'distributions': ['32 runs', 'peak coupler force (kip)'],
            'sobol': ['8 samples', 'train speed'],
        }.items():
            for text in wanted:
                self.assertIn(text, labels[name], name)

    def test_logarithmic_axes_have_numbers_whatever_their_span(self):
        for low, high, wanted in (
            (240.0, 634.0, ['300', '400', '500', '600']),
            (1.25, 20.0, ['2', '3', '5', '10', '20']),
            (1.5e6, 8e6, ['2·10⁶', '3·10⁶', '5·10⁶']),
            (1.1, 1.9, ['1.2', '1.4', '1.6', '1.8']),
            (1e-3, 1e3, None),
        ):
            figure, (ax,) = style.panels(1, 1, style.ONE_COLUMN, 2.0)
            ax.set_xlim(low, high)
            style.logarithmic(ax)
            figure.draw_without_rendering()
            shown = [t.get_text() for t in ax.get_xticklabels()]
            if wanted:
                self.assertEqual(shown, wanted)
            else:
                self.assertTrue(all(t.startswith('10') for t in shown), shown)

    def test_ranges_of_few_runs_are_called_what_they_are(self):
        for name, wanted in (
            ('overview_coupler_force_peak', ['lowest to highest of 4 runs', 'lowest to highest of 4 runs at the base']),
            ('bands_coupler_force_peak', ['lowest to highest of 4 runs', 'lowest to highest of 4 runs at the base']),
            ('tornado_coupler_force_peak', ['lowest to highest of 4 runs', 'lowest to highest of 4 runs at the base']),
            ('curves_coupler_force_peak', ['lowest to highest of 3 runs']),
            ('distributions', ['ends of: 5 to 95 % of 32 runs']),
        ):
            texts = [t.get_text() for t in self.figures[name].legends[0].get_texts()]
            for text in wanted:
                self.assertIn(text, texts, name)
            self.assertFalse([t for t in texts if '5\N{EN DASH}95' in t], name)

    def test_points_stand_at_their_inputs(self):
        """Not beside them: both axes of an overview have a meaning."""
        (ax,) = self.figures['overview_coupler_force_peak'].axes
        drawn = [line for line in ax.lines if line.get_linestyle() != 'none' and len(line.get_xdata()) > 2]
        self.assertEqual(len(drawn), 2)
        np.testing.assert_allclose(drawn[0].get_xdata(), [-50, -20, 0, 50], atol=1e-6)
        np.testing.assert_allclose(drawn[1].get_xdata(), [-50, 0, 20], atol=1e-6)

    def test_no_label_lies_on_another(self):
        for name, figure in self.figures.items():
            self.check_layout(name, figure)

    def check_layout(self, name, figure):
        panels = [ax.get_tightbbox() for ax in figure.axes]
        for i, a in enumerate(panels):
            self.assertFalse(any(overlaps(a, b) for b in panels[:i]), f'{name}: panels overlap')
        around = [
            text.get_window_extent() for text in (figure._suptitle, figure._supylabel) if text
        ]
        around += [legend.get_window_extent() for legend in figure.legends]
        self.assertEqual(len(figure.legends), 1, name)
        for i, a in enumerate(around):
            self.assertTrue(
                a.x0 >= 0 and a.y0 >= 0 and a.x1 <= figure.bbox.x1 and a.y1 <= figure.bbox.y1,
                f'{name}: title, side label or legend leaves the picture',
            )
            self.assertFalse(
                any(overlaps(a, b) for b in panels + around[:i]),
                f'{name}: title, side label or legend overlaps',
            )
        for ax in figure.axes:
            for axis in (ax.xaxis, ax.yaxis):
                boxes = [
                    t.label1.get_window_extent()
                    for t in axis._update_ticks()
                    if t.label1.get_visible() and t.label1.get_text()
                ]
                for i, a in enumerate(boxes):
                    self.assertFalse(
                        any(overlaps(a, b) for b in boxes[:i]),
                        f'{name}: numbers of an axis overlap',
                    )

    def test_what_is_wrong_is_named(self):
        def refused(folder, *texts):
            code, said = refusal(plot_study.main, folder)
            self.assertEqual((code, said.count('\n')), (2, 1), said)
            for text in texts:
                self.assertIn(text, said)

        refused('/no/such/folder', '/no/such/folder: no such folder')
        for name in ('study.json', 'about.json', 'runs.csv', 'summary.csv', 'sobol.csv'):
            folder = self.copy('random')
            os.remove(os.path.join(folder, name))
            refused(folder, os.path.join(folder, name) + ': missing')
            with open(os.path.join(folder, name), 'w', encoding='utf-8') as file:
                file.write('{"a",\n')
            refused(folder, name)
        folder = self.copy('grid')
        with open(os.path.join(folder, 'runs.csv'), 'r+', encoding='utf-8') as file:
            text = file.read()
            file.seek(0)
            file.write(text.replace('0', '1', 1))
        refused(folder, 'runs.csv: not as it was written', '--resume')
        folder = self.copy('grid')
        with open(os.path.join(folder, 'about.json'), encoding='utf-8') as file:
            about = json.load(file)
        del about['columns']['initial.speed']
        with open(os.path.join(folder, 'about.json'), 'w', encoding='utf-8') as file:
            json.dump(about, file)
        refused(folder, 'about.json', 'initial.speed', '--resume')

    def test_an_ensemble_has_its_distributions(self):
        study = self.path('ensemble.yaml', 'scenario: scenario.yaml\nfactors: []\nreplicates: 6\nperturbation: {spacing: 3 mm}\n')
        self.derail('study', study, '--out', self.path('ensemble'))
        drawn = list(plot_study.pictures(study_data.read(self.path('ensemble'))))
        self.assertEqual([name for name, _, _ in drawn], ['distributions'])
        self.assertIn('6 runs', drawn[0][1])

    def test_pictures_that_cannot_be_written_are_said(self):
        folder = self.copy('grid')
        with open(os.path.join(folder, 'pictures'), 'w', encoding='utf-8'):
            pass
        code, said = refusal(plot_study.main, folder)
        self.assertEqual(code, 1)
        self.assertIn(os.path.join(folder, 'pictures'), said)

    def again(self, *changes, seed=8):
        """The study `alone` a second time, with other draws; `changes`: further (old, new) in its file."""
        folder = tempfile.mkdtemp(dir=self.folder)
        text = STUDIES['alone'] + f'seed: {seed}\n'
        for old, new in changes:
            self.assertIn(old, text)
            text = text.replace(old, new)
        path = os.path.join(folder, 'again.yaml')
        with open(path, 'w', encoding='utf-8') as file:
            file.write(text.replace('scenario.yaml', self.path('scenario.yaml')))
        self.derail('study', path, '--out', os.path.join(folder, 'again'))
        return os.path.join(folder, 'again')

    def test_two_studies_side_by_side(self):
        ours, again = self.copy('alone'), self.again()
        done = script('plot_study.py', ours, '--beside', again)
        self.assertEqual(done.returncode, 0, done.stderr)
        names = [f'beside_{o}' for o in ('cars_past_pod', 'closing_speed_max', 'coupler_force_peak')]
        found = sorted(os.listdir(os.path.join(ours, 'pictures')))
        self.assertEqual(found, [f'{n}.{kind}' for n in names for kind in ('png', 'svg')])
        for name in names:
            self.check_picture(os.path.join(ours, 'pictures', name + '.png'))
        studies = [study_data.read(folder) for folder in (ours, again)]
        outcome = studies[0].outcomes[1]
        figure = sensitivity.beside(*studies, outcome)
        figure.draw_without_rendering()
        self.check_layout('beside', figure)
        scale = one_at_a_time.Scale(outcome, one_at_a_time.base_spread(studies[0], outcome))
        for ax, study in zip(figure.axes, studies):
            speed = one_at_a_time.lines(study, outcome)[0]
            np.testing.assert_allclose(
                ax.lines[1].get_ydata(), [scale(s.spread.median) for s in speed.settings]
            )
            self.assertIn('32 runs, 4 a point, 4 failed', ax.get_title())

    def test_probability_that_two_studies_are_alike(self):
        study = study_data.read(self.path('alone'))
        same, other, larger = (study_data.read(self.again(seed=s)) for s in (8, 9, 8))
        force = study.outcomes[1]
        self.assertEqual(one_at_a_time.probability_of_alike(study, study, force), 1.0)
        self.assertGreater(one_at_a_time.probability_of_alike(same, other, force), 0.01)
        larger.samples[force.name] = 1.5 * larger.samples[force.name]
        self.assertLess(one_at_a_time.probability_of_alike(same, larger, force), 0.001)
        # One point, two runs against two, all apart: 2 of the 6 ways to deal them.
        few = [study_data.Study('', '', 2, [], [], {}, set(), points={0: {}}) for _ in range(2)]
        for one, values in zip(few, ([1.0, 2.0], [3.0, 4.0])):
            one.sample_points, one.samples = [0, 0], {force.name: np.array(values)}
        self.assertAlmostEqual(
            one_at_a_time.probability_of_alike(*few, force, exchanges=49999), 1.0 / 3.0, delta=0.01
        )
        few[1].points = {0: {'initial.speed': '1'}}
        self.assertIsNone(one_at_a_time.probability_of_alike(*few, force))

    def test_studies_that_do_not_match_are_refused(self):
        def refused(other, text):
            code, said = refusal(plot_study.main, self.copy('alone'), '--beside', other)
            self.assertEqual((code, said.count('\n')), (2, 1), said)
            self.assertIn(text, said)

        refused('/no/such/folder', '/no/such/folder: no such folder')
        refused(self.path('grid'), "plan 'grid'; only one_at_a_time")
        weight = '  - {key: "consist[0].weight", label: a rather long label for a narrow panel, scale: [0.5, 1.2]}\n'
        refused(self.again((weight, '')), 'do not vary the same inputs')
        outcomes = '[cars_past_pod, coupler_force_peak, closing_speed_max]'
        refused(self.again((outcomes, '[stop_time]')), 'have no outcome in common')

    def test_report_embeds_the_pictures(self):
        for study, names in EXPECTED.items():
            self.derail('report', self.path(study))
            with open(self.path(f'{study}/report.html'), encoding='utf-8') as file:
                text = file.read()
            page = Page()
            page.feed(text)
            self.assertEqual(len(page.images), len(names))
            self.assertEqual(
                [load for load in page.loads if not load.startswith('data:image/svg+xml;base64,')],
                [],
            )
            self.assertEqual(len(re.findall(r'<img [^>]*>\s*<figcaption>', text)), len(names))


if __name__ == '__main__':
    run_tests()
