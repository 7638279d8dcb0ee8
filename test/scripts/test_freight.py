#!/usr/bin/python3
"""score_freight.py, fit_freight.py, limits_freight.py, fit_release.py: scores worked out by hand, folds that never leak, a fit that finds what it was
given, limits that are known, and the scripts on real, short ensembles.

  test_freight.py path/to/derail
"""

import json
import os

import unittest.mock

import numpy as np
from scipy.stats import norm

from plot_testing import PlotTest, RAILS, refusal, run_tests, script

import fit_freight
import fit_release
import limits_freight
import score_freight
from derail_freight import competitors, limits, release
from derail_freight.fit import Ensemble, Mix, fit, fit_positions, narrower_ranges, position_weights
from derail_freight.scores import Rows, crps, distribution, fair_crps, mean, pit, pit_histogram, quantile
from derail_freight.table import FOLDS, Members, Table
from derail_plots.errors import DataError

YEARS = [year for fold in FOLDS for year in fold]
CAUSES = {'broken_rail': 'T207', 'wheel_axle_truck': 'E61C'}


def rows_of(count, real=lambda i: 1 + i % 7):
    """Rows as rows.csv has them."""
    found = []
    for i in range(count):
        group = sorted(CAUSES)[i % 2]
        found.append({
            'line': str(i + 2), 'date': f'{YEARS[i % len(YEARS)]}-05-01', 'speed_mph': str(5 + i % 50), 'n_cars': '100', 'loaded': '60',
            'empty': '40', 'tons_per_car': '90', 'cars_from_pod_to_rear': str(20 + i % 60), 'cars_derailed': str(real(i)),
            'cause': CAUSES[group], 'cause_group': group,
        })  # fmt: skip
    return found


def members_of(table, cars):
    """Members as members.csv has them; `cars`: {way: counts of the members of a row}."""
    rows = []
    for line in table.line:
        for way, counts in cars.items():
            rows += [{'line': str(line), 'way': way, 'derailed_without_locomotives': str(c), 'ended': 'at_rest'} for c in counts]
    return Members(table, rows)


class ScoresTest(PlotTest):
    def test_by_hand(self):
        d = distribution([3, 1])
        self.assertEqual((quantile(d, 0.5), quantile(d, 0.51), mean(d)), (1.0, 3.0, 2.0))
        self.assertAlmostEqual(crps(d, 2), 1.0 - 0.5)  # mean distance 1, half the mean distance of two draws 0.5
        self.assertAlmostEqual(fair_crps([1, 3], [1, 1], 'aa', 2), 1.0 - 1.0)  # of two different members: half of 2
        self.assertAlmostEqual(fair_crps([1, 3], [1, 1], 'ab', 2), 1.0 - 0.5)  # of two strata: half the draws are of one and the same
        self.assertAlmostEqual(fair_crps([1, 3, 9], [1, 1, 2], 'aab', 2), (0.5 * 1 + 0.5 * 7) - 0.5 * (0.25 * 2 + 2 * 0.25 * 7))
        self.assertAlmostEqual(crps(distribution([1, 5], [3, 1]), 1), 1.0 - 0.5 * 2 * 0.75 * 0.25 * 4)
        self.assertAlmostEqual(fair_crps([4], [1], 'a', 7), 3.0)

    def test_the_fair_score_does_not_depend_on_the_number_of_members(self):
        random = np.random.default_rng(11)
        for few, many in ((2, 40), (3, 25)):
            means = []
            for count in (few, many):
                draws = np.concatenate([random.integers(1, 4, (6000, count)), random.integers(10, 40, (6000, count))], axis=1)
                means.append(np.mean([fair_crps(d, np.ones(2 * count), ['a'] * count + ['b'] * count, 12) for d in draws]))
            self.assertAlmostEqual(means[0], means[1], delta=0.1)

    def test_the_score_is_the_integral_of_the_squared_distance(self):
        values, weights = np.array([2.0, 3.0, 7.0, 11.0]), np.array([0.1, 0.4, 0.3, 0.2])
        steps = np.arange(0.0, 20.0, 0.001) + 0.0005
        for real in (1.0, 3.0, 5.0, 12.0):
            below = (weights[None, :] * (values[None, :] <= steps[:, None])).sum(axis=1)
            self.assertAlmostEqual(crps((values, weights), real), 0.001 * np.sum((below - (steps >= real)) ** 2), places=2)

    def test_rows_by_hand(self):
        rows = Rows([2, 6], [distribution([1, 2, 3]), distribution([2, 4])])
        s = rows.scores()
        self.assertAlmostEqual(s['mae'], (0 + 4) / 2)
        self.assertAlmostEqual(s['mse'], (0 + 9) / 2)
        self.assertAlmostEqual(s['r2'], 1 - 9 / 8)
        self.assertAlmostEqual(s['held'], 0.5)
        self.assertAlmostEqual(s['width'], 2.0)
        self.assertAlmostEqual(s['few'], (2 / 3 + 1 / 2) / 2)
        self.assertAlmostEqual(s['few_real'], 0.5)
        self.assertAlmostEqual(s['crps'], ((2 / 3 - 4 / 9) + (3 - 0.5)) / 2)

    def test_pit(self):
        self.assertEqual([round(x, 9) for x in pit(distribution([1, 2, 3]), 2)], [round(1 / 3, 9), round(2 / 3, 9)])
        self.assertEqual([round(x, 9) for x in pit_histogram([(1 / 3, 2 / 3)], 3)], [0.0, 1.0, 0.0])
        self.assertEqual([round(x, 4) for x in pit_histogram([(0.0, 0.5), (0.0, 0.0), (1.0, 1.0)], 2)], [round(2 / 3, 4), round(1 / 3, 4)])
        draws = np.random.default_rng(1).integers(1, 30, (4000, 41))
        reliable = Rows(draws[:, 0], [distribution(d) for d in draws[:, 1:]]).scores()['pit']
        self.assertLess(max(abs(x - 0.1) for x in reliable), 0.03)


