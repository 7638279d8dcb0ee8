#!/usr/bin/python3
"""Fits when tank cars release (the law `release`): impacts of runs against the reports' cars with hazardous materials.

  fit_release.py TABLE.csv SCENARIO.yaml [--seeds 8] [--derail PATH]

Runs the scenario, a train of tank cars, at six speeds. Three numbers are fitted by the likelihood of how many of the damaged cars
of each report released: fittings, threshold_speed, side_speed; end_speed is twice side_speed. From all rows, and without each of
five folds by year, whose rows are then scored. Prints Markdown. Exit codes: 0 done, 2 something is wrong with a file.
"""

import argparse
import os
import sys

sys.path.insert(
    0, os.path.dirname(os.path.realpath(__file__))
)  # a catkin devel space runs this file from elsewhere

from derail_freight import release  # noqa: E402
from derail_freight.table import FOLDS  # noqa: E402
from derail_plots.errors import DataError  # noqa: E402


def text_of(law):
    fittings, threshold, side = law
    return f'| {fittings:.4f} | {threshold / release.MPH:.1f} | {side / release.MPH:.0f} | {release.END_TO_SIDE * side / release.MPH:.0f} |'


def markdown(tanks, reports, fitted):
    law, laws, unseen, constant = fitted
    lines = ['| | fittings | threshold_speed, mph | side_speed, mph | end_speed, mph |', '|---|---|---|---|---|', f'| all rows {text_of(law)}']
    lines += [f'| without {", ".join(map(str, FOLDS[fold]))} {text_of(one)}' for fold, one in laws.items()]
    lines += ['', f'Loss a car on rows not seen: {unseen:.4f}; of one share for all speeds: {constant:.4f}', '']
    lines += ['| speed, mph | reports: cars | share that released | law |', '|---|---|---|---|']
    lines += [f'| {band} | {n} | {real:.3f} | {p:.3f} |' for band, n, real, p in release.bands(tanks, law, reports)]
    return '\n'.join(lines)


def main(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('table', metavar='TABLE', help='table with the columns hazmat_damaged and hazmat_released')
    parser.add_argument('scenario', metavar='SCENARIO', help='a train of tank cars, such as config/accident.yaml')
    parser.add_argument('--seeds', type=int, default=8, help='runs at each speed')
    parser.add_argument('--derail', default='derail', help='the program')
    a = parser.parse_args(arguments)
    try:
        reports = release.Reports(a.table)
        tanks = release.simulate(a.derail, a.scenario, a.seeds)
    except DataError as e:
        print(f'fit_release.py: {e}', file=sys.stderr)
        return 2
    except OSError as e:
        print(f'fit_release.py: {e.filename}: {e.strerror}', file=sys.stderr)
        return 2
    print(markdown(tanks, reports, release.fit_all(tanks, reports)))
    return 0


if __name__ == '__main__':
    sys.exit(main())
