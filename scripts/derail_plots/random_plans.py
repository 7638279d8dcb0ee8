"""Random plans: how the outcomes are distributed, what they owe to which input."""

import numpy as np
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator

from derail_plots import style
from derail_plots.errors import DataError

COLOUR = style.COLOURS[0]
TREND = style.COLOURS[1]
RASTER_ABOVE = 300  # dots of a scatter panel that are still drawn as vectors
FIRST = {'facecolor': COLOUR, 'edgecolor': 'black', 'linewidth': 0.6}
TOTAL = {'facecolor': '#FBD9B5', 'edgecolor': 'black', 'linewidth': 0.6, 'hatch': '\\\\\\\\'}
HEIGHT = 0.36
# A run in a scatter panel; the same in its legend.
RUN = {
    'color': COLOUR,
    'marker': 'o',
    'linestyle': 'none',
    'markersize': 3.2,
    'alpha': 0.6,
    'markeredgewidth': 0.0,
}


def _whole(values):
    return np.all(values == np.round(values))


def _bins(values):
    """Whole numbers get bars of their own, as long as these do not become too many."""
    low, high = values.min(), values.max()
    if _whole(values):
        step = max(1, int(np.ceil((high - low) / 40.0)))
        return np.arange(low - 0.5, high + step, step)
    return np.histogram_bin_edges(values, bins=min(40, max(8, int(np.sqrt(values.size)))))


def _histogram(ax, outcome, values, spread):
    values = values[np.isfinite(values)]
    if values.size:
        ax.hist(values, bins=_bins(values), color='#9CC7E4', edgecolor=COLOUR, linewidth=0.5)
    if _whole(values):
        ax.xaxis.set_major_locator(MaxNLocator(integer=True))
    ax.axvline(spread.median, color='black')
    for edge in (spread.low, spread.high):
        ax.axvline(edge, color='black', linestyle=style.DASHES[1])
    number = style.number
    ax.set_title(
        f'median {number(spread.median)}; '
        f'{spread.kind}: {number(spread.low)} to {number(spread.high)}'
    )
    ax.set_xlabel(outcome.label)
    ax.set_ylabel('runs')


def distributions(study):
    """A histogram an outcome, with median and range."""
    figure, axes = style.panels(len(study.outcomes), 2, style.TWO_COLUMNS, 1.75)
    for ax, outcome in zip(axes, study.outcomes):
        _histogram(ax, outcome, study.samples[outcome.name], study.spread(-1, outcome))
    style.legend(
        figure,
        [
            Line2D([], [], color='black', label='median'),
            Line2D([], [], color='black', linestyle=style.DASHES[1], label=f'ends of: {study.ranges}'),
        ],
        2,
    )
    style.heading(figure, 'distribution of the outcomes', study.counted)
    return figure


def _groups(x):
    """Masks of runs with about the same input: each value if few, else equally many runs each."""
    values = np.unique(x)
    if values.size <= 12:
        return [x == v for v in values]
    count = int(np.clip(x.size // 30, 3, 10))
    edges = np.quantile(x, np.linspace(0.0, 1.0, count + 1))
    place = np.clip(np.searchsorted(edges, x, side='right') - 1, 0, count - 1)
    return [place == i for i in range(count) if np.any(place == i)]


def _scatter(ax, x, y):
    finite = np.isfinite(y)
    x, y = x[finite], y[finite]
    ax.plot(x, y, **RUN, rasterized=x.size > RASTER_ABOVE)
    groups = _groups(x) if x.size else []
    middle = [np.median(x[g]) for g in groups]
    low, median, high = (
        np.array([np.quantile(y[g], q) for g in groups]) for q in (0.05, 0.5, 0.95)
    )
    for edge in (low, high):
        ax.plot(middle, edge, color='black', linewidth=0.9, linestyle=style.DASHES[1])
    ax.plot(
        middle,
        median,
        color=TREND,
        marker='s',
        markersize=3.5,
        markeredgecolor='black',
        markeredgewidth=0.5,
    )


def scatter(study, outcome):
    """A panel an input: every run, and the trend."""
    figure, axes = style.panels(len(study.factors), 3, style.TWO_COLUMNS, 1.9, y=True)
    for ax, factor in zip(axes, study.factors):
        _scatter(ax, study.samples[factor.name], study.samples[outcome.name])
        ax.set_xlabel(factor.label)
        if factor.name in study.log_factors:
            style.logarithmic(ax)
    style.legend(
        figure,
        [
            Line2D([], [], label='a run', **RUN),
            Line2D(
                [],
                [],
                color=TREND,
                marker='s',
                markersize=3.5,
                markeredgecolor='black',
                markeredgewidth=0.5,
                label='median of runs with like input',
            ),
            Line2D(
                [],
                [],
                color='black',
                linewidth=0.9,
                linestyle=style.DASHES[1],
                label='5 % and 95 % of these',
            ),
        ],
        3,
    )
    style.side_label(figure, outcome.label)
    style.heading(figure, outcome.title, study.counted)
    return figure


def _indices(study, outcome):
    """Factor name -> {'first': (value, low, high), 'total': ...} of an outcome."""
    try:
        return {
            row['factor']: {
                kind: tuple(float(row[kind + end]) for end in ('', '_low', '_high'))
                for kind in ('first', 'total')
            }
            for row in study.sobol
            if row['outcome'] == outcome.name
        }
    except (KeyError, TypeError, ValueError) as e:
        raise DataError(f'sobol.csv: {e}') from None


def _sobol_panel(ax, study, outcome, indices):
    for y, factor in enumerate(reversed(study.factors)):
        for kind, look, shift in (('first', FIRST, 0.5), ('total', TOTAL, -0.5)):
            value, low, high = indices[factor.name][kind]
            place = y + shift * HEIGHT
            ax.barh(place, value, HEIGHT, **look)
            ax.hlines(place, low, high, color='black', linewidth=0.9, zorder=4)
            ax.vlines([low, high], place - 0.1, place + 0.1, color='black', linewidth=0.9, zorder=4)
    ax.axvline(0.0, color='black', linewidth=0.6)
    ax.set_yticks(range(len(study.factors)), [f.title for f in reversed(study.factors)])
    ax.tick_params(axis='y', length=0)
    ax.grid(False, axis='y')
    ax.set_title(style.wrapped(outcome.title, 50))


def sobol(study):
    """A panel an outcome: first-order and total index of each input; None if no outcome has any."""
    found = [(outcome, _indices(study, outcome)) for outcome in study.outcomes]
    found = [(outcome, indices) for outcome, indices in found if indices]
    if not found:
        return None
    height = 0.3 * len(study.factors) + 0.6
    figure, axes = style.panels(len(found), 2, style.TWO_COLUMNS, height, x=True, y=True)
    for ax, (outcome, indices) in zip(axes, found):
        _sobol_panel(ax, study, outcome, indices)
    for ax in style.lowest(axes, 2):
        ax.set_xlabel("share of the outcome's variance")
    style.legend(
        figure,
        [
            Patch(label='the input alone (first order)', **FIRST),
            Patch(label='with all interactions (total)', **TOTAL),
            Line2D([], [], color='black', marker='|', linewidth=0.9, label='95 % confidence'),
        ],
        3,
    )
    style.heading(figure, 'Sobol indices', f"{study.counted}, {study.sobol[0]['samples']} samples")
    return figure
