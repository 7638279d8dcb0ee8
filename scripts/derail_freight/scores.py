"""Scores of predicted distributions of a count. A distribution is a pair of arrays: values, and their weights, which add up to 1."""

import numpy as np

INTERVAL = (0.05, 0.95)
PIT_BINS = 10


def distribution(values, weights=None):
    """Sorted values and their weights; equal ones if there are none given."""
    values = np.asarray(values, float)
    weights = np.ones(len(values)) if weights is None else np.asarray(weights, float)
    order = np.argsort(values, kind='stable')
    return values[order], weights[order] / weights.sum()


def quantile(d, share):
    """The least value up to which at least that share lies."""
    values, weights = d
    return float(values[min(np.searchsorted(np.cumsum(weights), share - 1e-12), len(values) - 1)])


def mean(d):
    return float(np.dot(*d))


def crps(d, real):
    """Continuous ranked probability score of a whole distribution: mean distance to the real count less half that of two draws."""
    values, weights = d
    below = np.cumsum(weights) - weights
    apart = 2.0 * float(np.sum(weights * values * (2.0 * below + weights - 1.0)))
    return float(np.sum(weights * np.abs(values - real))) - 0.5 * apart


def fair_crps(values, weights, strata, real):
    """The same of members that are draws, those of a stratum of one distribution: corrected for their number (Ferro 2014).

    Two draws of different strata are as far apart as any such two; of one stratum they may not be the same member. A stratum with one
    member counts as if all of it were alike.
    """
    values, weights = np.asarray(values, float), np.asarray(weights, float) / np.sum(weights)
    apart = np.abs(values[:, None] - values[None, :]) * weights[:, None] * weights[None, :]
    half = 0.5 * float(apart.sum())
    strata = np.array(list(strata))
    for stratum in set(strata):
        k = strata == stratum
        alike = float(np.sum(weights[k] ** 2))
        different = float(np.sum(weights[k])) ** 2 - alike
        if different > 1e-12:
            half += 0.5 * float(apart[np.ix_(k, k)].sum()) * alike / different
    return float(np.sum(weights * np.abs(values - real))) - half


def pit(d, real):
    """Ends of the step of the distribution function at the real count (Czado, Gneiting and Held 2009)."""
    values, weights = d
    return float(weights[values < real].sum()), float(weights[values <= real].sum())


def pit_histogram(ends, bins=PIT_BINS):
    """Share of the rows in each bin; each row is spread evenly over its step. Of a reliable prediction all are 1 / bins."""
    edges = np.linspace(0.0, 1.0, bins + 1)
    low, high = np.asarray(ends, float).T
    high = np.minimum(high, 1.0)
    width = np.maximum(high - low, 1e-12)
    low = np.where(high - low < 1e-12, np.minimum(low, 1.0 - 1e-12), low)
    up_to = np.clip((edges[None, :] - low[:, None]) / width[:, None], 0.0, 1.0)
    return np.diff(up_to.mean(axis=0))


class Rows:
    """What is kept of the predictions of one model for many rows."""

    def __init__(self, real, distributions, scores=None):
        """`scores`: continuous ranked probability score of each row, if that of its distribution is not the one that is meant."""
        self.real = np.asarray(real, float)
        self.median = np.array([quantile(d, 0.5) for d in distributions])
        self.mean = np.array([mean(d) for d in distributions])
        self.low, self.high = (np.array([quantile(d, q) for d in distributions]) for q in INTERVAL)
        self.crps = np.array([crps(d, y) for d, y in zip(distributions, self.real)] if scores is None else scores)
        self.pit = np.array([pit(d, y) for d, y in zip(distributions, self.real)])
        self.few = np.array([d[1][d[0] <= 2].sum() for d in distributions])

    def scores(self, some=None):
        """Of some of the rows."""
        k = np.ones(len(self.real), bool) if some is None else some
        real = self.real[k]
        about = float(np.sum((real - real.mean()) ** 2))
        squares = float(np.sum((self.mean[k] - real) ** 2))
        return {
            'rows': int(k.sum()),
            'mae': float(np.abs(self.median[k] - real).mean()),
            'mse': squares / len(real),
            'r2': 1.0 - squares / about if about > 0.0 else None,
            'crps': float(self.crps[k].mean()),
            'held': float(((self.low[k] <= real) & (real <= self.high[k])).mean()),
            'width': float((self.high[k] - self.low[k]).mean()),
            'bias': float((self.mean[k] - real).mean()),
            'few_real': float((real <= 2).mean()),
            'few': float(self.few[k].mean()),
            'pit': [float(x) for x in pit_histogram(self.pit[k])],
        }
