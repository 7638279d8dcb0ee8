"""Shares of the ways in which derailments of a group of causes begin, and narrower ranges of inputs, fitted by weighting members.

One validation with all ways and wide ranges is enough: another share of a way, or a narrower range, is another weight
of its members. What is fitted is the least mean of the continuous ranked probability score.
"""

import numpy as np
from scipy.optimize import minimize

PARTS = {'all': (0.0, 1.0), 'lower half': (0.0, 0.5), 'upper half': (0.5, 1.0), 'lower two thirds': (0.0, 2 / 3), 'upper two thirds': (1 / 3, 1.0)}
LEAST_GAIN = 0.005  # share by which the score must fall for a narrower range to be worth it
LEAST_SHARE = 0.005  # a way with less is left out
FEWEST = 2.0  # members that a way of a row must keep on average


class Ensemble:
    """Members of the rows of one group, side by side: rows x members, NaN where a row has fewer."""

    def __init__(self, table, members, rows):
        self.real = table.real[rows]
        place = {r: i for i, r in enumerate(rows)}
        of_row = [[] for _ in rows]
        for m, r in enumerate(members.row):
            if r in place:
                of_row[place[r]].append(m)
        most = max(len(ms) for ms in of_row)
        self.index = np.full((len(rows), most), -1)
        for i, ms in enumerate(of_row):
            self.index[i, : len(ms)] = ms
        self.there = self.index >= 0
        self.cars = np.where(self.there, members.cars[self.index], 0.0)
        self.ways = sorted(set(members.way[self.index[self.there]]))
        self.way = np.array([np.where(self.there, members.way[self.index] == w, False) for w in self.ways])
        self.away = np.abs(self.cars - self.real[:, None])
        self.apart = np.abs(self.cars[:, :, None] - self.cars[:, None, :])

    def weights(self, shares, kept=None):
        """Weights of the members of each row: each way has its share. `kept`: which members count."""
        weights = np.zeros(self.cars.shape)
        for share, way in zip(shares, self.way):
            way = way if kept is None else way & kept
            count = way.sum(axis=1, keepdims=True)
            weights += np.where(way, share / np.maximum(count, 1), 0.0)
        total = weights.sum(axis=1, keepdims=True)
        return np.where(total > 0.0, weights / np.where(total > 0.0, total, 1.0), self.there / self.there.sum(axis=1, keepdims=True))

    def crps(self, weights):
        """Of each row, as scores.fair_crps."""
        away = np.sum(weights * self.away, axis=1)
        half = 0.5 * np.einsum('ri,rij,rj->r', weights, self.apart, weights)
        different = np.maximum(1.0 - np.sum(weights**2, axis=1), 1e-9)
        return away - half / different


def shares_of(free):
    """Positive numbers that add up to 1, from one number fewer."""
    powers = np.exp(np.append(free, 0.0) - max(np.max(free, initial=0.0), 0.0))
    return powers / powers.sum()


def fit_shares(ensemble, rows, kept=None):
    """(shares of the ways, mean score) that are best on these rows of the ensemble."""
    count = len(ensemble.ways)
    if count == 1:
        return np.ones(1), float(ensemble.crps(ensemble.weights([1.0], kept))[rows].mean())

    def loss(free):
        return float(ensemble.crps(ensemble.weights(shares_of(free), kept))[rows].mean())

    best = min(
        (minimize(loss, start, method='Nelder-Mead', options={'xatol': 0.01, 'fatol': 1e-4}) for start in (np.zeros(count - 1), np.full(count - 1, 1.5))),
        key=lambda found: found.fun,
    )
    shares = shares_of(best.x)
    shares[shares < LEAST_SHARE] = 0.0
    shares /= shares.sum()
    return shares, float(ensemble.crps(ensemble.weights(shares, kept))[rows].mean())


def part_of(values, name):
    """Which members lie in a part of the range of an input, by rank; members without the input all do."""
    low, high = PARTS[name]
    known = np.isfinite(values)
    if not known.any():
        return ~known
    a, b = np.quantile(values[known], [low, high])
    return ~known | ((values >= a) & (values <= b))


class Group:
    """What is fitted for one group: shares, and of each input a part of its range."""

    def __init__(self, table, members, rows, keys=()):
        self.ensemble = Ensemble(table, members, rows)
        self.keys = list(keys)
        of = {k: members.input(k) for k in self.keys}
        self.inside = {
            (k, part): np.where(self.ensemble.there, part_of(of[k], part)[self.ensemble.index], False) for k in self.keys for part in PARTS
        }

    def kept(self, parts):
        found = self.ensemble.there
        for k, part in parts.items():
            found = found & self.inside[k, part]
        return found

    def fit(self, rows):
        """(shares, {key: part}, mean score) from these rows of the group: one narrower range after the other, as long as it pays."""
        parts = {}
        shares, score = fit_shares(self.ensemble, rows)
        while True:
            tried = []
            for k in self.keys:
                if k in parts:
                    continue
                for part in PARTS:
                    if part == 'all':
                        continue
                    now = dict(parts, **{k: part})
                    kept = self.kept(now)
                    if min(float((way & kept).sum(axis=1).mean()) for way in self.ensemble.way) < FEWEST:
                        continue
                    tried.append((*fit_shares(self.ensemble, rows, kept)[::-1], now))
            if not tried:
                return shares, parts, score
            better = min(tried, key=lambda t: t[0])
            if better[0] >= score * (1.0 - LEAST_GAIN):
                return shares, parts, score
            score, shares, parts = better

    def weights(self, shares, parts):
        return self.ensemble.weights(shares, self.kept(parts))
