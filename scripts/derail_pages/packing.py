"""A run as one text, for a page that replays it."""

import base64
import json
import struct
import zlib

import numpy as np


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
