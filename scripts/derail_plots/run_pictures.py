"""Pictures of one run: the final layout to scale, coupler forces over car and time."""

import numpy as np
from matplotlib.collections import PolyCollection
from matplotlib.colors import FuncNorm, LinearSegmentedColormap
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator

from derail_plots import run_data, style
from derail_plots.run_data import FOOT, KIP

OFF_TRACK = {'facecolor': '#56B4E9', 'edgecolor': 'black', 'linewidth': 0.5}
ON_TRACK = {'facecolor': 'white', 'edgecolor': 'black', 'linewidth': 0.5}
# How cars lie that are off the track, where it is known: the colours of the scene's "how cars lie", and hatches.
ON_SIDE = {'facecolor': '#F0E442', 'edgecolor': 'black', 'linewidth': 0.5, 'hatch': '//////'}
INVERTED = {'facecolor': '#D55E00', 'edgecolor': 'black', 'linewidth': 0.5, 'hatch': 'xxxxxx'}
OVER, TURNED_OVER = np.radians(45.0), np.radians(135.0)  # as outcome::kOver and outcome::kInverted
TRACK = {'color': '0.55', 'linewidth': 0.8, 'zorder': 0.5}
DRAWN_LENGTH = 6.5  # inches of the page that the train has
LEAST_HEIGHT = 0.45
ROOM_FOR_NUMBERS = 0.5
PEAKS = (
    {'color': style.COLOURS[0], 'marker': 'o'},
    {'color': style.COLOURS[1], 'marker': 's', 'markerfacecolor': 'white'},
)
LEAVES = {'color': 'black', 'marker': 'o', 'markersize': 2.6, 'markeredgewidth': 0.0, 'linestyle': 'none'}
STRAIGHT = 'straight'  # a track along y = 0
TRACK_STEP = 5.0  # m
APART = 4.0  # lengths of a car between two middles: they do not lie together
CELLS = 700  # of the force map along time: what a page can show
# From draft to buff; buff ends darker, so that the two can be told apart in grey as well.
DIVERGING = LinearSegmentedColormap.from_list(
    'force', ['#C14A00', '#F2A25C', '#FFFFFF', '#5BA3D0', '#00263F']
)


def _corners(states, lengths, widths, time):
    """Cars as polygons in ft."""
    c, s = np.cos(states.theta_rad[time]), np.sin(states.theta_rad[time])
    along, across = 0.5 * lengths[:, None] * [1, 1, -1, -1], 0.5 * widths[:, None] * [1, -1, -1, 1]
    x = states.x_m[time][:, None] + c[:, None] * along - s[:, None] * across
    y = states.y_m[time][:, None] + s[:, None] * along + c[:, None] * across
    return np.stack([x, y], axis=2) / FOOT


def _window(corners, margin):
    """Limits of x and y around some cars, and the height in inches that shows them to scale."""
    x0, y0 = corners.reshape(-1, 2).min(axis=0)
    x1, y1 = corners.reshape(-1, 2).max(axis=0)
    x0, x1 = x0 - margin, x1 + margin
    feet_per_inch = (x1 - x0) / DRAWN_LENGTH
    height = max((y1 - y0) / feet_per_inch + ROOM_FOR_NUMBERS, LEAST_HEIGHT)
    reach = 0.5 * height * feet_per_inch
    middle = 0.5 * (y0 + y1)
    return (x0, x1), (middle - reach, middle + reach), height


def track_under(states, tree):
    """The centre line of the scenario's track below the whole train, in ft."""
    if not (tree.get('track') or {}).get('curves'):
        return STRAIGHT
    reach = np.hypot(states.x_m, states.y_m).max() * 1.3 + 100.0  # a curve is longer than the way across
    return run_data.centre_line(tree, np.arange(-reach, reach, TRACK_STEP)) / FOOT


def _postures(states):
    """(label, look, mask of cars) of the cars on their side and inverted at the last time, if there are any."""
    if states.tilt_rad is None:
        return []
    tilt = states.tilt_rad[-1]
    found = [
        ('car on its side', ON_SIDE, (tilt >= OVER) & (tilt <= TURNED_OVER)),
        ('car inverted', INVERTED, tilt > TURNED_OVER),
    ]
    return [entry for entry in found if entry[2].any()]


