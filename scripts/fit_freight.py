#!/usr/bin/python3
"""Fits how derailments of each group of causes begin: the shares of the ways, and narrower ranges of inputs.

  derail validate TABLE.csv --study WAYS.yaml --out DIR
  fit_freight.py DIR [--keys ties.drag obstacles.rate ...] [--write WAYS.yaml]

Members of DIR are weighted until the continuous ranked probability score of each group is least: from all rows, and from all
years but those of each of five folds, whose rows are then scored. So is the share of positions that count locomotives, for all
groups together. Prints Markdown, writes DIR/fit.json. --write puts the shares from all rows into the file of ways. Narrower ranges are printed: put them into the studies of the ways by hand, and run
`derail validate` again. Exit codes: 0 done, 2 something is wrong with a file.
"""

import argparse
import json
import os
import re
import sys

import numpy as np

sys.path.insert(
    0, os.path.dirname(os.path.realpath(__file__))
)  # a catkin devel space runs this file from elsewhere

from derail_freight.fit import Group, fit, fit_positions, narrower_ranges, position_weights  # noqa: E402
from derail_freight.scores import Rows, distribution  # noqa: E402
from derail_freight.table import read_members, read_table  # noqa: E402
from derail_plots.errors import DataError  # noqa: E402


def distributions(group, shares, parts, rows):
    """Of rows of the group."""
    weights = group.weights(shares, parts)
    cars, found = group.ensemble.cars, []
    for i in rows:
        k = weights[i] > 0.0
        found.append(distribution(cars[i][k], weights[i][k]))
    return found


def describe(group, shares):
    return ', '.join(f'{w} {s:.3f}' for w, s in zip(group.ensemble.ways, shares))


def fit_all(table, members, keys):
    """Result of the fit, and the distributions of all rows: from all rows, and held out."""
    folds = table.folds()
    every = np.arange(len(table))
    positions = {None: fit_positions(table, members, every)}
    for fold in sorted(set(folds)):
        positions[fold] = fit_positions(table, members, every[folds != fold])
    weights = {fold: position_weights(members, share) for fold, share in positions.items()}
    names = sorted(set(table.group))
    rows = [np.flatnonzero(table.group == name) for name in names]
    groups = [Group(table, members, r) for r in rows]
    tried = narrower_ranges(members, keys)

    def fit_of(fold):
        for g in groups:
            g.ensemble.weigh(weights[fold])
        return fit(groups, [np.flatnonzero(folds[r] != fold) for r in rows], tried)

    def predict(shares, parts, wanted, into):
        for g, s, r in zip(groups, shares, rows):
            for i, d in zip(r[wanted[r]], distributions(g, s, parts, np.flatnonzero(wanted[r]))):
                into[i] = d

    fitted, unseen, without = [None] * len(table), [None] * len(table), []
    for fold in sorted(set(folds)):
        shares, parts, _ = fit_of(fold)
        without.append((shares, parts))
        predict(shares, parts, folds == fold, unseen)
    shares, parts, _ = fit_of(None)
    predict(shares, parts, np.ones(len(table), bool), fitted)
    found = {
        name: {
            'rows': len(r),
            'ways': dict(zip(g.ensemble.ways, (float(x) for x in s))),
            'text': describe(g, s),
            'without_fold': [describe(g, of_all[i]) for of_all, _ in without],
        }
        for i, (name, g, s, r) in enumerate(zip(names, groups, shares, rows))
    }
    ranges = [[str(n) for n in p] for p in [parts, *(p for _, p in without)]]
    return found, ranges, [positions[f] for f in positions], fitted, unseen


def write_shares(path, groups, positions):
    """Puts the shares into a file of ways. Its lines `- {name: WAY, share: NUMBER, ...}` stay as they are otherwise."""
    with open(path, encoding='utf-8') as file:
        lines = file.read().split('\n')
    group = None
    for i, line in enumerate(lines):
        lines[i] = line = re.sub(r'^(positions_counting_locomotives: *)[0-9.]+', rf'\g<1>{positions:g}', line)
        of_group = re.match(r'  (\w+):', line)
        if of_group:
            group = of_group.group(1)
        way = re.search(r'name: ([^,}]+), share: [0-9.]+', line)
        if not way or group not in groups:
            continue
        share = groups[group]['ways'].get(way.group(1))
        if share is None:
            raise DataError(f'{path}:{i + 1}: way {way.group(1)} has no members in the folder')
        lines[i] = line.replace(way.group(0), f'name: {way.group(1)}, share: {share:.4f}')
    with open(path, 'w', encoding='utf-8') as file:
        file.write('\n'.join(lines))


def rounded(groups):
    """Shares with four digits that add up to 1."""
    for g in groups.values():
        shares = {w: round(s, 4) for w, s in g['ways'].items()}
        largest = max(shares, key=shares.get)
        shares[largest] = round(shares[largest] + 1.0 - sum(shares.values()), 4)
        g['ways'] = shares


def markdown(groups, ranges, positions, fitted, unseen):
    lines = [f'Positions that count locomotives: {positions[0]:g}; without each fold {", ".join(f"{p:g}" for p in positions[1:])}', '']
    lines += [f"- {'from all rows' if i == 0 else f'without fold {i}'}: {'; '.join(r) or 'all ranges as they are'}" for i, r in enumerate(ranges)]
    lines += ['', '| group | rows | from all rows | without each fold |', '|---|---|---|---|']
    for name, g in groups.items():
        lines.append(f"| {name} | {g['rows']} | {g['text']} | {'<br>'.join(g['without_fold'])} |")
    lines += ['', '| | MAE | CRPS | R2 | held | width |', '|---|---|---|---|---|---|']
    for name, s in (('fitted on all rows', fitted), ('held out by year', unseen)):
        lines.append(f"| {name} | {s['mae']:.2f} | {s['crps']:.2f} | {s['r2']:.2f} | {100 * s['held']:.0f} % | {s['width']:.1f} |")
    return '\n'.join(lines)


def main(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('folder', metavar='DIR', help='results of derail validate with a file of ways by cause')
    parser.add_argument('--keys', nargs='*', default=[], help='inputs of which narrower ranges are tried')
    parser.add_argument('--write', metavar='WAYS', help='file of ways that gets the shares')
    a = parser.parse_args(arguments)
    try:
        table = read_table(a.folder)
        members = read_members(a.folder, table)
        groups, ranges, positions, fitted, unseen = fit_all(table, members, a.keys)
        rounded(groups)
        scores = [Rows(table.real, d, draws=True).scores() for d in (fitted, unseen)]
        with open(os.path.join(a.folder, 'fit.json'), 'w', encoding='utf-8') as file:
            json.dump({'groups': groups, 'ranges': ranges, 'positions': positions, 'fitted': scores[0], 'held_out': scores[1]}, file, indent=2)
            file.write('\n')
        if a.write:
            write_shares(a.write, groups, positions[0])
    except DataError as e:
        print(f'fit_freight.py: {e}', file=sys.stderr)
        return 2
    except OSError as e:
        print(f'fit_freight.py: {e.filename}: {e.strerror}', file=sys.stderr)
        return 2
    print(markdown(groups, ranges, positions, *scores))
    return 0


if __name__ == '__main__':
    sys.exit(main())
