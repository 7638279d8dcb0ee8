#!/usr/bin/python3
"""Draws a track that was fitted to a line of points: points against track, curvature and grade; derail import track
--plot calls it.

  plot_track.py < track.json > picture.png
  plot_track.py --check      says whether all that it needs is installed

Exit codes: 0 done, 1 something is missing.
"""

import json
import os
import sys

sys.path.insert(
    0, os.path.dirname(os.path.realpath(__file__))
)  # a build runs this file from elsewhere

try:
    from derail_plots import track_picture
except ImportError as e:
    print(f'plot_track.py: {e}: pictures need python3-matplotlib', file=sys.stderr)
    sys.exit(1)


def main(arguments):
    if arguments not in ([], ['--check']):
        print(__doc__, file=sys.stderr)
        return 1
    if not arguments:
        track_picture.draw(json.load(sys.stdin), sys.stdout.buffer)
    return 0


if __name__ == '__main__':
    sys.exit(main(sys.argv[1:]))
