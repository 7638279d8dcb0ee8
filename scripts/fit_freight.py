#!/usr/bin/python3
"""Fits how derailments of each group of causes begin: the shares of the ways by speed, and narrower ranges of inputs.

  derail validate TABLE.csv --study WAYS.yaml --out DIR
  fit_freight.py DIR [--keys ties.drag obstacles.rate ...] [--write WAYS.yaml]

Members of DIR are weighted until the continuous ranked probability score of each group is least: from all rows, and from all
years but those of each of five folds, whose rows are then scored. So is the share of positions that count locomotives, for all
groups together. Prints Markdown, writes DIR/fit.json. --write puts the shares from all rows into the file of ways; ways that it
does not list, such as those of classes, take no part there. Narrower ranges are printed: put them into the studies of the ways by
hand, and run `derail validate` again. Exit codes: 0 done, 2 something is wrong with a file.
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

from derail_freight.fit import Ensemble, fit, fit_positions, narrower_ranges, position_weights  # noqa: E402
from derail_freight.scores import Rows, distribution  # noqa: E402
from derail_freight.table import FOLDS, read_members, read_table  # noqa: E402
from derail_plots.errors import DataError  # noqa: E402


def predictions(group, mix, parts, rows):
    """Distributions and scores of rows of the group."""
    weights = group.weights(mix, group.kept(parts))
    scores = group.crps(weights)
    found = []
    for i in rows:
        k = weights[i] > 0.0
        found.append((distribution(group.cars[i][k], weights[i][k]), scores[i]))
    return found


def describe(group, mix):
    return ', '.join(f'{w} {s:.3f}' + (f' v^{e:.2f}' if e else '') for w, s, e in zip(group.ways, mix.shares, mix.exponents))


def fit_all(table, members, keys):
    """Result of the fit, and the predictions of all rows: from all rows, and held out."""
    folds = table.folds()
    names = sorted(set(table.group))
    rows = [np.flatnonzero(table.group == name) for name in names]
    groups = [Ensemble(table, members, r) for r in rows]
    tried = narrower_ranges(members, keys)

    def fit_of(fold):
        """(share of positions, mixes, narrower ranges): the ways first, with the positions as they were simulated, then these, then the ways
        again."""
        wanted = [np.flatnonzero(folds[r] != fold) for r in rows]
        for g in groups:
            g.weigh(np.ones(len(members.row)))
        mixes, _, _ = fit(groups, wanted)
        share = fit_positions(groups, mixes, wanted, members)
        for g in groups:
            g.weigh(position_weights(members, share))
        mixes, parts, _ = fit(groups, wanted, tried)
        return share, mixes, parts

    def predict(mixes, parts, wanted, into):
        for g, m, r in zip(groups, mixes, rows):
            for i, d in zip(r[wanted[r]], predictions(g, m, parts, np.flatnonzero(wanted[r]))):
                into[i] = d

    fitted, unseen, without = [None] * len(table), [None] * len(table), {}
    for fold in sorted(set(folds)):
        without[fold] = _, mixes, parts = fit_of(fold)
        predict(mixes, parts, folds == fold, unseen)
    share, mixes, parts = fit_of(None)
    predict(mixes, parts, np.ones(len(table), bool), fitted)
    found = {
        name: {
            'rows': len(r),
            'ways': {w: {'share': float(s), 'speed_exponent': float(e)} for w, s, e in zip(g.ways, m.shares, m.exponents)},
            'text': describe(g, m),
            'without': {years_of(f): describe(g, of_all[i]) for f, (_, of_all, _) in without.items()},
        }
        for i, (name, g, m, r) in enumerate(zip(names, groups, mixes, rows))
    }
    ranges = {'all rows': parts, **{years_of(f): p for f, (_, _, p) in without.items()}}
    ranges = {name: [str(n) for n in p] for name, p in ranges.items()}
    positions = {'all rows': share, **{years_of(f): s for f, (s, _, _) in without.items()}}
    return found, ranges, positions, fitted, unseen


def years_of(fold):
    return 'without ' + ', '.join(str(year) for year in FOLDS[fold])


def write_shares(path, groups, positions):
    """Puts the shares into a file of ways, of those that it lists. Its lines `- {name: WAY, share: NUMBER, ...}` stay as they are
    otherwise."""
    with open(path, encoding='utf-8') as file:
        lines = file.read().split('\n')
    group, listed = None, {}
    for i, line in enumerate(lines):
        lines[i] = line = re.sub(r'^(positions_counting_locomotives: *)[0-9.]+', rf'\g<1>{positions:g}', line)
        of_group = re.match(r'  (\w+):', line)
        if of_group:
            group = of_group.group(1)
        way = re.search(r'name: ([^,}]+), share: [0-9.]+(, speed_exponent: [-0-9.]+)?', line)
        if way and group in groups:
            listed.setdefault(group, {})[way.group(1)] = (i, way.group(0))
    for group, places in listed.items():
        for way, (i, _) in places.items():
            if way not in groups[group]['ways']:
                raise DataError(f'{path}:{i + 1}: way {way} has no members in the folder')
        found = groups[group]['ways']
        shares = rounded({way: found[way]['share'] for way in places})
        for way, (i, old) in places.items():
            exponent = f"{found[way]['speed_exponent']:.2f}"
            power = f', speed_exponent: {exponent}' if float(exponent) else ''
            lines[i] = lines[i].replace(old, f'name: {way}, share: {shares[way]:.4f}{power}')
    with open(path, 'w', encoding='utf-8') as file:
        file.write('\n'.join(lines))


def rounded(shares):
    """In proportion to these, with four digits, adding up to 1."""
    total = sum(shares.values())
    shares = {way: round(share / total if total > 0.0 else 1.0 / len(shares), 4) for way, share in shares.items()}
    largest = max(shares, key=shares.get)
    shares[largest] = round(shares[largest] + 1.0 - sum(shares.values()), 4)
    return shares


def markdown(groups, ranges, positions, fitted, unseen):
    lines = ['Positions that count locomotives: ' + '; '.join(f'{name} {p:g}' for name, p in positions.items()), '']
    lines += [f"- {name}: {'; '.join(r) or 'all ranges as they are'}" for name, r in ranges.items()]
    lines += ['', '| group | rows | from all rows | without a fold |', '|---|---|---|---|']
    for name, g in groups.items():
        lines.append(f"| {name} | {g['rows']} | {g['text']} | {'<br>'.join(f'{k}: {v}' for k, v in g['without'].items())} |")
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
        scores = [Rows(table.real, *zip(*found)).scores() for found in (fitted, unseen)]
        with open(os.path.join(a.folder, 'fit.json'), 'w', encoding='utf-8') as file:
            json.dump({'groups': groups, 'ranges': ranges, 'positions': positions, 'fitted': scores[0], 'held_out': scores[1]}, file, indent=2)
            file.write('\n')
        if a.write:
            write_shares(a.write, groups, positions['all rows'])
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
