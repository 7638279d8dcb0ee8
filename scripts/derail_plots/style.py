"""One look for all pictures: sizes of a two-column page; markers and dashes beside colours."""

import math
import os
import textwrap

import matplotlib
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, MaxNLocator, NullFormatter

ONE_COLUMN = 3.5
TWO_COLUMNS = 7.2
HEADING_HEIGHT = 0.35
GREY = '0.35'
BASE_BAND = {'facecolor': 'none', 'edgecolor': '0.55', 'hatch': '/////', 'linewidth': 0.0}

# Okabe and Ito's palette, told apart by people who do not see all colours; dark ones first.
COLOURS = ('#0072B2', '#D55E00', '#000000', '#009E73', '#CC79A7', '#E69F00', '#56B4E9')
MARKERS = 'osD^vPX'
DASHES = (
    '-',
    (0, (5, 1.5)),
    (0, (1, 1)),
    (0, (5, 1.5, 1, 1.5)),
    (0, (3, 1)),
    (0, (7, 2)),
    (0, (4, 1, 1, 1, 1, 1)),
)

_RAISED = str.maketrans('-0123456789', '⁻⁰¹²³⁴⁵⁶⁷⁸⁹')
_SETTINGS = {
    'axes.axisbelow': True,
    'axes.grid': True,
    'axes.labelsize': 8,
    'axes.linewidth': 0.6,
    'axes.titlesize': 8,
    'figure.dpi': 100,
    'font.family': 'DejaVu Sans',
    'font.size': 8,
    'grid.color': '0.88',
    'grid.linewidth': 0.5,
    'hatch.linewidth': 0.5,
    'legend.fontsize': 8,
    'legend.frameon': False,
    'lines.linewidth': 1.2,
    'lines.markersize': 4,
    'savefig.dpi': 300,
    'svg.fonttype': 'path',
    'text.parse_math': False,  # a dollar sign in a user's title is a dollar sign
    'svg.hashsalt': 'train_derail',  # the same input gives the same bytes
    'xtick.labelsize': 8,
    'ytick.labelsize': 8,
}


def apply():
    """Forgets the user's own settings: pictures look alike everywhere."""
    matplotlib.rcdefaults()
    matplotlib.rcParams.update(_SETTINGS)


def series(i):
    """Keywords of line number `i`. Once all colours have been used, markers are hollow and go with other colours."""
    again = i // len(COLOURS)
    return {
        'color': COLOURS[i % len(COLOURS)],
        'marker': MARKERS[(i + again) % len(MARKERS)],
        'linestyle': DASHES[i % len(DASHES)],
        **({'markerfacecolor': 'white'} if again % 2 else {}),
    }


def new_figure(width, height):
    """Needs no display, and is forgotten with its last name."""
    figure = Figure(figsize=(width, height), layout='constrained')
    FigureCanvasAgg(figure)
    return figure