def _cars(ax, corners, off, postures, track):
    if track is STRAIGHT:
        ax.axhline(0.0, **TRACK)
    elif track is not None:
        ax.plot(*track.T, **TRACK, scalex=False, scaley=False)
    ax.axvline(0.0, color='black', linewidth=0.8, linestyle=style.DASHES[2], zorder=0.6)
    looks = [(~off, ON_TRACK), (off, OFF_TRACK)] + [(which, look) for _, look, which in postures]
    for which, look in looks:
        ax.add_collection(PolyCollection(list(corners[which]), **look))
    ax.set_aspect('equal')
    ax.grid(False)


def _numbers(ax, corners, shown):
    """Beside the cars, in a zigzag all rearwards: no two share a gap; every fifth if many."""
    count = len(shown)
    points_per_foot = 72.0 * DRAWN_LENGTH / np.ptp(ax.get_xlim())
    for k in shown if count <= 20 else [k for k in shown if k == shown[0] or k % 5 == 4]:
        across = (corners[k][0] - corners[k][1]) * points_per_foot
        if across[0] > 0.5 * across[1]:
            across = -across
        ax.annotate(
            str(k + 1),
            corners[k].mean(axis=0),
            xytext=across * (0.5 + 5.5 / np.hypot(*across)),
            textcoords='offset points',
            fontsize=7,
            ha='center',
            va='center',
            zorder=5,
        )


def _largest_group(corners, off, longest):
    """Numbers from 0 of the cars off the track that lie together, the most of them: one that has rolled away is not meant."""
    which = np.flatnonzero(off)
    middles = corners[which].mean(axis=1)
    groups = []
    left = set(range(len(which)))
    while left:
        group, todo = set(), [min(left)]
        while todo:
            k = todo.pop()
            if k not in left:
                continue
            left.remove(k)
            group.add(k)
            near = np.hypot(*(middles - middles[k]).T) < APART * longest
            todo += [int(i) for i in np.flatnonzero(near) if int(i) in left]
        groups.append(sorted(group))
    return which[max(groups, key=len)]


def layout(states, lengths, widths, track, note):
    """The train at its last time: all of it, and the cars off the track that lie together larger; both to scale. `track`: points of its
    centre line in ft, STRAIGHT, or None: not drawn."""
    corners = _corners(states, lengths, widths, -1)
    off = states.off_track[-1] > 0
    postures = _postures(states)
    margin = 0.3 * lengths.max() / FOOT
    windows = [_window(corners, margin)]
    shown = np.arange(states.cars)
    if off.any():
        together = _largest_group(corners, off, lengths.max() / FOOT)
        if len(together) < states.cars:
            windows.append(_window(corners[together], margin))
            (x0, x1), (y0, y1), _ = windows[-1]
            x, y = corners.mean(axis=1).T
            shown = np.flatnonzero((x > x0) & (x < x1) & (y > y0) & (y < y1))
    heights = [height for _, _, height in windows]
    figure = style.new_figure(style.TWO_COLUMNS, sum(heights) + 0.32 * len(windows) + 0.6)
    axes = figure.subplots(len(windows), 1, squeeze=False, gridspec_kw={'height_ratios': heights})
    for ax, (x, y, _) in zip(axes[:, 0], windows):
        _cars(ax, corners, off, postures, track)
        ax.set(xlim=x, ylim=y, ylabel='ft')
        ax.yaxis.set_major_locator(MaxNLocator(4, steps=[1, 2, 5, 10]))
    axes[-1, 0].set_xlabel('along the track, from the point of derailment (ft)')
    _numbers(axes[-1, 0], corners, shown)
    style.legend(
        figure,
        [
            Patch(label='other car off the track' if postures else 'car off the track', **OFF_TRACK),
            *(Patch(label=label, **look) for label, look, _ in postures),
            Patch(label='car on the track', **ON_TRACK),
            Line2D(
                [],
                [],
                color='black',
                linewidth=0.8,
                linestyle=style.DASHES[2],
                label='point of derailment',
            ),
        ],
        5 if postures else 3,
    )
    style.heading(
        figure,
        f'the train after {style.number(states.time[-1])} s, to scale',
        f'{off.sum()} of {states.cars} cars off the track{note}',
    )
    return figure


