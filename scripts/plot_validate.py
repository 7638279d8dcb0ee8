#!/usr/bin/python3
"""Draws what `derail validate` found; PNG and SVG in DIR/pictures, readable without colour.

  derail validate accidents.csv --study config/studies/accident_validation.yaml --out DIR
  rosrun train_derail plot_validate.py DIR

Exit codes: 0 done, 1 a picture could not be written, 2 something is wrong with DIR.
"""

import argparse
import os
import sys

sys.path.insert(
    0, os.path.dirname(os.path.realpath(__file__))
)  # a catkin devel space runs this file from elsewhere

from derail_plots import style, validation  # noqa: E402
from derail_plots.errors import DataError  # noqa: E402


def main(arguments=None):
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument('folder', metavar='DIR', help='results of derail validate')
    folder = parser.parse_args(arguments).folder
    out = os.path.join(folder, 'pictures')
    style.apply()
    try:
        count = sum(
            len(style.save(figure, out, name, caption))
            for name, caption, figure in validation.pictures(folder)
        )
    except DataError as e:
        print(f'plot_validate.py: {e}', file=sys.stderr)
        return 2
    except OSError as e:
        print(f'plot_validate.py: {e.filename or out}: {e.strerror}', file=sys.stderr)
        return 1
    print(f'{count} pictures in {out}')
    return 0


if __name__ == '__main__':
    sys.exit(main())
