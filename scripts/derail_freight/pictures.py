"""Pictures of how well freight derailments are predicted."""

import numpy as np
from matplotlib.lines import Line2D

from derail_freight.scores import PIT_BINS
from derail_plots import style

SHOWN = (('simulation', ''), ('quantile forest', 'by folds'), ('Truncated Geometric', 'by folds'))
SPEED_STEP = 5.0


def _labels(models):
    return [(key, f'{key[0]}{", " if key[1] else ""}{key[1]}') for key in SHOWN if key in models]


def reliability(table, models):
    """Histograms of the probability integral transform: flat if what is predicted with some chance happens as often."""
    shown = _labels(models)
    figure, axes = style.panels(len(shown), 3, style.TWO_COLUMNS, 2.3, x=True, y=True)
    edges = np.linspace(0.0, 1.0, PIT_BINS + 1)
    for i, (ax, (key, label)) in enumerate(zip(axes, shown)):
        ax.bar(edges[:-1], models[key].scores()['pit'], 1.0 / PIT_BINS, align='edge', color=style.series(i)['color'], edgecolor='white')
        ax.axhline(1.0 / PIT_BINS, color='black', linewidth=0.8)
        ax.set_title(style.wrapped(label, 30))
        ax.set_xlabel('predicted chance of fewer cars')
    axes[0].set_ylabel('share of accidents')
    style.heading(figure, 'reliability', f'{len(table)} accidents; flat at {1 / PIT_BINS:g}: as reliable as can be')
    return figure


def by_cause(table, models):
    """Error of the median for each cause."""
    shown, groups = _labels(models), sorted(set(table.group))
    figure, (ax,) = style.panels(1, 1, style.TWO_COLUMNS, 2.9)
    for i, (key, label) in enumerate(shown):
        errors = [models[key].scores(table.group == g)['mae'] for g in groups]
        ax.plot(errors, np.arange(len(groups)), **dict(style.series(i), linestyle='none', markersize=7), label=label)
    ax.set_xlim(left=0.0)
    ax.set_yticks(np.arange(len(groups)), [f"{g.replace('_', ' ')} ({(table.group == g).sum()})" for g in groups])
    ax.invert_yaxis()
    ax.set_xlabel('mean absolute error of the median, cars')
    style.legend(figure, ax.get_legend_handles_labels()[0], 3)
    style.heading(figure, 'error by cause', f'{len(table)} accidents')
    return figure


def over_speed(table, models):
    """Real and predicted means over speed, by the simulation and by the forest, one panel for each cause."""
    groups = sorted(set(table.group))
    figure, axes = style.panels(len(groups), 3, style.TWO_COLUMNS, 2.1, x=True, y=True)
    v, rows = table['speed_mph'], models['simulation', '']
    theirs = models['quantile forest', 'by folds']
    edges = np.arange(0.0, v.max() + SPEED_STEP, 2 * SPEED_STEP)
    for ax, group in zip(axes, groups):
        places, real, mean, low, high, forest = [], [], [], [], [], []
        for start, end in zip(edges[:-1], edges[1:]):
            k = (table.group == group) & (v >= start) & (v < end)
            if k.sum() < 5:
                continue
            places.append(v[k].mean())
            for values, of in ((real, table.real), (mean, rows.mean), (low, rows.low), (high, rows.high), (forest, theirs.mean)):
                values.append(of[k].mean())
        ax.fill_between(places, low, high, facecolor='0.87', edgecolor='none')
        ax.plot(places, mean, color=style.COLOURS[1], linestyle='-')
        ax.plot(places, forest, color=style.COLOURS[3], linestyle='--')
        ax.plot(places, real, color=style.COLOURS[0], marker='o', linestyle='none')
        ax.set_title(group.replace('_', ' '))
    axes[0].set_ylim(bottom=0.0)  # of all panels; once everything is drawn
    for ax in style.lowest(axes, 3):
        ax.set_xlabel('train speed, mph')
    for ax in axes[::3]:
        ax.set_ylabel('cars derailed')
    handles = [
        Line2D([], [], color=style.COLOURS[0], marker='o', linestyle='none', label='real, mean'),
        Line2D([], [], color=style.COLOURS[1], label='simulation, mean'),
        Line2D([], [], color=style.COLOURS[3], linestyle='--', label='quantile forest by folds, mean'),
        Line2D([], [], color='0.87', linewidth=6, label='simulation, 5 to 95 %, mean of the ends'),
    ]
    style.legend(figure, handles, 2)
    style.heading(figure, 'cars derailed over speed, by cause', f'{len(table)} accidents, bands of {2 * SPEED_STEP:g} mph with five or more')
    return figure


def few_cars(table, models):
    """Share of events of two cars or fewer, real and predicted, by cause and speed."""
    figure, (ax,) = style.panels(1, 1, style.ONE_COLUMN, 3.7)
    ax.plot([0.0, 100.0], [0.0, 100.0], color='black', linewidth=0.8)
    ax.fill_between([0.0, 100.0], [-10.0, 90.0], [10.0, 110.0], facecolor='0.9', edgecolor='none')
    handles = []
    for i, group in enumerate(sorted(set(table.group))):
        look = dict(style.series(i), linestyle='none')
        for k in table.bands().values():
            k = k & (table.group == group)
            if k.sum() < 30:
                continue
            s = models['simulation', ''].scores(k)
            ax.plot(100 * s['few_real'], 100 * s['few'], **look)
        handles.append(Line2D([], [], **look, label=group.replace('_', ' ')))
    ax.set_xlim(0.0, 100.0)
    ax.set_ylim(0.0, 100.0)
    ax.set_aspect('equal')
    ax.set_xlabel('real, %')
    ax.set_ylabel('simulation, %')
    style.legend(figure, handles, 2)
    style.heading(figure, 'two cars or fewer', 'causes and speeds with 30 accidents')
    return figure


def pictures(table, models):
    """(name, caption, figure) of every picture."""
    yield 'freight_reliability', 'Reliability of the predicted distributions', reliability(table, models)
    yield 'freight_by_cause', 'Error of the median by cause', by_cause(table, models)
    yield 'freight_over_speed', 'Cars derailed over speed by cause, real and predicted', over_speed(table, models)
    yield 'freight_few_cars', 'Share of events of two cars or fewer, real and predicted', few_cars(table, models)
