#!/usr/bin/python3
"""Chooses the ranges that the inputs of a validation are sampled from, by cross-validation over the accidents.

  choose_ranges.py TABLE --study STUDY [STUDY ...] --out DIR [--spread 1 1.4 2] [--derail PATH]

Every study with every spread is a candidate; its `derail validate` goes into DIR/STUDY_SPREAD (what is complete there is not run
again). Five folds, row i of those from --min-speed on in fold i mod 5: from four folds one candidate is chosen, on the fifth
its medians and intervals are scored. Chosen is the least CRPS among candidates whose intervals hold the wanted share within 0.03
(sharpness subject to calibration, Gneiting, Balabdaoui and Raftery 2007); if none does, the coverage nearest to it. Prints a Markdown table,
writes DIR/ranges.json. Exit codes: 0 done, 1 a run failed, 2 something is wrong with a file.
"""

import argparse
import json
import os
import subprocess
import sys

import numpy as np

sys.path.insert(
    0, os.path.dirname(os.path.realpath(__file__))
)  # a catkin devel space runs this file from elsewhere

from derail_plots.errors import DataError  # noqa: E402
from derail_plots.tables import table  # noqa: E402

FOLDS = 5
CALIBRATED = 0.03  # about one standard error of the share in 200 rows
LONG_TAIL = 60
COLUMNS = ('line', 'speed_mph', 'cars_from_pod_to_rear', 'cars_derailed', 'predicted_median', 'predicted_low', 'predicted_high', 'crps')


def read_rows(folder):
    """{column: array} of rows.csv. Throws DataError."""
    path = os.path.join(folder, 'rows.csv')
    with table(path, 'derail validate') as lines:
        rows = [[float(row[c]) for c in COLUMNS] for row in lines]
    if not rows:
        raise DataError(f'{path}: holds no rows')
    return dict(zip(COLUMNS, np.array(rows).T))


def inside(rows):
    return (rows['predicted_low'] <= rows['cars_derailed']) & (rows['cars_derailed'] <= rows['predicted_high'])


def best(hits, crps, wanted):
    """The candidate to take; of equal ones the first. `hits`, `crps`: candidates x rows."""
    off = np.abs(hits.mean(axis=1) - wanted)
    calibrated = off <= CALIBRATED + 1e-12
    return int(np.argmin(np.where(calibrated, crps.mean(axis=1), np.inf) if calibrated.any() else np.round(off, 12)))


def choose(hits, crps, wanted):
    """(chosen from all rows, chosen without each fold, for each row the choice that it had no say in)."""
    folds = np.arange(hits.shape[1]) % FOLDS
    chosen = [best(hits[:, folds != f], crps[:, folds != f], wanted) for f in range(FOLDS)]
    return best(hits, crps, wanted), chosen, np.array(chosen)[folds]


def scores(rows, some):
    """Of some of the rows."""
    r = {c: values[some] for c, values in rows.items()}
    error = r['predicted_median'] - r['cars_derailed']
    found = {
        'rows': len(error),
        'coverage': float(inside(r).mean()),
        'width': float((r['predicted_high'] - r['predicted_low']).mean()),
        'crps': float(r['crps'].mean()),
        'mean_absolute_error': float(np.abs(error).mean()),
        'bias': float(error.mean()),
    }
    countable = (r['predicted_median'] > 0) & (r['cars_derailed'] > 0)
    if np.unique(r['speed_mph'][countable]).size > 1:
        log = {c: np.log(r[c][countable]) for c in ('speed_mph', 'predicted_median')}
        found['speed_exponent'] = float(np.polyfit(log['speed_mph'], log['predicted_median'], 1)[0])
    return found


def summary(names, tables, min_speed, wanted):
    first = tables[0]
    for t in tables[1:]:
        if not np.array_equal(t['line'], first['line']):
            raise DataError('the folders hold different rows')
    fast = first['speed_mph'] >= min_speed
    if fast.sum() < 2 * FOLDS:
        raise DataError(f'{fast.sum()} rows from {min_speed:g} mph on are too few for {FOLDS} folds')
    long = fast & (first['cars_from_pod_to_rear'] >= LONG_TAIL)
    all_rows, chosen, unseen = choose(
        np.array([inside(t)[fast] for t in tables]), np.array([t['crps'][fast] for t in tables]), wanted
    )
    held_out = {c: np.array([t[c][fast] for t in tables])[unseen, np.arange(len(unseen))] for c in COLUMNS}

    def groups(rows, fast, long):
        return {name: scores(rows, some) for name, some in (('fast', fast), ('fast, long tail', long)) if some.any()}

    return {
        'min_speed_mph': min_speed,
        'long_tail': LONG_TAIL,
        'wanted': wanted,
        'candidates': [
            {'name': n, 'all': scores(t, np.ones(len(fast), bool)), **groups(t, fast, long)} for n, t in zip(names, tables)
        ],
        'chosen_without_fold': [names[c] for c in chosen],
        'held_out': groups(held_out, np.ones(fast.sum(), bool), long[fast]),
        'chosen': names[all_rows],
    }


