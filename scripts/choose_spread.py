#!/usr/bin/python3
"""Chooses how wide the inputs of a validation are sampled, by cross-validation over the accidents.

  choose_spread.py TABLE --study STUDY --out DIR [--spread 1 1.4 2] [--derail PATH]

Runs `derail validate --spread S` for each candidate into DIR/spread_S (what is there already is not run again). Five folds, row i
of those from --min-speed on in fold i mod 5: on four folds the candidate whose coverage is nearest to the wanted share is taken, of
equal ones the smallest; on the fifth its coverage is counted. Prints a Markdown table, writes DIR/spread.json.
Exit codes: 0 done, 1 a run failed, 2 something is wrong with a file.
"""

import argparse
import csv
import json
import os
import subprocess
import sys

import numpy as np

FOLDS = 5
COLUMNS = ('line', 'speed_mph', 'cars_from_pod_to_rear', 'cars_derailed', 'predicted_median', 'predicted_low', 'predicted_high')


class WrongFile(Exception):
    """A file cannot be used; the text says which and why."""


def read_rows(folder):
    """{column: array} of rows.csv. Throws WrongFile."""
    path = os.path.join(folder, 'rows.csv')
    try:
        with open(path, encoding='utf-8', newline='') as file:
            rows = [[float(row[c]) for c in COLUMNS] for row in csv.DictReader(file)]
    except OSError as e:
        raise WrongFile(f'{path}: {e.strerror}; `derail validate` writes it') from None
    except (KeyError, TypeError, ValueError):
        raise WrongFile(f'{path}: not a table of `derail validate`, or a row without a prediction') from None
    if not rows:
        raise WrongFile(f'{path}: holds no rows')
    return dict(zip(COLUMNS, np.array(rows).T))


def inside(rows):
    return (rows['predicted_low'] <= rows['cars_derailed']) & (rows['cars_derailed'] <= rows['predicted_high'])


def nearest(hits, wanted):
    """The candidate whose share is nearest to `wanted`; of equal ones the first. `hits`: candidates x rows."""
    return int(np.argmin(np.round(np.abs(hits.mean(axis=1) - wanted), 12)))


def choose(hits, wanted):
    """(chosen from all rows, chosen without each fold, whether each row is held by the choice of the other folds)."""
    folds = np.arange(hits.shape[1]) % FOLDS
    chosen, held = [], np.zeros(hits.shape[1], bool)
    for fold in range(FOLDS):
        out = folds == fold
        chosen.append(nearest(hits[:, ~out], wanted))
        held[out] = hits[chosen[-1]][out]
    return nearest(hits, wanted), chosen, held


def summary(spreads, tables, min_speed, wanted):
    first = tables[0]
    for t in tables[1:]:
        if not np.array_equal(t['line'], first['line']):
            raise WrongFile('the folders hold different rows')
    fast = first['speed_mph'] >= min_speed
    if fast.sum() < 2 * FOLDS:
        raise WrongFile(f'{fast.sum()} rows from {min_speed:g} mph on are too few for {FOLDS} folds')
    best, chosen, held = choose(np.array([inside(t)[fast] for t in tables]), wanted)
    groups = {'all': np.ones(len(fast), bool), 'fast': fast, 'fast, tail of 60 or more': fast & (first['cars_from_pod_to_rear'] >= 60)}

    def of(t, rows):
        error = t['predicted_median'][rows] - t['cars_derailed'][rows]
        return {
            'rows': int(rows.sum()),
            'coverage': float(inside(t)[rows].mean()),
            'width': float((t['predicted_high'] - t['predicted_low'])[rows].mean()),
            'mean_absolute_error': float(np.abs(error).mean()),
            'bias': float(error.mean()),
        }

    return {
        'min_speed_mph': min_speed,
        'wanted': wanted,
        'candidates': [
            {'spread': s, **{name: of(t, rows) for name, rows in groups.items() if rows.any()}}
            for s, t in zip(spreads, tables)
        ],
        'chosen_without_fold': [spreads[c] for c in chosen],
        'held_out_coverage': float(held.mean()),
        'held_out_rows': len(held),
        'chosen': spreads[best],
    }


def markdown(s):
    lines = [
        f"| spread | rows from {s['min_speed_mph']:g} mph on: held | width | mean absolute error | bias | all rows: held |",
        '|---|---|---|---|---|---|',
    ]
    for c in s['candidates']:
        f = c['fast']
        lines.append(
            f"| {c['spread']:g} | {100 * f['coverage']:.0f} % | {f['width']:.1f} | {f['mean_absolute_error']:.2f} | "
            f"{f['bias']:+.2f} | {100 * c['all']['coverage']:.0f} % |"
        )
    lines += [
        '',
        f"Chosen without each fold in turn: {', '.join(f'{c:g}' for c in s['chosen_without_fold'])}; held in the folds left out: "
        f"{100 * s['held_out_coverage']:.0f} % of {s['held_out_rows']} rows. Chosen from all rows: {s['chosen']:g}.",
    ]
    return '\n'.join(lines)


def run(arguments, spread):
    folder = os.path.join(arguments.out, f'spread_{spread:g}')
    if not os.path.exists(os.path.join(folder, 'rows.csv')):
        command = [arguments.derail, 'validate', arguments.table, '--study', arguments.study, '--spread', f'{spread:g}']
        command += ['--out', folder, '--resume', '--quiet']
        if arguments.jobs:
            command += ['--jobs', str(arguments.jobs)]
        subprocess.run(command, check=True)
    return read_rows(folder)


def main(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('table', metavar='TABLE', help='accidents, as for derail validate')
    parser.add_argument('--study', required=True, help='as for derail validate')
    parser.add_argument('--out', required=True, metavar='DIR', help='folder of the results')
    parser.add_argument('--spread', nargs='+', type=float, default=[1.0, 1.4, 2.0], help='candidates')
    parser.add_argument('--wanted', type=float, default=0.9, help='share that intervals are to hold')
    parser.add_argument('--min-speed', type=float, default=10.0, metavar='MPH', help='rows that the choice is made on')
    parser.add_argument('--derail', default='derail', help='the program')
    parser.add_argument('--jobs', type=int, help='threads; default: one a core')
    a = parser.parse_args(arguments)
    spreads = sorted(a.spread)
    try:
        os.makedirs(a.out, exist_ok=True)
        found = summary(spreads, [run(a, s) for s in spreads], a.min_speed, a.wanted)
        with open(os.path.join(a.out, 'spread.json'), 'w', encoding='utf-8') as file:
            json.dump(found, file, indent=2)
            file.write('\n')
    except WrongFile as e:
        print(f'choose_spread.py: {e}', file=sys.stderr)
        return 2
    except subprocess.CalledProcessError as e:
        print(f'choose_spread.py: derail validate ended with {e.returncode}', file=sys.stderr)
        return 1
    except OSError as e:
        print(f'choose_spread.py: {e.filename}: {e.strerror}', file=sys.stderr)
        return 1
    print(markdown(found))
    return 0


if __name__ == '__main__':
    sys.exit(main())
