"""Statistical models that predict how many cars derail: each gives a distribution of the count of every row."""

import os

# Small tables: threads that wait for each other on a busy machine cost more than they bring.
os.environ.setdefault('OMP_NUM_THREADS', '1')

import numpy as np
from scipy.optimize import minimize
from sklearn.ensemble import HistGradientBoostingRegressor, RandomForestRegressor

from derail_freight.scores import distribution

TREES, LEAF, FEATURES = 400, 10, 0.4
LEVELS = np.linspace(0.025, 0.975, 20)


def truncated_geometric(table, learn, predict):
    """Truncated Geometric in speed and residual length (Bagheri and others 2011; Li, Bian and Liu 2023).

    P(n) = p (1 - p)^(n - 1) / (1 - (1 - p)^L) for n from 1 to L cars behind the point of derailment, logit p linear in
    the logarithms of speed and L, by maximum likelihood. A count above L, as some reports have, counts as L there.
    """
    length = np.maximum(table['cars_from_pod_to_rear'], 1.0)
    x = np.column_stack([np.ones(len(length)), np.log(table['speed_mph']), np.log(length)])
    n = np.minimum(table.real, length)

    def chance(b, rows):
        return np.clip(1.0 / (1.0 + np.exp(-x[rows] @ b)), 1e-6, 1.0 - 1e-6)

    def loss(b):
        p = chance(b, learn)
        log_rest = np.log1p(-p)
        return -np.sum(np.log(p) + (n[learn] - 1.0) * log_rest - np.log(-np.expm1(length[learn] * log_rest)))

    b = minimize(loss, np.array([0.0, -0.5, 0.0]), method='Nelder-Mead', options={'maxiter': 4000, 'xatol': 1e-5, 'fatol': 1e-4}).x
    found = []
    for p, most in zip(chance(b, predict), length[predict]):
        values = np.arange(1.0, most + 1.0)
        found.append(distribution(values, (1.0 - p) ** (values - 1.0)))
    return found


def _regression(table, learn, predict, logarithms):
    """Least squares in speed, cars behind the point of derailment and tons a car, with the residuals that it had."""
    columns = [table['speed_mph'], table['cars_from_pod_to_rear'], table['tons_per_car']]
    if logarithms:
        columns = [np.log(np.maximum(c, 1.0)) for c in columns]
    x = np.column_stack([np.ones(len(table))] + columns)
    y = np.log(table.real) if logarithms else table.real
    b = np.linalg.lstsq(x[learn], y[learn], rcond=None)[0]
    residuals = np.sort(y[learn] - x[learn] @ b)
    cars = table['n_cars']
    found = []
    for i in predict:
        values = x[i] @ b + residuals
        found.append(distribution(np.clip(np.exp(values) if logarithms else values, 1.0, cars[i])))
    return found


def linear(table, learn, predict):
    return _regression(table, learn, predict, False)


def log_log(table, learn, predict):
    return _regression(table, learn, predict, True)


def forest(table, learn, predict):
    """Quantile regression forest (Meinshausen 2006) with everything that the table tells beforehand, cause too."""
    x, y = table.features(), table.real
    trees = RandomForestRegressor(TREES, min_samples_leaf=LEAF, max_features=FEATURES, random_state=0).fit(x[learn], y[learn])
    of_learned, of_new = trees.apply(x[learn]), trees.apply(x[predict])
    weights = np.zeros((len(predict), len(learn)))
    for t in range(of_new.shape[1]):
        same = of_new[:, t][:, None] == of_learned[:, t][None, :]
        weights += same / same.sum(axis=1, keepdims=True)
    found = []
    for w in weights:
        k = w > 0.0
        found.append(distribution(y[learn][k], w[k]))
    return found


def boosting(table, learn, predict):
    """Gradient boosting of twenty quantiles."""
    x, y = table.features(), table.real
    values = np.array([
        HistGradientBoostingRegressor(loss='quantile', quantile=q, max_iter=120, learning_rate=0.06, max_leaf_nodes=8, min_samples_leaf=20, random_state=0)
        .fit(x[learn], y[learn])
        .predict(x[predict])
        for q in LEVELS
    ])  # fmt: skip
    return [distribution(np.clip(v, 1.0, n)) for v, n in zip(values.T, table['n_cars'][predict])]


def mean_of_all(table, learn, predict):
    """The counts of all rows, whatever the row: what knows nothing."""
    return [distribution(table.real[learn])] * len(predict)


MODELS = {
    'counts of all rows': mean_of_all,
    'Truncated Geometric': truncated_geometric,
    'linear': linear,
    'log-log': log_log,
    'quantile forest': forest,
    'boosting': boosting,
}


def in_sample(model, table):
    every = np.arange(len(table))
    return model(table, every, every)


def held_out(model, table, folds, count=None):
    """Distributions of all rows, each from the rows of the other folds alone; with `count` those of the first `count` rows, from the
    rows behind these."""
    first = 0 if count is None else count
    folds_of = folds[:count]
    found = [None] * len(folds_of)
    for fold in sorted(set(folds_of)):
        learn, predict = first + np.flatnonzero(folds[first:] != fold), np.flatnonzero(folds_of == fold)
        for i, d in zip(predict, model(table, learn, predict)):
            found[i] = d
    return found