class FoldsTest(PlotTest):
    def test_a_year_is_in_one_fold_and_no_row_is_learned_by_its_own_prediction(self):
        table = Table(rows_of(64))
        folds = table.folds()
        asked = []

        def model(table, learn, predict):
            asked.append((set(learn), set(predict)))
            return [distribution([1])] * len(predict)

        self.assertEqual(len(competitors.held_out(model, table, folds)), 64)
        self.assertEqual(len(asked), 5)
        for learn, predict in asked:
            self.assertFalse({table.year[i] for i in learn} & {table.year[i] for i in predict})
            self.assertEqual(learn | predict, set(range(64)))
        self.assertEqual(sorted(i for _, predict in asked for i in predict), list(range(64)))

    @unittest.mock.patch.object(competitors, 'TREES', 20)
    @unittest.mock.patch.object(competitors, 'LEVELS', np.array([0.25, 0.5, 0.75]))
    def test_no_model_sees_the_counts_of_the_fold(self):
        table, other = Table(rows_of(160)), Table(rows_of(160))
        folds = table.folds()
        here = folds == 2
        other.real = np.where(here, 40.0, other.real)
        for name, model in competitors.MODELS.items():
            one, two = (competitors.held_out(model, t, np.where(here, 0, 1)) for t in (table, other))
            same = [np.array_equal(a[0], b[0]) and np.allclose(a[1], b[1]) for a, b in zip(one, two)]
            self.assertTrue(all(np.array(same)[here]), name)
            self.assertFalse(all(np.array(same)[~here]), f'{name}: the other fold learns from it')

    def test_rows_behind_are_learned_from_and_not_those_in_front(self):
        both = Table(rows_of(32) + rows_of(64))
        folds, asked = both.folds(), []

        def model(table, learn, predict):
            asked.append((set(learn), set(predict)))
            return [distribution([1])] * len(predict)

        self.assertEqual(len(competitors.held_out(model, both, folds, 32)), 32)
        self.assertEqual(set().union(*(predict for _, predict in asked)), set(range(32)))
        for learn, predict in asked:
            self.assertEqual(learn, {i for i in range(32, 96) if both.year[i] not in {both.year[j] for j in predict} and folds[i] != folds[min(predict)]})

    def test_a_year_without_a_fold_is_refused(self):
        rows = rows_of(8)
        rows[3]['date'] = '1999-01-01'
        with self.assertRaisesRegex(DataError, 'no fold has the year 1999'):
            Table(rows).folds()


