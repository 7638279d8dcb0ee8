"""The picture of a track that was fitted to a line of points."""

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from derail_plots import style

POINT = {'linestyle': 'none', 'marker': '.', 'markersize': 3, 'color': style.COLOURS[1]}
TRACK = {'color': style.COLOURS[0]}


def _steps(pieces, scale):
    """Places and values of pieces, as a line of steps."""
    places, values = [], []
    for begin, end, value in pieces:
        places += [begin / 1000, end / 1000]
        values += [value * scale, value * scale]
    return places, values


def _km(values):
    return [v / 1000 for v in values]


def _mark_origin(axes):
    axes.axvline(0, color='black', linewidth=0.8, linestyle=(0, (3, 2)))


def draw(data, out):
    """Writes the picture as PNG; ``data`` is what the library's to_json of a fitted line gives."""
    style.apply()
    points, track = data['points'], data['track']
    heights = any(z is not None for z in points['z'])
    rows = 5 if heights else 3
    figure = Figure(figsize=(style.TWO_COLUMNS, 8.6 if heights else 6.6), layout='constrained')
    FigureCanvasAgg(figure)
    grid = figure.add_gridspec(rows, 1, height_ratios=[3.2, 1, 1] + [1, 1] * heights)
    plan = figure.add_subplot(grid[0])
    plan.plot(_km(track['x']), _km(track['y']), label='track', zorder=4, **TRACK)
    plan.plot(_km(points['x']), _km(points['y']), label='points of the line', zorder=3, **{**POINT, 'markersize': 7})
    plan.plot([0], [0], marker='X', markersize=9, color='black', linestyle='none', label='point of derailment', zorder=6)
    first = min(range(len(points['place'])), key=lambda i: abs(points['place'][i] + 0.5 * abs(points['place'][0])))
    after = min(first + max(1, len(points['x']) // 12), len(points['x']) - 1)
    plan.annotate('', (points['x'][after] / 1000, points['y'][after] / 1000), (points['x'][first] / 1000, points['y'][first] / 1000),
                  arrowprops={'arrowstyle': '-|>', 'color': 'black', 'linewidth': 2.5, 'mutation_scale': 22}, zorder=5)
    plan.set_aspect('equal', adjustable='datalim')
    plan.set_xlabel('east of the point of derailment [km]')
    plan.set_ylabel('north [km]')
    plan.legend(loc='best', frameon=True)
    plan.set_title(f"{data['source']}: points within {data['largest']:.2f} m of the track, rms {data['rms']:.2f} m; arrow: direction of travel")

    beside = figure.add_subplot(grid[1])
    beside.plot(_km(points['place']), points['offset'], **POINT)
    beside.axhline(0, **TRACK)
    beside.set_ylabel('points off\nthe track [m]')
    bend = figure.add_subplot(grid[2], sharex=beside)
    bend.plot(*_steps(data['curvature'], 1000), **TRACK)
    bend.set_ylabel('curvature [1/km]\nleft positive')
    lanes = [beside, bend]
    if heights:
        level = figure.add_subplot(grid[3], sharex=beside)
        known = [(p / 1000, z) for p, z in zip(points['place'], points['z']) if z is not None]
        level.plot([p for p, _ in known], [z for _, z in known], **POINT)
        level.plot(_km(track['place']), track['z'], **TRACK)
        level.set_ylabel('elevation [m]')
        slope = figure.add_subplot(grid[4], sharex=beside)
        slope.plot(*_steps(data['grade'], 100), **TRACK)
        slope.set_ylabel('grade [%]')
        lanes += [level, slope]
    for lane in lanes:
        _mark_origin(lane)
        lane.label_outer()
    lanes[-1].set_xlabel('along the track from the point of derailment [km]')
    figure.savefig(out, format='png', dpi=150)
