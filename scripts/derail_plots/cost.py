"""What runs cost: over the length of the train, and while the run goes on."""

from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from derail_plots import style


def time(seconds, _position=None):
    """10 ms, 1.2 s"""
    return f'{seconds:.2g} s' if seconds >= 0.9995 else f'{1e3 * seconds:.3g} ms'


def _lines(ax, lines, x, y):
    for i, line in enumerate(lines):
        ax.plot(line[x], line[y], **style.series(i), label=line['name'])


def figure(measured):
    """`measured`: what scripts/measure_cost.py writes."""
    picture, (length, progress) = style.panels(2, 2, style.TWO_COLUMNS, 3.1)
    _lines(length, measured['lengths'], 'cars', 'seconds')
    length.set_xscale('log')
    length.set_yscale('log')
    length.set_xticks(measured['lengths'][0]['cars'])
    length.xaxis.set_major_formatter(FuncFormatter(lambda cars, _: f'{cars:g}'))
    length.xaxis.set_minor_formatter(NullFormatter())
    length.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    length.yaxis.set_major_formatter(time)
    length.yaxis.set_minor_formatter(NullFormatter())
    length.set_xlabel('cars in the train')
    length.set_title('Processor time of a whole run, to rest')
    _lines(progress, measured['progress'], 'until', 'seconds')
    progress.yaxis.set_major_formatter(time)
    progress.set_xlim(left=0.0)
    progress.set_ylim(0.0, 1.4 * max(max(line['seconds']) for line in measured['progress']))  # room for the legend
    progress.set_xlabel('simulated time, s')
    progress.set_title('Processor time so far')
    for ax in (length, progress):
        ax.legend(loc='upper left', handlelength=2.6)
    return picture
