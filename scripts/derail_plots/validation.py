"""Pictures of a validation: predicted counts of derailed cars, and how they lie, against real ones."""

import json
import os

import numpy as np
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from derail_plots import style
from derail_plots.errors import DataError
from derail_plots.tables import table

COLUMNS = (
    'speed_mph',
    'cars_from_pod_to_rear',
    'cars_derailed',
    'predicted_median',
    'predicted_low',
    'predicted_high',
)
FITS = ('straight_line', 'linear', 'log_log')
BAND = {'facecolor': '0.85', 'edgecolor': 'none'}
BINS = 8  # of the tail
POSTURE = (  # key, title of the panel
    ('over', 'cars on their side or over,\nof the derailed'),
    ('none_over', 'accidents with\nno such car'),
    ('all_over', 'accidents with\nsuch cars only'),
)


def read_rows(folder):
    """{column: array} of rows.csv, rows whose runs all failed left out. None for tables of accidents that
    have other columns, such as those of posture. Throws DataError."""
    path = os.path.join(folder, 'rows.csv')
    rows = []
    with table(path, 'derail validate') as lines:
        names = lines.fieldnames or ()
        if 'predicted_median' in names and not set(COLUMNS) <= set(names):
            return None
        for row in lines:
            if row['predicted_median'] == '':
                continue
            fits = [float(row[f'{name}_left_out'] or 'nan') for name in FITS]
            rows.append([float(row[c]) for c in COLUMNS] + fits)
    if not rows:
        raise DataError(f'{path}: holds no predictions')
    return dict(zip(COLUMNS + FITS, np.array(rows).T))


def read_summary(folder):
    """validation.json. Throws DataError."""
    path = os.path.join(folder, 'validation.json')
    try:
        with open(path, encoding='utf-8') as file:
            return json.load(file)
    except OSError as e:
        raise DataError(f'{path}: {e.strerror}; `derail validate` writes it') from None
    except ValueError as e:
        raise DataError(f'{path}: {e}') from None


def _detail(summary):
    return f"{summary['rows']} accidents, {summary['members']} members each"


def _points(ax, x, rows, **options):
    """Median with the 90 % interval; open where the real count lies outside."""
    median, low, high = (rows[f'predicted_{c}'] for c in ('median', 'low', 'high'))
    outside = (rows['cars_derailed'] < low) | (rows['cars_derailed'] > high)
    ax.vlines(x, low, high, color='0.6', linewidth=0.7, **options)
    for i, which in enumerate((~outside, outside)):
        look = style.series(i)
        ax.plot(
            x[which],
            median[which],
            look['marker'],
            color=look['color'],
            markerfacecolor=look['color'] if i == 0 else 'white',
            markersize=3,
        )


def _point_legend():
    inside, outside = style.series(0), style.series(1)
    return [
        Line2D([], [], linestyle='none', marker=inside['marker'], color=inside['color'],
               label='real count within'),
        Line2D([], [], linestyle='none', marker=outside['marker'], color=outside['color'],
               markerfacecolor='white', label='real count outside'),
        Line2D([], [], color='0.6', linewidth=0.7, label='90 % interval of the members'),
    ]


