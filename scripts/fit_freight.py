#!/usr/bin/python3
"""Fits how derailments of each group of causes begin: the shares of the ways, and narrower ranges of inputs.

  derail validate TABLE.csv --study WAYS.yaml --out DIR
  fit_freight.py DIR [--keys ties.drag obstacles.rate ...] [--write WAYS.yaml]

Members of DIR are weighted until the continuous ranked probability score of each group is least: from all rows, and from all
years but those of each of five folds, whose rows are then scored. Prints Markdown, writes DIR/fit.json. --write puts the shares
from all rows into the file of ways. Narrower ranges are printed: put them into the studies of the ways by hand, and run
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

from derail_freight.fit import Group  # noqa: E402
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


def describe(group, shares, parts):
    text = ', '.join(f'{w} {s:.3f}' for w, s in zip(group.ensemble.ways, shares))
    return text + ''.join(f'; {k}: {p}' for k, p in sorted(parts.items()))


def fit_all(table, members, keys):
    """Result of the fit, and the distributions of all rows: from all rows, and held out."""
    folds = table.folds()
    found, fitted, unseen = {}, [None] * len(table), [None] * len(table)
    for name in sorted(set(table.group)):
        rows = np.flatnonzero(table.group == name)
        group = Group(table, members, rows, keys)
        every = np.arange(len(rows))
        shares, parts, score = group.fit(every)
        for i, d in zip(rows, distributions(group, shares, parts, every)):
            fitted[i] = d
        without = []
        for fold in sorted(set(folds)):
            here = np.flatnonzero(folds[rows] == fold)
            if not len(here):
                continue
            of_others = group.fit(np.flatnonzero(folds[rows] != fold))
            without.append(describe(group, *of_others[:2]))
            for i, d in zip(rows[here], distributions(group, *of_others[:2], here)):
                unseen[i] = d
        found[name] = {
            'rows': len(rows),
            'ways': dict(zip(group.ensemble.ways, (float(s) for s in shares))),
            'parts': parts,
            'crps': score,
            'text': describe(group, shares, parts),
            'without_fold': without,
        }
    return found, fitted, unseen


def write_shares(path, groups):
    """Puts the shares into a file of ways. Its lines `- {name: WAY, share: NUMBER, ...}` stay as they are otherwise."""
    with open(path, encoding='utf-8') as file:
        lines = file.read().split('\n')
    group = None
    for i, line in enumerate(lines):
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


def markdown(groups, fitted, unseen):
    lines = ['| group | rows | from all rows | without each fold |', '|---|---|---|---|']
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
        groups, fitted, unseen = fit_all(table, members, a.keys)
        rounded(groups)
        scores = [Rows(table.real, d, draws=True).scores() for d in (fitted, unseen)]
        with open(os.path.join(a.folder, 'fit.json'), 'w', encoding='utf-8') as file:
            json.dump({'groups': groups, 'fitted': scores[0], 'held_out': scores[1]}, file, indent=2)
            file.write('\n')
        if a.write:
            write_shares(a.write, groups)
    except DataError as e:
        print(f'fit_freight.py: {e}', file=sys.stderr)
        return 2
    except OSError as e:
        print(f'fit_freight.py: {e.filename}: {e.strerror}', file=sys.stderr)
        return 2
    print(markdown(groups, *scores))
    return 0


if __name__ == '__main__':
    sys.exit(main())
