#!/usr/bin/python3
"""What holds predictions of freight derailments back: members, statistics, or what the reports do not tell.

  derail validate TABLE.csv --study config/studies/freight.yaml --out DIR
  limits_freight.py DIR

Prints Markdown: scores of the simulation, of fewer of its members, of the best of statistics with and without it, and of both if
they were told the one thing that the reports leave open: whether one or two cars derail, or a pile-up follows. CRPS here is that of
the members as they are, without the correction for their number. Exit codes: 0 done, 2 something is wrong with DIR.
"""

import argparse
import os
import sys

import numpy as np

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))  # a catkin devel space runs this file from elsewhere

from derail_freight import limits  # noqa: E402
from derail_freight.scores import distribution  # noqa: E402
from derail_freight.table import members_by_row, read_members, read_table  # noqa: E402
from derail_plots.errors import DataError  # noqa: E402
from score_freight import HEAD, line  # noqa: E402


def markdown(table, distributions):
    lines = HEAD + [line(name, rows.scores()) for name, rows in limits.study(table, distributions).items()]
    shares = np.array([limits.small(d) for d in distributions])
    groups = limits.groups_of_cause_and_speed(table)
    beyond = limits.groups_beyond(groups, shares, table.real <= limits.FEW)
    by_chance, at_most = limits.groups_beyond_by_chance(groups, shares, np.random.default_rng(0))
    return '\n'.join([
        *lines,
        '',
        f'- R2 of the mean of members without end: at most {limits.r2_of_many(table.real, distributions):.2f}.',
        f'- MAE, were the counts drawn from the simulation: {np.mean([limits.own_error(d) for d in distributions]):.2f}.',
        f'- Groups of cause and speed with {limits.LEAST_ROWS} rows or more: {len(groups)}. Share of events with {limits.FEW} cars or fewer off by '
        f'more than {100 * limits.BOUND:.0f} points: {beyond}; were the counts drawn from the simulation, {by_chance:.1f} in the mean, more than '
        f'{at_most:.0f} in 5 % of the draws.',
    ])  # fmt: skip


def main(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('folder', metavar='DIR', help='results of derail validate with a file of ways by cause')
    a = parser.parse_args(arguments)
    try:
        table = read_table(a.folder)
        members = read_members(a.folder, table)
        print(markdown(table, [distribution(members.cars[m]) for m in members_by_row(table, members)]))
    except DataError as e:
        print(f'limits_freight.py: {e}', file=sys.stderr)
        return 2
    return 0


if __name__ == '__main__':
    sys.exit(main())
