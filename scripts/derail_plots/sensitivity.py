"""Line charts of the plan one_at_a_time, as the paper's figures 5 to 7: change over change."""

from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from derail_plots import style
from derail_plots.one_at_a_time import Scale, base_spread, detail, lines, probability_of_alike

COLOUR = style.COLOURS[0]
WIDEST = 3.2  # points; ranges at the same change of several inputs lie in each other, the widest at the bottom


def _limits(some):
    """Ends of the axis on which these lines lie."""
    xs = [s.x for line in some for s in line.settings]
    return min(xs), max(max(xs), min(xs) + 1e-3)


def _x_axis(ax, line, limits):
    base = f'(base: {line.factor.text(line.base_text)})'.replace(' ', '\N{NO-BREAK SPACE}')
    ax.set_title(style.wrapped(f'{line.factor.title} {base}'))
    if line.kind == 'choice':
        ax.set_xticks([s.x for s in line.settings], [s.text for s in line.settings])
        ax.margins(x=0.15)
        return
    if line.kind == 'change':
        ax.xaxis.set_major_formatter(style.signed)
    if len(line.settings) <= 5:
        ax.set_xticks([s.x for s in line.settings])
    low, high = limits
    ax.set_xlim(low - 0.05 * (high - low), high + 0.05 * (high - low))


def _band(ax, line, scale):
    xs = [s.x for s in line.known]
    low, median, high = (
        [scale(getattr(s.spread, q)) for s in line.known] for q in ('low', 'median', 'high')
    )
    if line.kind == 'choice':
        ax.vlines(xs, low, high, color=COLOUR)
        ax.plot(xs, median, color=COLOUR, marker='o', linestyle='none')
        return
    ax.fill_between(xs, low, high, color=COLOUR, alpha=0.25, linewidth=0.0)
    for edge in (low, high):
        ax.plot(xs, edge, color=COLOUR, linewidth=0.5)
    ax.plot(xs, median, color=COLOUR, marker='o')


def _base_band(ax, base, scale):
    if base.known:
        ax.axhspan(scale(base.low), scale(base.high), zorder=0.5, **style.BASE_BAND)
        ax.axhline(scale(base.median), color=style.GREY, linewidth=0.6, zorder=0.6)


def bands(study, outcome):
    """One panel an input: median and range of the runs, and the base's own band for comparison."""
    all_lines = lines(study, outcome)
    base = base_spread(study, outcome)
    scale = Scale(outcome, base)
    alike = all(line.kind == 'change' for line in all_lines)
    figure, axes = style.panels(len(all_lines), 3, style.TWO_COLUMNS, 1.9, x=alike, y=True)
    for ax, line in zip(axes, all_lines):
        _base_band(ax, base, scale)
        _band(ax, line, scale)
        _x_axis(ax, line, _limits(all_lines if alike else [line]))
    for ax, line in list(zip(axes, all_lines))[-3 * alike:]:
        ax.set_xlabel(
            {'change': 'change of the input (%)', 'value': line.factor.label, 'choice': ''}[
                line.kind
            ]
        )
    if scale.relative:
        axes[0].yaxis.set_major_formatter(style.signed)
    style.legend(
        figure,
        [
            Line2D([], [], color=COLOUR, marker='o', label='median'),
            Patch(facecolor=COLOUR, alpha=0.25, label=study.ranges),
            Patch(label=f'{base.words} at the base', **style.BASE_BAND),
        ],
        3,
    )
    style.side_label(figure, scale.label)
    style.heading(figure, outcome.title, detail(study, outcome))
    return figure


def _changes(study, outcome):
    return [line for line in lines(study, outcome) if line.kind == 'change']


def _all_inputs(ax, study, outcome, scale):
    """Every input with a relative change, in one panel; handles for a legend."""
    changes = _changes(study, outcome)
    base = base_spread(study, outcome)
    _base_band(ax, base, scale)
    handles = []
    for i, line in enumerate(changes):
        look = style.series(i)
        width = WIDEST - (WIDEST - 0.8) * i / max(1, len(changes) - 1)
        for s in line.known:
            if s.text != line.base_text:
                ax.vlines(
                    s.x, scale(s.spread.low), scale(s.spread.high), color=look['color'], linewidth=width
                )
        ax.plot([s.x for s in line.known], [scale(s.spread.median) for s in line.known], **look)
        handles.append(Line2D([], [], label=line.factor.title, **look))
    if base.known:
        ax.plot(0.0, scale(base.median), 'o', color='black', markersize=5, zorder=5)
    ticks = sorted({round(s.x, 6) for line in changes for s in line.known})
    if len(ticks) <= 7:
        ax.set_xticks(ticks)
    ax.set_xlabel('change of the input (%)')
    ax.xaxis.set_major_formatter(style.signed)
    if scale.relative:
        ax.yaxis.set_major_formatter(style.signed)
    handles.append(
        Line2D(
            [],
            [],
            color='black',
            linewidth=0.8,
            marker='|',
            linestyle='none',
            markersize=9,
            label=study.ranges,
        )
    )
    handles.append(Patch(label=f'{base.words} at the base', **style.BASE_BAND))
    return handles


def overview(study, outcome):
    """All inputs in one panel; None if no input has a relative change."""
    if not _changes(study, outcome):
        return None
    scale = Scale(outcome, base_spread(study, outcome))
    figure, (ax,) = style.panels(1, 1, style.ONE_COLUMN, 2.9)
    handles = _all_inputs(ax, study, outcome, scale)
    ax.set_ylabel(style.wrapped(scale.label))
    style.legend(figure, handles, 2)
    style.heading(figure, outcome.title, detail(study, outcome))
    return figure


def beside(study, other, outcome):
    """The overviews of two studies of the same inputs, both as changes from the base of the first.

    So that the scatter of a base's few runs moves one point and not the whole panel. None if no input has a
    relative change.
    """
    if not _changes(study, outcome):
        return None
    scale = Scale(outcome, base_spread(study, outcome))
    figure, axes = style.panels(2, 2, style.TWO_COLUMNS, 3.2, x=True, y=True)
    for ax, one in zip(axes, (study, other)):
        handles = _all_inputs(ax, one, outcome, scale)
        ax.set_title(style.wrapped(one.title, 48) + '\n' + detail(one, outcome))
    axes[0].set_ylabel(style.wrapped(scale.label))
    style.legend(figure, handles, 4)
    p = probability_of_alike(study, other, outcome)
    style.heading(
        figure,
        outcome.title,
        'both as changes from the base on the left; alike at every point: '
        + ('no point in common' if p is None else f'p = {p:.2g} (rank test within points)'),
    )
    return figure