def markdown(s):
    def cell(group, key, form='{:.2f}', times=1):
        return form.format(times * group[key]) if key in group else '-'

    def cells(f, t):
        error, share = 'mean_absolute_error', ('coverage', '{:.0f} %', 100)
        return ' | '.join((cell(f, error), cell(t, error), cell(f, *share), cell(t, *share), cell(f, 'width', '{:.1f}'),
                           cell(f, 'crps'), cell(f, 'bias', '{:+.2f}'), cell(t, 'speed_exponent')))

    lines = [
        f"From {s['min_speed_mph']:g} mph on; tails: {s['long_tail']} cars or more behind.",
        '',
        '| ranges | error | tails: error | held | tails: held | width | CRPS | bias | tails: exponent | all rows: held |',
        '|---|---|---|---|---|---|---|---|---|---|',
    ]
    for c in s['candidates']:
        lines.append(f"| {c['name']} | {cells(c['fast'], c.get('fast, long tail', {}))} | {100 * c['all']['coverage']:.0f} % |")
    h = s['held_out']
    lines += [
        f"| held out | {cells(h['fast'], h.get('fast, long tail', {}))} | |",
        '',
        f"Chosen without each fold in turn: {', '.join(s['chosen_without_fold'])}. Chosen from all rows: {s['chosen']}.",
    ]
    return '\n'.join(lines)


def name_of(study, spread):
    return f'{os.path.splitext(os.path.basename(study))[0]}_{spread:g}'


def run(arguments, study, spread):
    """Rows of a candidate."""
    folder = os.path.join(arguments.out, name_of(study, spread))
    if not os.path.exists(os.path.join(folder, 'rows.csv')):
        command = [arguments.derail, 'validate', arguments.table, '--study', study, '--spread', f'{spread:g}']
        command += ['--out', folder, '--resume', '--quiet']
        if arguments.jobs:
            command += ['--jobs', str(arguments.jobs)]
        subprocess.run(command, check=True)
    return read_rows(folder)


def main(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('table', metavar='TABLE', help='accidents, as for derail validate')
    parser.add_argument('--study', nargs='+', required=True, help='as for derail validate; several: each is tried')
    parser.add_argument('--out', required=True, metavar='DIR', help='folder of the results')
    parser.add_argument('--spread', nargs='+', type=float, default=[1.0, 1.4, 2.0], help='each is tried with each study')
    parser.add_argument('--wanted', type=float, default=0.9, help='share that intervals are to hold')
    parser.add_argument('--min-speed', type=float, default=10.0, metavar='MPH', help='rows that the choice is made on')
    parser.add_argument('--derail', default='derail', help='the program')
    parser.add_argument('--jobs', type=int, help='threads; default: one for each core')
    a = parser.parse_args(arguments)
    try:
        candidates = [(study, spread) for study in a.study for spread in sorted(a.spread)]
        names = [name_of(*c) for c in candidates]
        if len(set(names)) < len(names):
            raise DataError(f"{', '.join(a.study)}: two studies have the same file name")
        os.makedirs(a.out, exist_ok=True)
        found = summary(names, [run(a, *c) for c in candidates], a.min_speed, a.wanted)
        with open(os.path.join(a.out, 'ranges.json'), 'w', encoding='utf-8') as file:
            json.dump(found, file, indent=2)
            file.write('\n')
    except DataError as e:
        print(f'choose_ranges.py: {e}', file=sys.stderr)
        return 2
    except subprocess.CalledProcessError as e:
        print(f'choose_ranges.py: derail validate ended with {e.returncode}', file=sys.stderr)
        return 1
    except OSError as e:
        print(f'choose_ranges.py: {e.filename}: {e.strerror}', file=sys.stderr)
        return 1
    print(markdown(found))
    return 0


if __name__ == '__main__':
    sys.exit(main())
