"""Tornado charts of the plan one_at_a_time: what the ends of each input's range do."""

from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from derail_plots import style
from derail_plots.one_at_a_time import base_spread, detail, lines

HIGH = {'facecolor': style.COLOURS[0], 'edgecolor': 'black', 'linewidth': 0.6}
LOW = {'facecolor': '#FBD9B5', 'edgecolor': 'black', 'linewidth': 0.6, 'hatch': '\\\\\\\\'}
HEIGHT = 0.36  # of a bar; an input has two
LABEL_WIDTH = 24


def _reach(line):
    """How far apart the outcomes of an input lie, for the order from top to bottom."""
    medians = [s.spread.median for s in line.known]
    return max(medians) - min(medians) if medians else 0.0


def _label(line):
    values = [line.factor.text(end.text) for end in line.ends if end]
    return (
        style.wrapped(line.factor.title, LABEL_WIDTH)
        + '\n'
        + style.wrapped(' | '.join(values), LABEL_WIDTH)
    )


def _bar(ax, end, y, start, look):
    if end is None:
        return
    s = end.spread
    ax.barh(y, s.median - start, HEIGHT, left=start, **look)
    ax.hlines(y, s.low, s.high, color='black', linewidth=0.9, zorder=4)
    ax.vlines([s.low, s.high], y - 0.1, y + 0.1, color='black', linewidth=0.9, zorder=4)


def tornado(study, outcome):
    """None if the base itself did not run."""
    base = base_spread(study, outcome)
    if not base.known:
        return None
    ordered = sorted(lines(study, outcome), key=_reach)  # the widest ends up on top
    labels = [_label(line) for line in ordered]
    rows = max([2] + [label.count('\n') + 1 for label in labels])
    figure, (ax,) = style.panels(1, 1, style.ONE_COLUMN, (0.15 + 0.15 * rows) * len(ordered) + 0.8)
    ax.axvspan(base.low, base.high, zorder=0.5, **style.BASE_BAND)
    for y, line in enumerate(ordered):
        low, high = line.ends
        _bar(ax, high, y + 0.5 * HEIGHT, base.median, HIGH)
        _bar(ax, low, y - 0.5 * HEIGHT, base.median, LOW)
    ax.axvline(base.median, color='black', linewidth=0.9)
    ax.set_yticks(range(len(ordered)), labels)
    ax.set_ylim(-0.6, len(ordered) - 0.4)
    ax.tick_params(axis='y', length=0)
    ax.grid(False, axis='y')
    ax.set_xlabel(outcome.label)
    if base.median != 0.0:
        _relative_axis(ax, base.median)
    style.legend(
        figure,
        [
            Patch(label='lowest input', **LOW),
            Patch(label='highest input', **HIGH),
            Line2D(
                [], [], color='black', marker='|', linewidth=0.9, label=study.ranges
            ),
            Patch(label=f'{base.words} at the base', **style.BASE_BAND),
        ],
        2,
    )
    style.heading(figure, outcome.title, detail(study, outcome))
    return figure


def _relative_axis(ax, base):
    top = ax.secondary_xaxis(
        'top', functions=(lambda v: 100.0 * (v / base - 1.0), lambda p: base * (1.0 + p / 100.0))
    )
    top.set_xlabel('change from the base (%)')
    top.xaxis.set_major_formatter(style.signed)
