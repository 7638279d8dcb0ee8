#!/usr/bin/python3
"""Scores predictions of freight derailments: the simulation beside six statistical models, in sample and by five folds by year.

  derail validate TABLE.csv --study config/studies/freight.yaml --out DIR
  score_freight.py DIR [--no-in-sample] [--learn TABLE.csv CAUSES.yaml]

Of each: mean absolute error of the median, mean square error and R2 of the mean, continuous ranked probability score, share of the
counts that the 5 to 95 % interval holds, its width, histogram of the probability integral transform; for all rows and by kind of
train, cause and speed; share of events of two cars or fewer. Prints Markdown, writes DIR/freight.json and pictures in
DIR/pictures. Exit codes: 0 done, 1 a file could not be written, 2 something is wrong with DIR.
"""

import argparse
import json
import os
import sys

import numpy as np

sys.path.insert(
    0, os.path.dirname(os.path.realpath(__file__))
)  # a catkin devel space runs this file from elsewhere

from derail_freight import competitors, pictures  # noqa: E402
from derail_freight.scores import Rows, distribution, fair_crps  # noqa: E402
from derail_freight.table import members_by_row, read_members, read_table, with_reports  # noqa: E402
from derail_plots import style  # noqa: E402
from derail_plots.errors import DataError  # noqa: E402

SIMULATION = 'simulation'


def of_simulation(table, members):
    """Distributions of its members; its interval runs between two of them, as derail validate has it."""
    of_row = members_by_row(table, members)
    scores = [fair_crps(members.cars[m], np.ones(len(m)), members.way[m], y) for m, y in zip(of_row, table.real)]
    rows = Rows(table.real, [distribution(members.cars[m]) for m in of_row], scores)
    rows.low, rows.high = table['predicted_low'], table['predicted_high']
    return rows


def all_models(table, members, in_sample, both=None):
    """{(model, 'in sample' or 'by folds'): Rows}. `both`: the table and behind it rows that the models learn from."""
    found = {(SIMULATION, ''): of_simulation(table, members)}
    learned, count = (table, None) if both is None else (both, len(table))
    folds = learned.folds()
    for name, model in competitors.MODELS.items():
        if in_sample:
            found[name, 'in sample'] = Rows(table.real, competitors.in_sample(model, table))
        found[name, 'by folds'] = Rows(table.real, competitors.held_out(model, learned, folds, count))
    return found


def line(name, s):
    r2 = '-' if s['r2'] is None else f"{s['r2']:.2f}"
    return f"| {name} | {s['rows']} | {s['mae']:.2f} | {s['mse']:.1f} | {r2} | {s['crps']:.2f} | {100 * s['held']:.0f} % | {s['width']:.1f} |"


HEAD = ['| | rows | MAE | MSE | R2 | CRPS | held | width |', '|---|---|---|---|---|---|---|---|']


def few_table(table, models):
    """Lines on events of two cars or fewer, by cause and speed, where there are 30 rows."""
    lines = ['| cause, speed | rows | real | simulation | quantile forest by folds |', '|---|---|---|---|---|']
    for group in sorted(set(table.group)):
        for band, k in table.bands().items():
            k = k & (table.group == group)
            if k.sum() < 30:
                continue
            ours, theirs = models[SIMULATION, ''].scores(k), models['quantile forest', 'by folds'].scores(k)
            lines.append(f"| {group}, {band} | {k.sum()} | {100 * ours['few_real']:.0f} % | {100 * ours['few']:.0f} % | {100 * theirs['few']:.0f} % |")
    return lines


def markdown(table, models):
    lines = []
    for subset, k in table.subsets().items():
        lines += ['', f'**{subset}**', '', *HEAD]
        for (name, how), rows in models.items():
            if subset == 'all' or how != 'in sample':
                lines.append(line(f'{name}{", " if how else ""}{how}', rows.scores(k)))
    return '\n'.join(lines + ['', '**Two cars or fewer**', '', *few_table(table, models)]).lstrip('\n')


def main(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('folder', metavar='DIR', help='results of derail validate with a file of ways by cause')
    parser.add_argument('--no-in-sample', action='store_true', help='folds only: half the time')
    parser.add_argument('--learn', nargs=2, metavar=('TABLE', 'CAUSES'), help='table whose other years the models learn from, and its file of causes')
    a = parser.parse_args(arguments)
    out = os.path.join(a.folder, 'pictures')
    try:
        table = read_table(a.folder)
        members = read_members(a.folder, table)
        models = all_models(table, members, not a.no_in_sample, with_reports(table, *a.learn) if a.learn else None)
        scores = {
            subset: {f'{name} {how}'.strip(): rows.scores(k) for (name, how), rows in models.items()}
            for subset, k in table.subsets().items()
        }
        with open(os.path.join(a.folder, 'freight.json'), 'w', encoding='utf-8') as file:
            json.dump(scores, file, indent=1)
            file.write('\n')
        style.apply()
        for name, caption, figure in pictures.pictures(table, models):
            style.save(figure, out, name, caption)
    except DataError as e:
        print(f'score_freight.py: {e}', file=sys.stderr)
        return 2
    except OSError as e:
        print(f'score_freight.py: {e.filename or out}: {e.strerror}', file=sys.stderr)
        return 1
    print(markdown(table, models))
    return 0


if __name__ == '__main__':
    sys.exit(main())
