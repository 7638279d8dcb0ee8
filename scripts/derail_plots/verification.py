"""Pictures of a verification: how fast two engines drift apart, and their ensembles side by side."""

import json
import os

import numpy as np
from matplotlib.lines import Line2D
from matplotlib.ticker import LogLocator, MaxNLocator, NullFormatter

from derail_plots import style
from derail_plots.errors import DataError
from derail_plots.tables import table

COLUMNS = ('cars', 'time_s', 'position_m', 'angle_rad', 'force_N', 'force_peak_N')
LEAST_POSITION = 1e-13  # m; below is rounding
LEAST_ANGLE = 1e-13  # rad
LEAST_SHARE = 1e-13
LIMIT = {'color': style.GREY, 'linewidth': 0.9}
ENGINES = (('purpose_built', 'purpose-built model'), ('multibody', 'multibody engine'))


def read_summary(folder):
    """verify.json. Throws DataError."""
    path = os.path.join(folder, 'verify.json')
    try:
        with open(path, encoding='utf-8') as file:
            return json.load(file)
    except OSError as e:
        raise DataError(f'{path}: {e.strerror}; `derail verify --out` writes it') from None
    except ValueError as e:
        raise DataError(f'{path}: {e}') from None


def read_differences(folder):
    """{cars: {column: array}} of differences.csv. Throws DataError."""
    path = os.path.join(folder, 'differences.csv')
    trains = {}
    with table(path, 'derail verify --out') as lines:
        for row in lines:
            values = [float(row[c]) for c in COLUMNS]
            trains.setdefault(int(values[0]), []).append(values[1:])
    if not trains:
        raise DataError(f'{path}: holds no differences')
    return {cars: dict(zip(COLUMNS[1:], np.array(rows).T)) for cars, rows in trains.items()}


def _decades(ax):
    ax.set_yscale('log')
    ax.yaxis.set_major_locator(LogLocator(numticks=9))
    ax.yaxis.set_major_formatter(style.decade)
    ax.yaxis.set_minor_formatter(NullFormatter())


def _cars(count):
    return '1 car' if count == 1 else f'{count} cars'


def _force_share(d):
    loaded = d['force_peak_N'] > 0.0
    return d['time_s'][loaded], d['force_N'][loaded] / d['force_peak_N'][loaded]


def _judged(summary):
    """(title, what a train has of it, the least that is drawn, what was allowed) of either panel."""
    early = summary['early']
    position = (
        'Largest difference of a position so far, m',
        lambda d: (d['time_s'], d['position_m']),
        LEAST_POSITION,
        early['position_allowed'],
    )
    if summary['model'] == 'spatial':
        return position, (
            'Of the angle of a car, rad',
            lambda d: (d['time_s'], d['angle_rad']),
            LEAST_ANGLE,
            early['angle_allowed'],
        )
    return position, (
        'Of a coupler force, over the largest force so far',
        _force_share,
        LEAST_SHARE,
        summary['criteria']['force'],
    )


def growth(summary, trains):
    """Difference of the two engines over time, from the same start at tight tolerance."""
    figure, axes = style.panels(2, 2, style.TWO_COLUMNS, 2.9)
    until = summary['early']['time_judged']
    for ax, (title, values, least, allowed) in zip(axes, _judged(summary)):
        for i, d in enumerate(train for _, train in sorted(trains.items())):
            look = {**style.series(i), 'markevery': max(len(d['time_s']) // 8, 1), 'linewidth': 1.0}
            time, apart = values(d)
            ax.plot(time, np.maximum(np.maximum.accumulate(apart), least), **look)
        _decades(ax)
        ax.plot([0.0, until], [allowed, allowed], **LIMIT, linestyle='-')
        ax.axvline(until, **LIMIT, linestyle=style.DASHES[2])
        ax.set_xlabel('time, s')
        ax.set_xlim(left=0.0)
        ax.set_title(title)
    handles = [
        Line2D([], [], **style.series(i), label=_cars(cars)) for i, cars in enumerate(sorted(trains))
    ]
    handles.append(Line2D([], [], **LIMIT, label=f'allowed of the whole train in the first {until:g} s'))
    style.legend(figure, handles, len(handles))
    style.heading(
        figure,
        'how fast the two engines drift apart',
        f"same start, {summary['fineness']}",
    )
    return figure


def ensembles(summary):
    """Distribution functions of both ensembles, a panel a quantity."""
    quantities = summary['ensemble']['quantities']
    figure, axes = style.panels(len(quantities), 3, style.TWO_COLUMNS, 1.9, y=True)
    for ax, q in zip(axes, quantities):
        for i, (engine, _) in enumerate(ENGINES):
            values = np.sort(np.array(q[engine])) / q['per_shown']
            share = np.arange(len(values) + 1) / len(values)
            look = style.series(i)
            ax.step(
                np.concatenate([values, values[-1:]]),
                share,
                where='pre',
                color=look['color'],
                linestyle=look['linestyle'],
            )
        unit = q['shown_unit']
        ax.xaxis.set_major_locator(MaxNLocator(4, integer=unit == 'cars', min_n_ticks=1))
        ax.set_xlabel(f"{q['title']}, {unit}" if unit != 'cars' else q['title'])
        ax.set_title(f"p = {min(q['p_distance'], q['p_precedence']):.2g}")
    for ax in axes[::3]:
        ax.set_ylabel('share of the runs')
    handles = []
    for i, (_, label) in enumerate(ENGINES):
        look = style.series(i)
        handles.append(Line2D([], [], color=look['color'], linestyle=look['linestyle'], label=label))
    style.legend(figure, handles, 2)
    style.heading(
        figure,
        f"{summary['ensemble']['runs']} runs of either engine",
        f"p: the smaller one of two tests, corrected for all; alpha = {summary['criteria']['alpha']:g}",
    )
    return figure


def pictures(folder):
    """(name, caption, figure) of every picture. Throws DataError."""
    summary, trains = read_summary(folder), read_differences(folder)
    try:
        yield 'verification_growth', 'Drift of two engines from the same start', growth(
            summary, trains
        )
        if summary['ensemble']['runs'] > 1 and summary['ensemble']['quantities']:
            yield 'verification_ensembles', 'Distributions of the outcomes of both engines', ensembles(
                summary
            )
    except (KeyError, TypeError) as e:
        raise DataError(f'{folder}: verify.json: {e} is missing or wrong') from None
