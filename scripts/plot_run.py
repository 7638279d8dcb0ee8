#!/usr/bin/python3
"""Draws one run: the train's final layout to scale, coupler forces over car and time; PNG and SVG.

  derail run my_train.yaml --csv states.csv
  rosrun train_derail plot_run.py states.csv --scenario my_train.yaml

The states hold neither the size of the cars nor the track. Without --scenario their common length is
taken from the gaps of the first state, they are drawn 10 ft wide, and only a straight track is drawn.
Exit codes: 0 done, 1 a picture could not be written, 2 something is wrong with an input.
"""

import argparse
import os
import sys

sys.path.insert(
    0, os.path.dirname(os.path.realpath(__file__))
)  # a catkin devel space runs this file from elsewhere

from derail_plots import run_data, run_pictures, style  # noqa: E402
from derail_plots.errors import DataError  # noqa: E402


def default_derail():
    """The program beside this one, as it is installed; else of a workspace that is sourced; else the one in PATH."""
    folders = [os.path.dirname(os.path.abspath(sys.argv[0]))]
    folders += [os.path.join(prefix, 'lib', 'train_derail') for prefix in os.environ.get('CMAKE_PREFIX_PATH', '').split(':') if prefix]
    programs = [os.path.join(folder, 'derail') for folder in folders]
    return next((program for program in programs if os.access(program, os.X_OK)), 'derail')


def parsed(arguments):
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument('states', metavar='STATES.csv', help='from derail run --csv')
    parser.add_argument(
        '--out', metavar='DIR', help='folder of the pictures; default: that of STATES.csv'
    )
    parser.add_argument(
        '--scenario', metavar='FILE', help='scenario of the run, for the size of the cars and the curves of the track'
    )
    parser.add_argument(
        '--set',
        metavar='KEY=VALUE',
        action='append',
        default=[],
        help='as it was given to derail run',
    )
    parser.add_argument(
        '--derail', metavar='PROGRAM', default=default_derail(), help='reads the scenario'
    )
    return parser.parse_args(arguments)


def pictures(a):
    """(name, caption, figure) of every picture."""
    states = run_data.read_states(a.states)
    stem = os.path.splitext(os.path.basename(a.states))[0]
    if a.scenario:
        tree = run_data.scenario_in_si(a.scenario, a.set, a.derail)
        sizes, note = run_data.sizes_from_scenario(a.scenario, tree, states.cars), ''
        track = run_pictures.track_under(states, tree)
    else:
        sizes, note = run_data.sizes_from_states(a.states, states), '; width assumed'
        track = run_pictures.STRAIGHT
        if not run_data.is_straight(states):
            track, note = None, note + '; the track is curved: --scenario draws it'
    caption = f'The train after {states.time[-1]:.4g} s, to scale'
    yield f'{stem}_layout', caption, run_pictures.layout(states, *sizes, track, note)
    caption = 'Axial force of every coupler over time, and its peaks'
    yield f'{stem}_forces', caption, run_pictures.forces(states)


def main(arguments=None):
    a = parsed(arguments)
    out = a.out or os.path.dirname(a.states) or '.'
    style.apply()
    try:
        count = sum(
            len(style.save(figure, out, name, caption))
            for name, caption, figure in pictures(a)
            if figure
        )
    except DataError as e:
        print(f'plot_run.py: {e}', file=sys.stderr)
        return 2
    except OSError as e:
        print(f'plot_run.py: {e.filename or out}: {e.strerror}', file=sys.stderr)
        return 1
    print(f'{count} pictures in {out}')
    return 0


if __name__ == '__main__':
    sys.exit(main())
