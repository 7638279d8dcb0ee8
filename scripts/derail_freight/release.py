"""Share of derailed tank cars that release, by the speed of the train: impacts of runs against the columns of reports."""

import csv
import io
import subprocess

import numpy as np
from scipy.optimize import minimize

from derail_freight.table import folds_of
from derail_plots.errors import DataError

SPEEDS = (7.0, 15.0, 25.0, 35.0, 45.0, 55.0)  # mph, of the runs; between them the share is taken as linear
ENDS = ('front', 'rear')
END_TO_SIDE = 2.0  # scales of heads over those of shells: assumed, the reports do not tell which was hit
NAMES = ('fittings', 'threshold_speed', 'side_speed')
MPH = 0.44704


class Reports:
    """Rows with cars of hazardous materials that were damaged or derailed."""

    def __init__(self, path):
        needed = ('date', 'speed_mph', 'hazmat_damaged', 'hazmat_released')
        with open(path, encoding='utf-8', newline='') as file:
            rows = list(csv.DictReader(file))
        missing = [c for c in needed if not rows or c not in rows[0]]
        if missing:
            raise DataError(f'{path}: column {missing[0]} is missing, or there are no rows')

        def value(line, row, column):
            text = row[column]
            try:
                return int(text[:4]) if column == 'date' else float(text)
            except ValueError:
                wanted = 'a date that begins with a year' if column == 'date' else 'a number'
                raise DataError(f"{path}:{line}: {column} = '{text}': not {wanted}") from None

        values = np.array([[value(i + 2, r, c) for c in needed] for i, r in enumerate(rows)])
        values = values[values[:, 2] > 0]
        if len(values) == 0:
            raise DataError(f'{path}: hazmat_damaged: no row above 0')
        years, self.speed, self.damaged, released = values.T
        self.released = np.minimum(released, self.damaged)
        self.fold = folds_of(years.astype(int), path)


class Tanks:
    """Cars of runs at one speed that derailed or were hit, as reports count the damaged ones, and how fast and where they were hit.
    All of them count as tank cars, of usual strength."""

    def __init__(self, incidents):
        """`incidents`: text of one file of `derail run --incidents` each."""
        cars, hit, speed, end = {}, [], [], []
        for run, text in enumerate(incidents):
            rows = list(csv.DictReader(io.StringIO(text)))
            for r in rows:
                if r['what'] == 'derailed':
                    cars.setdefault((run, r['car_a']), len(cars))
        derailed = len(cars)
        for run, text in enumerate(incidents):
            for r in csv.DictReader(io.StringIO(text)):
                if r['what'] != 'impact':
                    continue
                for side in 'ab':
                    hit.append(cars.setdefault((run, r[f'car_{side}']), len(cars)))
                    speed.append(float(r['closing_speed_normal_m_s']))
                    end.append(r[f'where_{side}'] in ENDS)
        self.cars = len(cars)
        self.derailed = np.arange(self.cars) < derailed
        self.hit, self.speed, self.end = np.array(hit, int), np.array(speed), np.array(end, bool)

    def share(self, fittings, threshold_speed, side_speed):
        """Expected share that releases; speeds in m/s. The law of outcome::release_probability."""
        if self.cars == 0:
            return fittings
        scale = np.where(self.end, END_TO_SIDE * side_speed, side_speed)
        hazard = np.bincount(self.hit, np.maximum(self.speed - threshold_speed, 0.0) / scale, self.cars)
        return 1.0 - float(np.mean(np.where(self.derailed, 1.0 - fittings, 1.0) * np.exp(-hazard)))


def simulate(derail, scenario, seeds):
    """Tanks of each of SPEEDS."""
    found = []
    for speed in SPEEDS:
        texts = []
        for seed in range(seeds):
            command = [derail, 'run', scenario, '--quiet', '--incidents', '-',
                       '--set', f'initial.speed={speed} mph', '--set', f'initial.perturbation.seed={seed}']  # fmt: skip
            done = subprocess.run(command, capture_output=True, text=True, check=False)
            if done.returncode != 0:
                raise DataError(f'{" ".join(command)}: {done.stderr.strip()}')
            texts.append(done.stdout)
        found.append(Tanks(texts))
    return found


def shares(tanks, law, speeds):
    return np.interp(speeds, SPEEDS, [t.share(*law) for t in tanks])


def loss(tanks, law, reports, rows):
    """Binomial, negative logarithm of the likelihood a car."""
    p = np.clip(shares(tanks, law, reports.speed[rows]), 1e-6, 1.0 - 1e-6)
    k, n = reports.released[rows], reports.damaged[rows]
    return float(-np.sum(k * np.log(p) + (n - k) * np.log1p(-p)) / n.sum())


def fit(tanks, reports, rows):
    """Law with the largest likelihood: fittings, threshold and scale of shells in m/s."""

    def law_of(x):
        return 1.0 / (1.0 + np.exp(-np.clip(x[0], -30.0, 30.0))), max(x[1], 0.0), float(np.exp(x[2]))

    starts = [(np.log(f / (1.0 - f)), v, np.log(s)) for f in (0.01, 0.04) for v in (0.0, 3.0) for s in (10.0, 40.0)]
    found = [
        minimize(lambda x: loss(tanks, law_of(x), reports, rows) + 1e-3 * max(-x[1], 0.0), s, method='Nelder-Mead', options={'xatol': 1e-3, 'fatol': 1e-7})
        for s in starts
    ]
    return law_of(min(found, key=lambda f: f.fun).x)


def fit_all(tanks, reports):
    """(law from all rows, {fold: law without it}, their loss on the rows that they have not seen, that of one share for all speeds)."""
    every = np.arange(len(reports.speed))
    laws, unseen, constant, cars = {}, 0.0, 0.0, 0.0
    for fold in sorted(set(reports.fold)):
        here, others = every[reports.fold == fold], every[reports.fold != fold]
        laws[fold] = fit(tanks, reports, others)
        weight = reports.damaged[here].sum()
        unseen += weight * loss(tanks, laws[fold], reports, here)
        p = reports.released[others].sum() / reports.damaged[others].sum()
        k, n = reports.released[here].sum(), weight
        constant -= k * np.log(p) + (n - k) * np.log1p(-p)
        cars += weight
    return fit(tanks, reports, every), laws, unseen / cars, constant / cars


def bands(tanks, law, reports):
    """(name, cars, share that released, share of the law) of bands of 10 mph."""
    found = []
    for low in range(0, 60, 10):
        k = (reports.speed >= low) & ((reports.speed < low + 10) | (low == 50))
        n = reports.damaged[k].sum()
        if n > 0:
            p = float(np.dot(reports.damaged[k], shares(tanks, law, reports.speed[k])) / n)
            found.append(('50 and more' if low == 50 else f'{low} to {low + 10}', int(n), float(reports.released[k].sum() / n), p))
    return found
