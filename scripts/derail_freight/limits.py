"""What holds a prediction back: the number of its members, what statistics could add to it, what the reports do not tell."""

import numpy as np

from derail_freight import competitors
from derail_freight.scores import Rows, distribution, mean, quantile

FEW = 2  # cars: an event of one or two is told from a larger one
SUMMARY = (0.05, 0.25, 0.5, 0.75, 0.95)
DRAWS = 2000
BOUND = 0.10  # of the share of small events, as asked for
LEAST_ROWS = 30


class WithPredictions:
    """A table whose features also hold, of each row, a summary of predictions: mean, quantiles, share of small events."""

    def __init__(self, table, predictions):
        self.table, self.real = table, table.real
        summaries = [[mean(d), *(quantile(d, q) for q in SUMMARY), small(d)] for d in predictions]
        self.added = np.array(summaries)

    def __len__(self):
        return len(self.table)

    def __getitem__(self, column):
        return self.table[column]

    def features(self):
        return np.column_stack([self.table.features(), self.added])


def small(d):
    """Share of the events with FEW cars or fewer."""
    return float(d[1][d[0] <= FEW].sum())


def told(d, real):
    """What is left of a distribution if somebody said whether FEW cars or fewer derailed; all of it if it has nothing of that kind."""
    k = (d[0] <= FEW) == (real <= FEW)
    return distribution(d[0][k], d[1][k]) if k.any() else d


def mixture(one, other):
    """Half of each."""
    return distribution(np.concatenate([one[0], other[0]]), np.concatenate([one[1], other[1]]))


def of_fewer_members(distributions, count, random):
    """Of each row as many of its members, drawn without replacement."""
    drawn = [random.choice(d[0], min(count, len(d[0])), replace=False) for d in distributions]
    return [distribution(v) for v in drawn]


def r2_of_many(real, distributions):
    """R2 of the mean, had each row members without end: the scatter of a mean of n is the variance over n.

    Members that are spread over ways and ranges by design scatter less than that, so it is an upper bound.
    """
    squares = np.array([(mean(d) - y) ** 2 - np.var(d[0], ddof=1) / len(d[0]) for d, y in zip(distributions, real)])
    return 1.0 - float(squares.sum() / np.sum((real - real.mean()) ** 2))


def own_error(d):
    """Mean absolute error of the median, were the counts drawn from the distribution."""
    return float(np.sum(d[1] * np.abs(d[0] - quantile(d, 0.5))))


def groups_of_cause_and_speed(table):
    """Which rows: of each cause and band of speed with LEAST_ROWS rows or more."""
    groups = [k & (table.group == g) for g in sorted(set(table.group)) for k in table.bands().values()]
    return [k for k in groups if k.sum() >= LEAST_ROWS]


def groups_beyond(groups, shares, is_small):
    """How many groups have a share of small events that differs by more than BOUND from the predicted one."""
    return sum(abs(is_small[k].mean() - shares[k].mean()) > BOUND for k in groups)


def groups_beyond_by_chance(groups, shares, random):
    """The same number for counts drawn from the prediction itself: its mean, and what it exceeds in 5 % of the draws."""
    drawn = [groups_beyond(groups, shares, random.random(len(shares)) < shares) for _ in range(DRAWS)]
    return float(np.mean(drawn)), float(np.quantile(drawn, 0.95))


def study(table, distributions):
    """{what: Rows} of a prediction by members (their distributions, row by row), and of what could be made of it."""
    random = np.random.default_rng(0)
    folds = table.folds()
    forest = competitors.held_out(competitors.forest, table, folds)
    both = competitors.held_out(competitors.forest, WithPredictions(table, distributions), folds)
    found = {'simulation': distributions}
    most = max(len(d[0]) for d in distributions)
    for count in sorted({max(2, most // 4), max(2, most // 2)}):
        found[f'the same with {count} members'] = of_fewer_members(distributions, count, random)
    found['forest by folds'] = forest
    found['forest that also knows the simulation, by folds'] = both
    found['half simulation, half forest'] = [mixture(a, b) for a, b in zip(distributions, forest)]
    found['simulation that is told whether two cars or fewer derail'] = [told(d, y) for d, y in zip(distributions, table.real)]
    found['forest that is told it, by folds'] = [told(d, y) for d, y in zip(forest, table.real)]
    return {name: Rows(table.real, ds) for name, ds in found.items()}