def panels(count, columns, width, row_height, **shared):
    """A figure of `count` panels in `columns`; `x=True`, `y=True`: they share that axis."""
    columns = min(columns, count)
    rows = -(-count // columns)
    figure = new_figure(width, row_height * rows + 0.4)
    grid = figure.add_gridspec(rows, columns)
    axes = []
    for i in range(count):
        links = {f'share{axis}': axes[0] for axis in 'xy' if shared.get(axis) and axes}
        axes.append(figure.add_subplot(grid[i // columns, i % columns], **links))
        axes[i].tick_params(
            labelleft=not shared.get('y') or i % columns == 0,
            labelbottom=not shared.get('x') or i + columns >= count,
        )
    return figure, axes


def lowest(axes, columns):
    """The panels that have none below them: where the label of a shared axis belongs."""
    return axes[-min(columns, len(axes)):]


def legend(figure, handles, columns):
    """A legend below the panels, in as many columns as have room; the figure grows by it."""
    width, height = figure.get_size_inches()
    for fewer in range(columns, 0, -1):
        box = figure.legend(
            handles=handles,
            loc='lower center',
            ncol=fewer,
            handlelength=2.6,
            columnspacing=1.2,
            handletextpad=0.5,
            borderaxespad=0.2,
        )
        extent = box.get_window_extent(figure.canvas.get_renderer())
        if extent.width <= figure.bbox.width or fewer == 1:
            break
        box.remove()
    added = extent.height / figure.dpi + 0.04
    figure.set_size_inches(width, height + added)
    figure.get_layout_engine().set(
        rect=(0.0, added / (height + added), 1.0, height / (height + added))
    )


def wrapped(text, width=38):
    """For titles of panels."""
    return textwrap.fill(text, width)


def side_label(figure, text):
    """One label for the vertical axes of all panels, broken to fit; to be set after the legend."""
    _, below, _, _ = figure.get_layout_engine().get()['rect']
    above = 1.0 - HEADING_HEIGHT / figure.get_figheight()
    room = (above - below) * figure.get_figheight()
    figure.supylabel(
        wrapped(text, int(15.0 * room)), y=0.5 * (above + below), fontsize=8, ma='center'
    )


def heading(figure, title, detail):
    """Title and, below it, what the picture is made of."""
    figure.suptitle(f'{title[:1].upper()}{title[1:]}\n{detail}', x=0.01, ha='left', fontsize=8.5)


def number(value):
    """Four digits are enough for people; a true minus sign."""
    return f'{value:.4g}'.replace('-', '\N{MINUS SIGN}')


def signed(value, _position=None):
    """Of changes: +20, 0, −50."""
    return '0' if abs(value) < 1e-9 else f'{value:+.4g}'.replace('-', '\N{MINUS SIGN}')


def plain_or_power(value, _position=None):
    """Of ticks between decades: 300, 2·10⁶."""
    power = math.floor(math.log10(value) + 1e-9)
    if -4 < power < 5:
        return number(value)
    mantissa = number(value / 10.0**power)
    return decade(value) if mantissa == '1' else f'{mantissa}·{decade(10.0**power)}'


def _between_decades(low, high):
    """Ticks of a logarithmic axis of less than three decades: as many as have room, two at least."""
    powers = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
    for steps in (range(1, 10), (1, 2, 3, 5), (1, 2, 5), (1, 3)):
        ticks = [s * 10.0**p for p in powers for s in steps if low <= s * 10.0**p <= high]
        if len(ticks) <= 5:
            break
    return ticks if len(ticks) > 1 else [t for t in MaxNLocator(4).tick_values(low, high) if low <= t <= high]


def decade(value, _position=None):
    """Of logarithmic axes: 10⁷."""
    return '10' + str(round(math.log10(value))).translate(_RAISED)


def logarithmic(ax):
    """The x axis, once all is drawn, without the mathematical typesetting that Matplotlib would use."""
    ax.set_xscale('log')
    low, high = ax.get_xlim()
    if high < 1000.0 * low:
        ax.xaxis.set_major_locator(FixedLocator(_between_decades(low, high)))
        ax.xaxis.set_major_formatter(plain_or_power)
    else:
        ax.xaxis.set_major_formatter(decade)
    ax.xaxis.set_minor_formatter(NullFormatter())


def _settle(figure):
    """Fixes the axes at rounded places: the last digits of the layout vary, and names in the SVG with them."""
    figure.canvas.draw()
    figure.set_layout_engine('none')
    for ax in figure.axes:
        ax.set_axes_locator(None)
        box = ax.get_position(original=True)
        ax.set_position([round(side, 5) for side in box.bounds])


def save(figure, folder, name, caption):
    """Writes NAME.svg and NAME.png; the caption travels in the files. Returns their paths."""
    _settle(figure)
    os.makedirs(folder, exist_ok=True)
    paths = [os.path.join(folder, f'{name}.{kind}') for kind in ('svg', 'png')]
    figure.savefig(paths[0], metadata={'Date': None, 'Creator': None, 'Title': caption})
    figure.savefig(paths[1], metadata={'Software': None, 'Title': caption})
    return paths
