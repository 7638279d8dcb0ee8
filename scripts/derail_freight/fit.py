"""Shares of the ways in which derailments of a group of causes begin, and narrower ranges of inputs, fitted by weighting members.

One validation with all ways and wide ranges is enough: another share of a way, or a narrower range, is another weight
of its members. What is fitted is the least mean of the continuous ranked probability score.
"""

import numpy as np
from scipy.optimize import minimize

PARTS = {'lower half': (0.0, 0.5), 'upper half': (0.5, 1.0), 'lower two thirds': (0.0, 2 / 3), 'upper two thirds': (1 / 3, 1.0)}
LEAST_GAIN = 0.015  # share by which the score must fall for a narrower range to be worth it
LEAST_SHARE = 0.005  # a way with less is left out
SHORT_TAIL = 12  # cars
POSITION_SHARES = np.round(np.arange(0.05, 1.0, 0.05), 2)
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

    def weights(self, shares, kept=None):
        """Weights of the members of each row: each way has its share. `kept`: which members count."""
        weights = np.zeros(self.cars.shape)
        for share, way in zip(shares, self.way):
            base = np.where(way if kept is None else way & kept, self.base, 0.0)
            total = base.sum(axis=1, keepdims=True)
            weights += share * base / np.where(total > 0.0, total, 1.0)
        total = weights.sum(axis=1, keepdims=True)
        return np.where(total > 0.0, weights / np.where(total > 0.0, total, 1.0), self.there / self.there.sum(axis=1, keepdims=True))

    def crps(self, weights):
        """Of each row, as scores.fair_crps."""
        away = np.sum(weights * self.away, axis=1)
        half = 0.5 * np.einsum('ri,rij,rj->r', weights, self.apart, weights)
        different = np.maximum(1.0 - np.sum(weights**2, axis=1), 1e-9)
        return away - half / different


def position_weights(members, share):
    """Weights with which that share of the members of each row has a position that counts locomotives; 1 where a row has one kind only."""
    moved = members.moved.astype(float)
    rows = np.bincount(members.row)
    there = (np.bincount(members.row, moved) / np.maximum(rows, 1))[members.row]
    both = (there > 0.0) & (there < 1.0)
    there = np.where(both, there, 0.5)
    return np.where(both, np.where(members.moved, share / there, (1.0 - share) / (1.0 - there)), 1.0)


def fit_positions(table, members, rows):
    """Share of the positions that count locomotives which is best on those of these rows that have short tails, with the ways in the
    shares that they have. Behind longer ones there are cars enough, wherever the first one stood."""
    rows = np.asarray(rows)[table['cars_from_pod_to_rear'][rows] <= SHORT_TAIL]
    if not members.moved.any() or len(rows) == 0:
        return 0.0
    ensemble = Ensemble(table, members, rows)
    found = []
    for share in POSITION_SHARES:
        ensemble.weigh(position_weights(members, share))
        found.append(float(ensemble.crps(ensemble.base / ensemble.base.sum(axis=1, keepdims=True)).mean()))
    return float(POSITION_SHARES[int(np.argmin(found))])


def shares_of(free):
    """Positive numbers that add up to 1, from one number fewer."""
    powers = np.exp(np.append(free, 0.0) - max(np.max(free, initial=0.0), 0.0))
    return powers / powers.sum()


def fit_shares(ensemble, rows, kept=None):
    """Shares of the ways that are best on these rows of the ensemble."""
    count = len(ensemble.ways)
    if count == 1:
        return np.ones(1)

    def loss(free):
        return float(ensemble.crps(ensemble.weights(shares_of(free), kept))[rows].mean())

    best = min(
        (minimize(loss, start, method='Nelder-Mead', options={'xatol': 0.01, 'fatol': 1e-4}) for start in (np.zeros(count - 1), np.full(count - 1, 1.5))),
        key=lambda found: found.fun,
    )
    shares = shares_of(best.x)
    shares[shares < LEAST_SHARE] = 0.0
    return shares / shares.sum()


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
    """([shares of each group], [narrower ranges], mean score) from some rows of each group, an Ensemble each.

    Ranges are those of a way in all groups: an input is what it is, whatever the cause. One after the other is taken, as
    long as it pays.
    """
    rows = [np.asarray(r, int) for r in rows]
    total = sum(len(r) for r in rows)

    def score(shares, kept):
        return sum(float(g.crps(g.weights(s, k))[r].sum()) for g, s, k, r in zip(groups, shares, kept, rows)) / total

    def fitted(kept):
        return [fit_shares(g, r, k) if len(r) else np.full(len(g.ways), 1.0 / len(g.ways)) for g, k, r in zip(groups, kept, rows)]

    kept, parts = [g.there for g in groups], []
    shares = fitted(kept)
    least = score(shares, kept)
    while True:
        taken = {(n.way, n.key) for n in parts}
        best = None
        for n in tried:
            if (n.way, n.key) in taken:
                continue
            now = [k & g.inside(n) for g, k in zip(groups, kept)]
            if not enough(groups, now):
                continue
            s = score(shares, now)
            if best is None or s < best[0]:
                best = (s, n, now)
        if best is None or best[0] >= least * (1.0 - LEAST_GAIN):
            return shares, parts, least
        parts, kept = [*parts, best[1]], best[2]
        shares = fitted(kept)
        least = score(shares, kept)
