"""Shares of the ways in which derailments of a group of causes begin, and narrower ranges of inputs, fitted by weighting members.

One validation with all ways and wide ranges is enough: another share of a way, or a narrower range, is another weight
of its members. What is fitted is the least mean of the continuous ranked probability score.
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize

PARTS = {'lower half': (0.0, 0.5), 'upper half': (0.5, 1.0), 'lower two thirds': (0.0, 2 / 3), 'upper two thirds': (1 / 3, 1.0)}
LEAST_GAIN = 0.015  # share by which the score must fall for a narrower range to be worth it
LEAST_SHARE = 0.005  # a way with less at any speed is left out
SHARE_SPEED = 25.0  # mph, as in train_derail/validation/plan.hpp
EXPONENT_COST = 0.01  # of the score, for a power of the speed of 1: what a few rows say of it is little
SHORT_TAIL = 12  # cars
POSITION_SHARES = np.round(np.arange(0.05, 1.0, 0.05), 2)
FEWEST = 2.0  # members that a way of a row must keep on average


@dataclass
class Mix:
    """Of the ways of a group: at a speed V each has its share times (V / SHARE_SPEED)^exponent, over the sum of these."""

    shares: np.ndarray
    exponents: np.ndarray

    def at(self, pace):
        """Rows x ways; `pace`: logarithm of V / SHARE_SPEED."""
        parts = self.shares[None, :] * np.exp(self.exponents[None, :] * pace[:, None])
        return parts / parts.sum(axis=1, keepdims=True)


class Ensemble:
    """Members of the rows of one group, side by side: rows x members, NaN where a row has fewer."""

    def __init__(self, table, members, rows):
        self.real = table.real[rows]
        self.tail = table['cars_from_pod_to_rear'][rows]
        self.pace = np.log(table['speed_mph'][rows] / SHARE_SPEED)
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
        of_rows = self.way.any(axis=2)
        # Not the ways of classes: their rows have no other, and their share says nothing.
        self.compete = of_rows[:, of_rows.sum(axis=0) > 1].any(axis=1) if len(self.ways) > 1 else np.ones(1, bool)
        self.base = self.there.astype(float)
        self.away = np.abs(self.cars - self.real[:, None])
        self.apart = np.abs(self.cars[:, :, None] - self.cars[:, None, :])

    def weigh(self, of_members):
        """Weights that members have within their way from now on, one of each member of the folder."""
        self.base = np.where(self.there, of_members[self.index], 0.0)

    def inside(self, narrower):
        """Which members a narrower range keeps."""
        return np.where(self.there, narrower.inside[self.index], False)

    def kept(self, parts):
        """Which members all of some narrower ranges keep."""
        found = self.there
        for narrower in parts:
            found = found & self.inside(narrower)
        return found

    def weights(self, mix, kept=None):
        """Weights of the members of each row: each way has its share. `kept`: which members count."""
        weights = np.zeros(self.cars.shape)
        for share, way in zip(mix.at(self.pace).T, self.way):
            base = np.where(way if kept is None else way & kept, self.base, 0.0)
            total = base.sum(axis=1, keepdims=True)
            weights += share[:, None] * base / np.where(total > 0.0, total, 1.0)
        total = weights.sum(axis=1, keepdims=True)
        return np.where(total > 0.0, weights / np.where(total > 0.0, total, 1.0), self.there / self.there.sum(axis=1, keepdims=True))

    def crps(self, weights, strata=None):
        """Of each row, as scores.fair_crps. `strata`: which members are draws of one distribution each; those of a way if none are given."""
        apart = np.einsum('ri,rij,rj->r', weights, self.apart, weights)
        for of_it in self.way if strata is None else strata:
            part = weights * of_it
            share = part.sum(axis=1)
            alike = np.sum(part**2, axis=1)
            of_pairs = np.einsum('ri,rij,rj->r', part, self.apart, part)
            apart += of_pairs * alike / np.maximum(share**2 - alike, 1e-12)
        return np.sum(weights * self.away, axis=1) - 0.5 * apart


def position_weights(members, share):
    """Weights with which that share of the members of each row has a position that counts locomotives; 1 where a row has one kind only."""
    moved = members.moved.astype(float)
    rows = np.bincount(members.row)
    there = (np.bincount(members.row, moved) / np.maximum(rows, 1))[members.row]
    both = (there > 0.0) & (there < 1.0)
    there = np.where(both, there, 0.5)
    return np.where(both, np.where(members.moved, share / there, (1.0 - share) / (1.0 - there)), 1.0)


def fit_positions(groups, mixes, rows, members):
    """Share of the positions that count locomotives which is best on those of some rows of each group that have short tails, with these
    mixes of the ways. Behind longer ones there are cars enough, wherever the first one stood."""
    short = [np.asarray(r, int)[g.tail[r] <= SHORT_TAIL] for g, r in zip(groups, rows)]
    if not members.moved.any() or sum(len(s) for s in short) == 0:
        return 0.0
    found = []
    for share in POSITION_SHARES:
        score = 0.0
        for g, mix, s in zip(groups, mixes, short):
            g.weigh(position_weights(members, share))
            moved = np.where(g.there, members.moved[g.index], False)
            strata = [way & part for way in g.way for part in (moved, ~moved)]
            score += float(g.crps(g.weights(mix), strata)[s].sum())
        found.append(score)
    return float(POSITION_SHARES[int(np.argmin(found))])


def mix_of(free, compete):
    """Mix of the ways that compete, n of them, from 2 (n - 1) numbers: logarithms of shares over that of the last one, and exponents; the last
    one has 0. The others have no share."""
    powers, exponents = np.append(free[: len(free) // 2], 0.0), np.append(free[len(free) // 2 :], 0.0)
    mix = Mix(np.zeros(len(compete)), np.zeros(len(compete)))
    mix.shares[compete] = np.exp(powers - powers.max())
    mix.shares /= mix.shares.sum()
    mix.exponents[compete] = exponents
    return mix


def fit_mix(ensemble, rows, kept=None):
    """Mix of the ways that is best on these rows of the ensemble."""
    compete = ensemble.compete
    numbers = 2 * max(int(compete.sum()) - 1, 0)
    if numbers == 0 or len(rows) == 0:
        return mix_of(np.zeros(numbers), compete if compete.any() else ~compete)

    def loss(free):
        mix = mix_of(free, compete)
        return float(ensemble.crps(ensemble.weights(mix, kept))[rows].mean() + EXPONENT_COST * np.sum(mix.exponents**2))

    simplex = np.vstack([np.zeros(numbers), 1.5 * np.eye(numbers)])  # scipy's own one begins with steps that are too small to see
    best = minimize(loss, simplex[0], method='Nelder-Mead', options={'xatol': 0.01, 'fatol': 1e-5, 'initial_simplex': simplex, 'maxiter': 2000})
    mix = mix_of(best.x, compete)
    shares = np.where(mix.at(ensemble.pace[rows]).max(axis=0) < LEAST_SHARE, 0.0, mix.shares)
    return Mix(shares / shares.sum(), np.where(shares > 0.0, mix.exponents, 0.0))


class Narrower:
    """A part of the range of an input of a way, by rank of its members in the folder."""

    def __init__(self, members, way, key, part):
        self.way, self.key, self.part = way, key, part
        values = members.input(key)
        of_way = (members.way == way) & np.isfinite(values)
        low, high = PARTS[part]
        self.low, self.high = np.quantile(values[of_way], [low, high])
        self.inside = ~of_way | ((values >= self.low) & (values <= self.high))

    def __str__(self):
        return f'{self.way}: {self.key} {self.low:.3g} to {self.high:.3g} ({self.part})'


def narrower_ranges(members, keys):
    """All that may be tried: of each way the inputs that it varies."""
    found = []
    for way in sorted(set(members.way)):
        for key in keys:
            values = members.input(key)[members.way == way]
            if np.isfinite(values).sum() > 1:
                found += [Narrower(members, way, key, part) for part in PARTS]
    return found


def enough(groups, kept):
    """Every way of every group keeps members."""
    return all(float((way & k).sum()) >= FEWEST * float(way.any(axis=1).sum()) for g, k in zip(groups, kept) for way in g.way)


def fit(groups, rows, tried=()):
    """([Mix of each group], [narrower ranges], mean score) from some rows of each group, an Ensemble each.

    Ranges are those of a way in all groups: an input is what it is, whatever the cause. One after the other is taken, as
    long as it pays.
    """
    rows = [np.asarray(r, int) for r in rows]
    total = sum(len(r) for r in rows)

    def score(mixes, kept):
        return sum(float(g.crps(g.weights(m, k))[r].sum()) for g, m, k, r in zip(groups, mixes, kept, rows)) / total

    def fitted(kept):
        return [fit_mix(g, r, k) for g, k, r in zip(groups, kept, rows)]

    kept, parts = [g.there for g in groups], []
    mixes = fitted(kept)
    least = score(mixes, kept)
    while True:
        taken = {(n.way, n.key) for n in parts}
        best = None
        for n in tried:
            if (n.way, n.key) in taken:
                continue
            now = [k & g.inside(n) for g, k in zip(groups, kept)]
            if not enough(groups, now):
                continue
            s = score(mixes, now)
            if best is None or s < best[0]:
                best = (s, n, now)
        if best is None or best[0] >= least * (1.0 - LEAST_GAIN):
            return mixes, parts, least
        parts, kept = [*parts, best[1]], best[2]
        mixes = fitted(kept)
        least = score(mixes, kept)