class ModelsTest(PlotTest):
    def test_truncated_geometric_finds_its_own_numbers(self):
        table = Table(rows_of(3000))
        random = np.random.default_rng(3)
        length = table['cars_from_pod_to_rear']
        chance = 1 / (1 + np.exp(-(1.0 - 1.2 * np.log(table['speed_mph']) + 0.2 * np.log(length))))
        draws = random.random(len(table)) * (1 - (1 - chance) ** length)
        table.real = np.floor(np.log1p(-draws) / np.log1p(-chance)) + 1
        every = np.arange(len(table))
        found = competitors.truncated_geometric(table, every, every)
        for i in (0, 777, 2999):
            values, weights = found[i]
            self.assertEqual(values.max(), length[i])
            self.assertAlmostEqual(weights.sum(), 1.0)
            self.assertLess(abs(weights[0] / (chance[i] / (1 - (1 - chance[i]) ** length[i])) - 1), 0.15)

    def test_a_straight_line_is_found(self):
        rows = rows_of(60)
        for i, row in enumerate(rows):
            row['cars_derailed'] = str(2 + int(row['speed_mph']))
        table = Table(rows)
        d = competitors.linear(table, np.arange(0, 60, 2), np.arange(1, 60, 2))
        self.assertTrue(np.allclose([quantile(x, 0.5) for x in d], table.real[1::2]))


