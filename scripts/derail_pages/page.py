"""Pages that need no other file and no network: templates of jinja2, filled with a document."""

import base64
import json
import os
import re
import struct
import zlib

import jinja2
import markupsafe
import numpy as np

TEMPLATES = os.path.join(os.path.dirname(os.path.realpath(__file__)), 'templates')
THREE = '/usr/share/javascript/three'
THREE_FILES = {'three.min.js': os.path.join(THREE, 'build'), 'OrbitControls.js': os.path.join(THREE, 'examples', 'js', 'controls')}
NEEDS = "pages that replay a run need three.js (Debian: libjs-three)"


def check():
    """Raises OSError if something is missing."""
    for name, folder in THREE_FILES.items():
        with open(os.path.join(folder, name), 'rb'):
            pass


def _raw(folder, name):
    with open(os.path.join(folder, name), encoding='utf-8') as file:
        text = file.read()
    # Inside of a script or style nothing has a meaning to HTML but its own end, and a comment, which hides that end. Upper and lower
    # case are the same.
    return markupsafe.Markup(re.sub('<(?=/(?:script|style)|!--)', r'<\\', text, flags=re.IGNORECASE))


def packed_channels(channels, widths, moments):
    """Whole numbers as bytes: differences in time, sign in the lowest bit, then all lowest bytes, all second ones ...

    Numbers that change little become long rows of zeros, which deflate makes short.
    """
    parts = []
    for channel, width in zip(channels, widths):
        values = np.array(channel, dtype=np.int32).reshape(moments, width)
        steps = np.diff(values, axis=0, prepend=np.zeros((1, width), dtype=np.int32)).astype(np.int32)
        folded = ((steps << 1) ^ (steps >> 31)).astype('<u4')
        parts.append(folded.reshape(-1, 1).view(np.uint8).T.tobytes())
    return b''.join(parts)


def packed_run(run):
    """A run as one text: length of the description, description in JSON, numbers; deflated, in base64."""
    cars, couplers, heap = (len(run['fields'][name]) for name in ('cars', 'couplers', 'heap'))
    n = len(run['cars'])
    widths = [n] * cars + [n - 1] * couplers + [n, n] + [1] * heap
    numbers = packed_channels(run['channels'], widths, len(run['times']))
    description = {key: value for key, value in run.items() if key != 'channels'}
    head = json.dumps(description, separators=(',', ':')).encode()
    return base64.b64encode(zlib.compress(struct.pack('<I', len(head)) + head + numbers, 9)).decode()


def outcome_rows(runs):
    """Rows of the outcomes of all runs side by side: each that any of them has, None where one lacks it."""
    rows = {}
    for i, run in enumerate(runs):
        for row in run['outcome']:
            entry = rows.setdefault(row['name'], {**row, 'cells': [None] * len(runs)})
            entry['cells'][i] = row
    return list(rows.values())


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
    environment.filters['packed_run'] = packed_run
    environment.filters['outcome_rows'] = outcome_rows
    return environment.get_template(name + '.html').render(json.loads(document))
