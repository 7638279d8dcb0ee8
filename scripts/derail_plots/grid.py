"""Plan grid: an outcome over the first input; a line a value of the second, a panel the others."""

from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from derail_plots import style


def _panels(study):
    """Values of the third and later inputs -> values of the second -> points."""
    split = {}
    for point, values in sorted(study.points.items()):
        _, *rest = (values[f.name] for f in study.factors)
        split.setdefault(tuple(rest[1:]), {}).setdefault(rest[0] if rest else '', []).append(point)
    return split


def _curve(ax, study, outcome, points, look):
    """Median and range of the runs over the first input."""
    first = study.factors[0]
    known = [(study.points[p][first.name], study.spread(p, outcome)) for p in points]
    known = [(x, s) for x, s in known if s.known]
    if first.numeric:
        known = sorted(((first.shown(x), s) for x, s in known), key=lambda item: item[0])
    xs = [x for x, _ in known]
    low, median, high = ([getattr(s, q) for _, s in known] for q in ('low', 'median', 'high'))
    if first.numeric:
        ax.fill_between(xs, low, high, color=look['color'], alpha=0.22, linewidth=0.0)
        for edge in (low, high):
            ax.plot(xs, edge, color=look['color'], linestyle=look['linestyle'], linewidth=0.6)
    else:
        ax.vlines(xs, low, high, color=look['color'])
        look = {**look, 'linestyle': 'none'}
    ax.plot(xs, median, **look)


def curves(study, outcome):
    first, *rest = study.factors
    split = _panels(study)
    columns = min(len(split), 3)
    width = style.ONE_COLUMN if columns == 1 else style.TWO_COLUMNS
    figure, axes = style.panels(
        len(split), columns, width, 2.4 if columns == 1 else 2.1, x=True, y=True
    )
    seconds = list(dict.fromkeys(second for panel in split.values() for second in panel))
    for ax, (others, panel) in zip(axes, split.items()):
        for second, points in panel.items():
            _curve(ax, study, outcome, points, style.series(seconds.index(second)))
        if others:
            ax.set_title(
                style.wrapped(
                    '; '.join(f'{f.title}: {f.text(v)}' for f, v in zip(rest[1:], others))
                )
            )
    for ax in style.lowest(axes, columns):
        ax.set_xlabel(first.label)
    handles = [
        Line2D(
            [],
            [],
            label=f'{rest[0].title}: {rest[0].text(second)}' if rest else 'median',
            **style.series(i),
        )
        for i, second in enumerate(seconds)
    ]
    colour = style.COLOURS[0] if len(seconds) == 1 else '0.5'
    handles.append(Patch(facecolor=colour, alpha=0.22, label=study.ranges))
    style.legend(figure, handles, 2 if columns == 1 else 4)
    style.side_label(figure, outcome.label)
    style.heading(figure, outcome.title, study.counted)
    return figure