class FitTest(PlotTest):
    def test_shares_are_those_that_were_put_in(self):
        table = Table(rows_of(800, lambda i: 1 if (i // 2) % 10 < 3 else 20))
        members = members_of(table, {'stops': [1] * 6, 'heap': [20] * 6})
        rows = np.flatnonzero(table.group == 'broken_rail')
        mixes, parts, _ = fit([Ensemble(table, members, rows)], [np.arange(len(rows))])
        self.assertEqual(parts, [])
        self.assertAlmostEqual(mixes[0].shares[1], 0.3, delta=0.03)  # ways by name: heap, stops

    def test_shares_by_speed_are_those_that_were_put_in(self):
        mix = Mix(np.array([0.5, 0.5]), np.array([1.0, 0.0]))
        by_hand = [[0.5, 0.5], [2 / 3, 1 / 3], [1 / 3, 2 / 3]]
        self.assertTrue(np.allclose(mix.at(np.log([1.0, 2.0, 0.5])), by_hand))
        random = np.random.default_rng(7)
        rows = rows_of(3000)
        for row in rows:
            heap = float(row['speed_mph']) / 25.0
            row['cars_derailed'] = '20' if random.random() < heap / (heap + 1.0) else '1'
        table = Table(rows)
        members = members_of(table, {'stops': [1] * 6, 'heap': [20] * 6})
        mixes, _, _ = fit([Ensemble(table, members, np.arange(len(rows)))], [np.arange(len(rows))])
        self.assertAlmostEqual(mixes[0].shares[0], 0.5, delta=0.05)
        self.assertAlmostEqual(mixes[0].exponents[0], 1.0, delta=0.2)

    def test_a_narrower_range_is_taken_where_it_pays(self):
        table = Table(rows_of(400, lambda i: 3))
        rows = []
        for line in table.line:
            rows += [
                {'line': str(line), 'way': 'heap', 'derailed_without_locomotives': str(3 if x < 5 else 30), 'x': str(x), 'y': str(x * 7 % 10)}
                for x in range(10)
            ]
        members = Members(table, rows)
        halves = [Ensemble(table, members, np.flatnonzero(table.group == g)) for g in sorted(CAUSES)]
        _, parts, score = fit(halves, [np.arange(200)] * 2, narrower_ranges(members, ['x', 'y']))
        self.assertEqual([str(p) for p in parts], ['heap: x 0 to 4.5 (lower half)'])
        self.assertAlmostEqual(score, 0.0)

    def test_the_share_of_positions_that_count_locomotives_is_found(self):
        rows = rows_of(800, lambda i: 8 if (i // 2) % 10 < 3 else 5)
        for row in rows:
            row['first_car_position'], row['cars_from_pod_to_rear'] = '96', '5'
        table = Table(rows)
        lines = [
            {'line': r['line'], 'way': 'heap', 'derailed_without_locomotives': '8' if m % 2 else '5', 'first_car_position': '93' if m % 2 else '96'}
            for r in rows
            for m in range(10)
        ]
        members = Members(table, lines)
        self.assertEqual(members.moved.sum(), 4000)
        every = np.arange(len(table))
        group, mix = Ensemble(table, members, every), Mix(np.ones(1), np.zeros(1))
        self.assertAlmostEqual(fit_positions([group], [mix], [every], members), 0.3)
        weights = position_weights(members, 0.3)
        self.assertAlmostEqual(weights[members.moved].sum() / weights.sum(), 0.3)
        group.weigh(weights)
        self.assertAlmostEqual(group.weights(mix)[0][1] * 5, 0.3)
        for line in lines:
            del line['first_car_position']
        self.assertEqual(fit_positions([group], [mix], [every], Members(table, lines)), 0.0)

    def test_shares_go_into_the_file_of_ways(self):
        path = self.path('w.yaml', 'positions_counting_locomotives: 0.5  # why\ngroups:\n  broken_rail:\n    - {name: a, share: 0.5, study: a.yaml}\n    - {name: b, share: 0.5, study: b.yaml}\n  other:\n    - {name: a, share: 1, study: a.yaml}\n')
        # Rows of a class have a way of their own, which the group does not list.
        ways = {'a': (0.1, -0.5), 'b': (0.3, 0.0), 'of_class': (0.6, 0.0)}
        groups = {'broken_rail': {'ways': {w: {'share': s, 'speed_exponent': e} for w, (s, e) in ways.items()}}}
        fit_freight.write_shares(path, groups, 0.35)
        with open(path, encoding='utf-8') as file:
            text = file.read()
        self.assertIn('positions_counting_locomotives: 0.35  # why\n', text)
        self.assertIn('{name: a, share: 0.2500, speed_exponent: -0.50, study: a.yaml}\n    - {name: b, share: 0.7500, study', text)
        fit_freight.write_shares(path, groups, 0.35)
        with open(path, encoding='utf-8') as file:
            self.assertEqual(file.read(), text, 'what has been written is found again')
        self.assertIn('{name: a, share: 1, study: a.yaml}', text)
        self.assertAlmostEqual(sum(fit_freight.rounded({'a': 1 / 3, 'b': 1 / 3, 'c': 1 / 3}).values()), 1.0, places=12)
        with self.assertRaisesRegex(DataError, 'w.yaml:4: way a has no members'):
            fit_freight.write_shares(path, {'broken_rail': {'ways': {'b': ways['b']}}}, 0.35)


TANKS = """
consist:
  - {name: tank_car, count: 14, length: 55 ft, weight: 286 kip}
ground: {on_track_law: rails, off_track_law: by_slip}
contact: {law: elastic}
coupler: {break_draft: 400 kip, break_swing: 50 deg}
initial: {speed: 35 mph, yaw_rate: 0.1}
release: {fittings: 0.05, threshold_speed: 1 mph, end_speed: 20 mph, side_speed: 10 mph}
stop: {time_max: 40}
solver: {method: semi_implicit, fixed_step: 0.002}
"""
HEAD = 'time_s,what,car_a,car_b,where_a,where_b,closing_speed_normal_m_s\n'


class LimitsTest(PlotTest):
    def test_by_hand(self):
        d = distribution([1, 2, 4, 9], [1, 2, 2, 3])
        self.assertAlmostEqual(limits.small(d), 3 / 8)
        self.assertEqual(limits.told(d, 2)[0].tolist(), [1, 2])
        self.assertEqual(limits.told(d, 3)[0].tolist(), [4, 9])
        np.testing.assert_allclose(limits.told(d, 3)[1], [2 / 5, 3 / 5])
        self.assertEqual(limits.told(distribution([1, 2]), 7)[0].tolist(), [1, 2], 'nothing of that kind: all that there is')
        self.assertAlmostEqual(limits.own_error(d), (3 + 2 * 2 + 3 * 5) / 8)
        values, weights = limits.mixture(d, distribution([3]))
        self.assertEqual(dict(zip(values, weights)), {1: 1 / 16, 2: 1 / 8, 3: 1 / 2, 4: 1 / 8, 9: 3 / 16})

    def test_r2_of_members_without_end(self):
        random = np.random.default_rng(3)
        middle = random.uniform(10, 30, 4000)
        real = middle + random.normal(0, 4, 4000)
        few, many = ([distribution(random.normal(m, 6, count)) for m in middle] for count in (5, 400))
        self.assertLess(Rows(real, few).scores()['r2'], Rows(real, many).scores()['r2'] - 0.1)
        self.assertAlmostEqual(limits.r2_of_many(real, few), Rows(real, many).scores()['r2'], delta=0.02)

    def test_a_forest_takes_what_predictions_tell(self):
        rows = rows_of(300, lambda i: 1 + (i * 7919) % 40)
        table = Table(rows)
        known = limits.study(table, [distribution([y, y + 1, y + 2]) for y in table.real])
        self.assertAlmostEqual(known['simulation'].scores()['mae'], 1.0)
        alone, with_it = known['forest by folds'].scores(), known['forest that also knows the simulation, by folds'].scores()
        self.assertGreater(alone['mae'], 5.0)
        self.assertLess(with_it['mae'], 3.0)
        self.assertLess(known['half simulation, half forest'].scores()['mae'], alone['mae'])
        self.assertGreater(alone['mae'], known['forest that is told it, by folds'].scores()['mae'])

    def test_shares_that_are_right_are_beyond_the_bound_by_chance_only(self):
        random = np.random.default_rng(5)
        table = Table(rows_of(600))
        groups = limits.groups_of_cause_and_speed(table)
        self.assertTrue(all(k.sum() >= limits.LEAST_ROWS for k in groups))
        shares = np.full(600, 0.5)
        mean_beyond, at_most = limits.groups_beyond_by_chance(groups, shares, random)
        chance = [2 * norm.sf((limits.BOUND * n + 0.5) / np.sqrt(n / 4)) for n in (k.sum() for k in groups)]  # normal, by half a row
        self.assertAlmostEqual(mean_beyond, sum(chance), delta=0.15 * len(groups))
        self.assertGreater(limits.groups_beyond(groups, shares, np.ones(600, bool)), at_most)
        for small, beyond in ((11, 0), (13, 1), (9, 0), (7, 1)):
            self.assertEqual(limits.groups_beyond([np.ones(20, bool)], np.full(20, 0.5), np.arange(20) < small), beyond)


class ReleaseTest(PlotTest):
    def test_share_by_hand(self):
        # Car 3 is hit at its head and at its shell, car 4 not at all, car 9 stands on the rails and is hit at its head.
        tanks = release.Tanks([HEAD + '0,derailed,3,,front_truck,,\n1,derailed,4,,front_truck,,\n2,impact,3,9,rear,front,6\n3,impact,3,9,left,rear,4\n'])
        self.assertEqual(tanks.cars, 3)
        of_hit, standing = 1 - 0.9 * np.exp(-(6 - 1) / 20 - (4 - 1) / 10), 1 - np.exp(-(6 - 1 + 4 - 1) / 20)
        self.assertAlmostEqual(tanks.share(0.1, 1.0, 10.0), (of_hit + 0.1 + standing) / 3)
        self.assertEqual(release.Tanks([HEAD]).share(0.1, 1.0, 10.0), 0.1)

    def test_the_law_is_that_of_the_program(self):
        incidents, outcome = self.path('tanks.csv'), self.path('tanks.json')
        self.derail('run', self.path('tanks.yaml', TANKS), '--incidents', incidents, '--json', outcome)
        with open(incidents, encoding='utf-8') as file:
            tanks = release.Tanks([file.read()])
        with open(outcome, encoding='utf-8') as file:
            expected = json.load(file)['cars_released_expected']
        self.assertGreater(len(tanks.hit), 5)
        self.assertLess(tanks.derailed.sum(), tanks.cars, 'some stand and are hit')
        self.assertAlmostEqual(tanks.cars * tanks.share(0.05, release.MPH, 10.0 * release.MPH), expected, places=4)

    def test_the_law_that_made_the_reports_is_found(self):
        random = np.random.default_rng(5)
        tanks = []
        for speed in release.SPEEDS:
            lines = [HEAD]
            for car in range(200):
                lines.append(f'0,derailed,{car},,front_truck,,\n')
                lines += [f'1,impact,{car},999,{where},rear,{random.exponential(0.2 * speed)}\n' for where in ('front', 'left')]
            tanks.append(release.Tanks([''.join(lines)]))
        law = (0.03, 2.0, 25.0)
        text = 'date,speed_mph,hazmat_damaged,hazmat_released\n'
        for i in range(3000):
            speed = 5 + 50 * random.random()
            text += f'{YEARS[i % 8]}-01-01,{speed},20,{random.binomial(20, release.shares(tanks, law, speed))}\n'
        reports = release.Reports(self.path('wrong.csv', text))
        found, laws, unseen, constant = release.fit_all(tanks, reports)
        self.assertLess(unseen, constant)
        self.assertEqual(sorted(laws), [0, 1, 2, 3, 4])
        at = np.array([10.0, 30.0, 50.0])
        self.assertTrue(np.allclose(release.shares(tanks, found, at), release.shares(tanks, law, at), atol=0.01))
        self.assertAlmostEqual(found[2], 25.0, delta=4.0)


STUDY = """
title: short
scenario: rails.yaml
plan: latin_hypercube
samples: 4
factors:
  - {key: rails.derail_ratio, low: 0.8, high: 1.1}
perturbation: {kick: 1 ft/s}
"""
WAYS = """
title: two ways
causes: causes.yaml
groups:
  broken_rail:
    - {name: stiff, share: 0.5, study: short.yaml}
    - {name: soft, share: 0.5, study: soft.yaml}
  other: [{study: short.yaml}]
"""


class ScriptsTest(PlotTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.path('rails.yaml', RAILS)
        cls.path('short.yaml', STUDY)
        cls.path('soft.yaml', 'base: short.yaml\nfactors:\n  - {key: rails.derail_ratio, low: 0.4, high: 0.5}\n')
        cls.path('causes.yaml', 'groups:\n  - {name: broken_rail, codes: [T207]}\n  - {name: other, codes: [M405]}\n')
        ways = cls.path('ways.yaml', WAYS)
        lines = ['date,speed_mph,n_cars,tons_per_car,cars_derailed,head_end_locos,mid_locos,rear_locos,first_car_position,cars_from_pod_to_rear,cause,loaded,empty']
        for i in range(80):
            lines.append(f'{YEARS[i % 8]}-01-0{1 + i % 9},{5 + i % 40},6,{40 + i % 90},{1 + i % 5},1,0,0,2,5,{"T207" if i % 4 else "M405"},3,3')
        cls.table = cls.path('freight.csv', '\n'.join(lines) + '\n')
        cls.out = cls.path('out')
        cls.derail('validate', cls.table, '--study', ways, '--out', cls.out)

    def test_score_and_fit(self):
        done = script('score_freight.py', self.out, '--no-in-sample')
        self.assertEqual(done.returncode, 0, done.stderr)
        with open(os.path.join(self.out, 'freight.json'), encoding='utf-8') as file:
            scores = json.load(file)
        with open(os.path.join(self.out, 'validation.json'), encoding='utf-8') as file:
            theirs = json.load(file)['groups'][0]['scores'][0]
        ours = scores['all']['simulation']
        self.assertEqual(ours['rows'], 80)
        self.assertAlmostEqual(ours['crps'], theirs['crps'])
        self.assertAlmostEqual(ours['held'], theirs['coverage'])
        self.assertAlmostEqual(ours['width'], theirs['interval_width'])
        self.assertEqual(scores['cause: other']['simulation']['rows'], 20)
        self.assertIn('| quantile forest, by folds | 80 |', done.stdout)
        pictures = os.path.join(self.out, 'pictures')
        names = [n for n in os.listdir(pictures) if n.endswith('.png')]
        self.assertEqual(len(names), 4)
        for name in names:
            self.check_picture(os.path.join(pictures, name))

        ways = os.path.join(self.folder, 'ways.yaml')
        done = script('fit_freight.py', self.out, '--keys', 'rails.derail_ratio', '--write', ways)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn('held out by year', done.stdout)
        with open(os.path.join(self.out, 'fit.json'), encoding='utf-8') as file:
            self.assertAlmostEqual(sum(w['share'] for w in json.load(file)['groups']['broken_rail']['ways'].values()), 1.0)
        self.derail('validate', self.table, '--study', ways, '--out', self.path('again'), '--every', '40')

    def test_limits(self):
        done = script('limits_freight.py', self.out)
        self.assertEqual(done.returncode, 0, done.stderr)
        plain = script('score_freight.py', self.out, '--no-in-sample').stdout
        forest = [line.split('|', 2)[2] for line in plain.split('\n') if line.startswith('| quantile forest, by folds |')][0]
        self.assertIn('| forest by folds |' + forest, done.stdout)
        self.assertIn('| half simulation, half forest | 80 |', done.stdout)
        self.assertIn('R2 of the mean of members without end', done.stdout)

    def test_models_learn_from_another_table(self):
        done = script('score_freight.py', self.out, '--no-in-sample', '--learn', self.table, self.path('causes.yaml'))
        self.assertEqual(done.returncode, 0, done.stderr)
        plain = script('score_freight.py', self.out, '--no-in-sample')
        theirs = [[line for line in d.stdout.split('\n') if line.startswith('| linear, by folds | 80 |')] for d in (done, plain)]
        self.assertEqual(theirs[0], theirs[1], 'the same rows, so the same models')
        with open(self.table, encoding='utf-8') as file:
            head, *rows = file.read().splitlines()
        cars = head.split(',').index('cars_derailed')
        other = self.path('other.csv', '\n'.join([head, *(','.join('6' if i == cars else f for i, f in enumerate(r.split(','))) for r in rows)]) + '\n')
        done = script('score_freight.py', self.out, '--no-in-sample', '--learn', other, self.path('causes.yaml'))
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertNotIn(theirs[0][0], done.stdout, 'other counts, so other models')
        code, said = refusal(score_freight.main, self.out, '--learn', self.table, self.path('nowhere.yaml'))
        self.assertEqual(code, 2)
        self.assertIn('nowhere.yaml', said)

    def test_release_on_real_runs(self):
        table = self.path('hazmat.csv', 'date,speed_mph,hazmat_damaged,hazmat_released\n' + ''.join(f'{y}-01-01,{10 + 5 * i},9,{i}\n' for i, y in enumerate(YEARS)))
        derail = os.path.abspath(self.program)
        done = script('fit_release.py', table, self.path('rails.yaml'), '--seeds', '1', '--derail', derail)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn('| all rows | 0.', done.stdout)
        for text, what in (('n/a,10,1,0', "wrong.csv:2: date = 'n/a'"), ('2008-01-01,fast,1,0', "speed_mph = 'fast': not a number"), ('2008-01-01,10,0,0', 'no row above 0'), ('1999-01-01,10,1,0', 'year 1999')):
            with self.assertRaisesRegex(DataError, what):
                release.Reports(self.path('wrong.csv', f'date,speed_mph,hazmat_damaged,hazmat_released\n{text}\n'))
        code, said = refusal(fit_release.main, table, self.path('nowhere.yaml'), '--derail', derail)
        self.assertEqual(code, 2)
        self.assertIn('nowhere.yaml', said)

    def test_what_is_not_there_is_told(self):
        for main in (score_freight.main, fit_freight.main, limits_freight.main):
            code, said = refusal(main, self.path('nowhere'))
            self.assertEqual(code, 2)
            self.assertIn('rows.csv', said)
        plain = self.path('plain')
        self.derail('validate', self.table, '--study', self.path('short.yaml'), '--every', '20', '--out', plain)
        code, said = refusal(score_freight.main, plain)
        self.assertEqual(code, 2)
        self.assertIn('cause_group is missing', said)


if __name__ == '__main__':
    run_tests()