def _pooled(values):
    """At most CELLS rows: of each group of times the largest magnitude, so that no peak is lost."""
    step = -(-len(values) // CELLS)
    groups = [values[i:i + step] for i in range(0, len(values), step)]
    return (
        np.array(
            [np.take_along_axis(g, np.abs(g).argmax(axis=0)[None], axis=0)[0] for g in groups]
        ),
        step,
    )


def _first(flags, time):
    """Per car the time at which a flag is first set; NaN if never."""
    return np.where(flags.any(axis=0), time[flags.argmax(axis=0)], np.nan)


def _map(ax, states, force):
    pooled, step = _pooled(force)
    edges = np.append(states.time[::step], states.time[-1])
    peak = max(np.abs(force).max(), 1e-9)
    norm = FuncNorm(
        (lambda v: np.sign(v) * np.sqrt(np.abs(v)), lambda r: np.sign(r) * r * r),
        vmin=-peak,
        vmax=peak,
    )
    mesh = ax.pcolormesh(
        edges, np.arange(states.cars) + 0.5, pooled.T, cmap=DIVERGING, norm=norm, rasterized=True
    )
    number = np.arange(1, states.cars + 1)
    # Neighbours do not leave it in their order: a line would zigzag.
    ax.plot(_first(states.off_track > 0, states.time), number, **LEAVES)
    ax.plot(
        _first(states.past_pod > 0, states.time),
        number,
        color='black',
        linewidth=0.9,
        linestyle=style.DASHES[1],
    )
    ax.set(
        xlabel='time (s)',
        ylabel='coupler behind car',
        ylim=(states.cars - 0.5, 0.5),
        xlim=(edges[0], edges[-1]),
    )
    ax.yaxis.set_major_locator(MaxNLocator(integer=True))
    ax.grid(False)
    return mesh, peak


def _ticks(peak):
    """Zero, round numbers, and the peak; the scale of colours is that of a square root."""
    steps = [
        t for t in (1, 3, 10, 30, 100, 300, 1000, 3000, 10000) if 0.01 * peak < t < 0.75 * peak
    ] + [peak]
    return [-t for t in reversed(steps)] + [0.0] + steps


def peak_forces(states):
    """Largest buff and largest draft of every coupler in kip, magnitudes: of all steps, or of the output grid if the table does
    not know more."""
    axial = states.axial_force_N[:, :-1]
    buff, draft = np.maximum(axial, 0.0).max(axis=0), np.maximum(-axial, 0.0).max(axis=0)
    if states.buff_peak_N is not None:
        buff = np.maximum(buff, states.buff_peak_N[:, :-1].max(axis=0))
        draft = np.maximum(draft, states.draft_peak_N[:, :-1].max(axis=0))
    return buff / KIP, draft / KIP


def forces(states):
    """None where nothing can be drawn: a single car, a single time."""
    if states.cars < 2 or len(states.time) < 2:
        return None
    force = states.axial_force_N[:, :-1] / KIP
    figure = style.new_figure(style.TWO_COLUMNS, 3.6)
    ax, side = figure.subplots(1, 2, sharey=True, gridspec_kw={'width_ratios': [3.2, 1.0]})
    mesh, peak = _map(ax, states, force)
    bar = figure.colorbar(
        mesh,
        ax=ax,
        label='axial force (kip); buff +, draft \N{MINUS SIGN}',
        pad=0.02,
        aspect=30,
        ticks=_ticks(peak),
    )
    bar.ax.yaxis.set_major_formatter(style.signed)
    bar.ax.minorticks_off()
    number = np.arange(1, states.cars)
    peaks = peak_forces(states)
    for i, values in enumerate(peaks):
        side.plot(values, number, linestyle='none', markersize=3, **PEAKS[i])
    side.set_xlabel('peak (kip)')
    side.set_xlim(left=0.0)
    side.tick_params(labelleft=False)
    style.legend(
        figure,
        [
            Line2D([], [], label='car leaves the track', **LEAVES),
            Line2D(
                [],
                [],
                color='black',
                linewidth=0.9,
                linestyle=style.DASHES[1],
                label='car passes the point of derailment',
            ),
            Line2D([], [], linestyle='none', markersize=3, label='peak buff', **PEAKS[0]),
            Line2D([], [], linestyle='none', markersize=3, label='peak draft', **PEAKS[1]),
        ],
        4,
    )
    buff, draft = (style.number(values.max()) for values in peaks)
    grid = 'on the output grid ' if states.buff_peak_N is None else ''
    style.heading(
        figure,
        'coupler forces',
        f'{states.cars} cars; {grid}at most {buff} kip buff, {draft} kip draft',
    )
    return figure