def against_real(summary, rows):
    """Predicted median and interval over the real count; on the diagonal they agree."""
    figure, (ax,) = style.panels(1, 1, style.ONE_COLUMN, 3.75)
    real = rows['cars_derailed']
    end = 1.05 * max(real.max(), rows['predicted_high'].max())
    ax.plot([0.0, end], [0.0, end], color='black', linewidth=0.8)
    # Equal counts lie side by side instead of on each other.
    place = {}
    shift = np.zeros(len(real))
    for i, count in enumerate(real):
        k = place.setdefault(count, 0)
        place[count] += 1
        shift[i] = 0.1 * (1 - 2 * (k % 2)) * ((k + 1) // 2)
    _points(ax, real + np.clip(shift, -0.45, 0.45), rows)
    ax.set_xlim(0.0, end)
    ax.set_ylim(0.0, end)
    ax.set_aspect('equal')
    ax.set_xlabel('cars derailed, real')
    ax.set_ylabel('cars derailed, predicted')
    style.legend(figure, _point_legend(), 2)
    style.heading(figure, 'predicted against real', _detail(summary))
    return figure


def over_speed(summary, rows):
    """Real counts over speed; behind them the members' interval, averaged over bands of speed."""
    figure, (ax,) = style.panels(1, 1, style.TWO_COLUMNS, 3.2)
    speed, real = rows['speed_mph'], rows['cars_derailed']
    group = summary['groups'][0]
    edges, low, high, mean = [], [], [], []
    for band in group['speeds']:
        start, end = band['from_mph'], band['to_mph']
        # As `derail validate` sorts them: from 10 mph on an edge belongs to the band below.
        inside = (speed >= start) & (speed < end) if end <= 10.0 else (speed > start) & (speed <= end)
        if start == 10.0:
            inside |= speed == start
        edges.append((start, end))
        low.append(rows['predicted_low'][inside].mean())
        high.append(rows['predicted_high'][inside].mean())
        mean.append(rows['predicted_median'][inside].mean())
    look = style.series(1)
    for (start, end), a, b, m in zip(edges, low, high, mean):
        ax.fill_between([start, end], a, b, **BAND)
        ax.plot([start, end], [m, m], color=look['color'], linewidth=1.6)
    middle = [0.5 * (a + b) for a, b in edges]
    ax.plot(middle, [b['real'] for b in group['speeds']], linestyle='none', marker='D',
            markersize=6, markerfacecolor='none', color='black')
    ax.plot(speed, real, linestyle='none', marker='o', markersize=2.4, color=style.COLOURS[0])
    ax.set_xlim(left=0.0)
    ax.set_ylim(bottom=0.0)
    ax.set_xlabel('train speed, mph')
    ax.set_ylabel('cars derailed')
    handles = [
        Line2D([], [], linestyle='none', marker='o', markersize=3, color=style.COLOURS[0], label='real'),
        Line2D([], [], linestyle='none', marker='D', markersize=6, markerfacecolor='none',
               color='black', label='real, mean'),
        Line2D([], [], color=look['color'], linewidth=1.6, label='predicted, mean of the medians'),
        Patch(**BAND, label='predicted, 90 % interval, mean of its ends'),
    ]
    style.legend(figure, handles, 4)
    style.heading(figure, 'cars derailed over speed', _detail(summary))
    return figure


def error_over_tail(summary, rows):
    """Predicted minus real over the cars from the first derailed one to the rear.

    The scale is the simulation's: fits of a few rows can be hundreds of cars off.
    """
    figure, (ax,) = style.panels(1, 1, style.TWO_COLUMNS, 3.2)
    tail = rows['cars_from_pod_to_rear']
    error = rows['predicted_median'] - rows['cars_derailed']
    ax.axhline(0.0, color='black', linewidth=0.8)
    ax.plot(tail, error, linestyle='none', marker='o', markersize=2.4, color='0.55')
    edges = np.linspace(0.0, tail.max(), BINS + 1)
    handles = [Line2D([], [], linestyle='none', marker='o', markersize=3, color='0.55',
                      label='simulation, one accident')]
    series = [('simulation, mean', error)]
    series += [
        (f"{name.replace('_', ' ')}, left out, mean", rows[name] - rows['cars_derailed'])
        for name in FITS
    ]
    for i, (label, values) in enumerate(series):
        means, places = [], []
        for start, end in zip(edges[:-1], edges[1:]):
            inside = (tail > start) & (tail <= end) & np.isfinite(values)
            if np.any(inside):
                places.append(0.5 * (start + end))
                means.append(values[inside].mean())
        if not means:
            continue
        ax.plot(places, means, **style.series(i))
        handles.append(Line2D([], [], **style.series(i), label=label))
    reach = 1.1 * max(np.abs(error).max(), 1.0)
    ax.set_ylim(-reach, reach)
    ax.set_xlim(left=0.0)
    ax.set_xlabel('cars from the first derailed one to the rear')
    ax.set_ylabel('predicted \N{MINUS SIGN} real, cars')
    style.legend(figure, handles, 3)
    style.heading(figure, 'error over the length of the tail', _detail(summary))
    return figure


def _number(value):
    return float('nan') if value is None else value


def _band_name(band):
    """As the table of `derail validate` names it, with the number of accidents below it."""
    start, end = band['from_mph'], band['to_mph']
    speeds = f'{start + 1:.0f}\N{EN DASH}{end:.0f}' if end is not None else f'> {start:.0f}' if start > 0.0 else 'all'
    return f"{speeds}\nn = {band['real']['count']}"


def posture(summary):
    """Share of the derailed cars that lie on their side or over by bands of speed, with its spread; accidents
    in which none and in which all do."""
    figure, axes = style.panels(len(POSTURE), len(POSTURE), style.TWO_COLUMNS, 3.0, y=True)
    bands = summary['posture']
    places = np.arange(len(bands))
    sides = (('real', -0.13, 'white'), ('predicted', 0.13, None))
    for ax, (key, title) in zip(axes, POSTURE):
        for i, (side, shift, face) in enumerate(sides):
            look = style.series(i)
            shares = np.array([_number(band[side][key]) for band in bands])
            if key == 'over':
                spread = np.array([_number(band[side]['sd']) for band in bands])
                known = np.isfinite(shares) & np.isfinite(spread)
                ends = (np.clip((shares + sign * spread)[known], 0.0, 1.0) for sign in (-1.0, 1.0))
                ax.vlines(places[known] + shift, *ends, color=look['color'], linewidth=0.9)
            ax.plot(places + shift, shares, linestyle='none', marker=look['marker'], markersize=5,
                    color=look['color'], markerfacecolor=face or look['color'])
        ax.axvline(len(bands) - 1.5, color='0.6', linewidth=0.6)  # the last one is all speeds
        ax.set_title(title)
        ax.set_xticks(places, [_band_name(band) for band in bands], fontsize=7)
        ax.set_xlim(-0.5, len(bands) - 0.5)
        ax.set_ylim(-0.03, 1.03)
        ax.grid(False, axis='x')
        ax.set_xlabel('train speed, mph; n accidents')
    axes[0].set_ylabel('share')
    real, predicted = style.series(0), style.series(1)
    style.legend(figure, [
        Line2D([], [], linestyle='none', marker=real['marker'], color=real['color'], markerfacecolor='white',
               label='reports'),
        Line2D([], [], linestyle='none', marker=predicted['marker'], color=predicted['color'], label='prediction'),
        Line2D([], [], color=style.GREY, linewidth=0.9,
               label='\N{PLUS-MINUS SIGN} one standard deviation of single accidents, of single members'),
    ], 3)
    style.heading(figure, 'how derailed cars lie', f"{_detail(summary)}; where 5 cars or more derailed")
    return figure


def pictures(folder):
    """(name, caption, figure) of every picture. Throws DataError."""
    summary, rows = read_summary(folder), read_rows(folder)
    if rows is None and not summary.get('posture'):
        raise DataError(f"{folder}: nothing to draw: rows.csv has not all of the columns {', '.join(COLUMNS[:3])}, "
                        "and validation.json no posture")
    try:
        if summary.get('posture'):
            yield 'validation_posture', 'How derailed cars lie, real and predicted', posture(summary)
        if rows is None:
            return
        yield 'validation_counts', 'Predicted against real counts of derailed cars', against_real(
            summary, rows
        )
        yield 'validation_speed', 'Cars derailed over speed, real and predicted', over_speed(
            summary, rows
        )
        yield 'validation_tail', 'Error of the prediction over the length of the tail', error_over_tail(
            summary, rows
        )
    except (KeyError, IndexError, TypeError) as e:
        raise DataError(f'{folder}: validation.json: {e} is missing or wrong') from None
