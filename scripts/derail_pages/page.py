"""Pages that need no other file and no network: templates of jinja2, filled with a document."""

import base64
import json
import math
import os
import re
import xml.etree.ElementTree

import jinja2
import markupsafe

TEMPLATES = os.path.join(os.path.dirname(os.path.realpath(__file__)), 'templates')
THREE = '/usr/share/javascript/three'
THREE_FILES = {'three.min.js': os.path.join(THREE, 'build'), 'OrbitControls.js': os.path.join(THREE, 'examples', 'js', 'controls')}
NEEDS = "pages that replay a run need three.js (Debian: libjs-three)"
_CONTROLS = re.compile('[\\x00-\\x08\\x0b-\\x1f\\x7f]')


def check(name):
    """Raises OSError or ImportError if something is missing that a template needs."""
    if name != 'replay':
        return
    from derail_pages import packing  # noqa: F401

    for file, folder in THREE_FILES.items():
        with open(os.path.join(folder, file), 'rb'):
            pass


def _raw(folder, name):
    with open(os.path.join(folder, name), encoding='utf-8') as file:
        text = file.read()
    # Inside of a script or style nothing has a meaning to HTML but its own end, and a comment, which hides that end. Upper and lower
    # case are the same.
    return markupsafe.Markup(re.sub('<(?=/(?:script|style)|!--)', r'<\\', text, flags=re.IGNORECASE))


def packed_run(run):
    from derail_pages import packing  # reports need no NumPy

    return packing.packed_run(run)


def outcome_rows(runs):
    """Rows of the outcomes of all runs side by side: each that any of them has, None where one lacks it."""
    rows = {}
    for i, run in enumerate(runs):
        for row in run['outcome']:
            entry = rows.setdefault(row['name'], {**row, 'cells': [None] * len(runs)})
            entry['cells'][i] = row
    return list(rows.values())


def axis(values, wanted=6, whole=False):
    """A scale that holds all values: its ends and its ticks, multiples of 1, 2 or 5 times a power of ten.

    `whole`: ticks are whole numbers, and the ends are those of the values.
    """
    values = [v for v in values if v is not None and math.isfinite(v)]
    low, high = min(values, default=0.0), max(values, default=1.0)
    if high == low:
        low, high = low - 0.5 * (abs(low) or 1.0), high + 0.5 * (abs(high) or 1.0)
    raw = max((high - low) / wanted, 1.0 if whole else 0.0)
    power = 10.0 ** math.floor(math.log10(raw))
    step = next(s * power for s in (1, 2, 5, 10) if s * power >= raw * (1 - 1e-9))
    first, last = math.floor(low / step + 1e-9), math.ceil(high / step - 1e-9)
    if whole:
        ticks = [float(k * step) for k in range(first, last + 1) if low <= k * step <= high]
        return {'low': low, 'high': high, 'ticks': ticks}
    return {'low': first * step, 'high': last * step, 'ticks': [float(f'{k * step:.12g}') for k in range(first, last + 1)]}


def percent(value, scale):
    """Where a value lies on an axis."""
    place = 100.0 * (value - scale['low']) / (scale['high'] - scale['low'])
    return f'{min(100.0, max(0.0, place)):.3f}%'


def number(value):
    """Of a tick, with a true minus sign."""
    return f'{value:.6g}'.replace('-', '\N{MINUS SIGN}')


def chart_axis(chart):
    """The axis of a chart of ranges or of a histogram, over all that is drawn."""
    values = [chart['reference']]
    for row in chart['rows']:
        values += [row['low'], row['high'], *(row.get('box') or []), row.get('dot')]
    return axis(values, whole=chart['whole'])


def width_in_letters(section):
    """How wide a table is at least, in letters of its font, with room between columns: on paper, nothing scrolls."""
    texts = [[column['title']] for column in section['columns']]
    for row in section['rows']:
        for column, cell in zip(texts, row):
            column.append(cell['text'])
    # A no-break space is part of a word.
    return sum(2 + max((len(word) for text in column for word in text.split(' ')), default=0) for column in texts)


def title_of(svg, otherwise):
    """The title that a picture in SVG carries."""
    try:
        found = xml.etree.ElementTree.fromstring(svg).find('{http://www.w3.org/2000/svg}title')
    except (xml.etree.ElementTree.ParseError, ValueError):
        return otherwise
    return otherwise if found is None or not found.text else found.text


def pictures(folder, outcomes):
    """The pictures in a folder by what they show: groups of a title and pictures, those of no outcome first.

    Of a picture that is there as SVG and PNG, the SVG.
    """
    found = {}
    for name in sorted(os.listdir(folder)) if os.path.isdir(folder) else []:
        stem, kind = os.path.splitext(name)
        if kind == '.svg' or (kind == '.png' and stem not in found):
            found[stem] = os.path.join(folder, name)
    groups = [{'title': '', 'pictures': []}] + [{'title': o['title'], 'pictures': []} for o in outcomes]
    for stem, path in found.items():
        with open(path, 'rb') as file:
            data = file.read()
        svg = path.endswith('.svg')
        kind = 'svg+xml' if svg else 'png'
        place = max((i for i, o in enumerate(outcomes) if stem.endswith('_' + o['name'])), default=-1,
                    key=lambda i: len(outcomes[i]['name'])) + 1
        groups[place]['pictures'].append({
            'caption': title_of(data, stem) if svg else stem,
            'data': f'data:image/{kind};base64,{base64.b64encode(data).decode()}',
        })
    return [g for g in groups if g['pictures']]


def plain(text):
    """Text without the characters that no text has: HTML cannot hold them."""
    return _CONTROLS.sub('\N{REPLACEMENT CHARACTER}', text)


def rendered(name, document):
    """The page that a template makes of a document."""
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(TEMPLATES),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=jinja2.StrictUndefined,
    )
    environment.globals['raw'] = lambda file: _raw(TEMPLATES, file)
    environment.globals['three'] = lambda file: _raw(THREE_FILES[file], file)
    environment.globals.update(axis=axis, chart_axis=chart_axis, pictures=pictures)
    environment.filters.update(packed_run=packed_run, outcome_rows=outcome_rows, percent=percent, number=number,
                               width_in_letters=width_in_letters)
    return plain(environment.get_template(name + '.html').render(json.loads(document)))
