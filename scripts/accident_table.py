#!/usr/bin/python3
"""Runs the accidents of config/accidents and writes tables of docs: accidents, accident_model, spatial_model.

  accident_table.py run              Markdown: every accident of docs/data/accidents.csv against an ensemble
  accident_table.py posture          Markdown: those of them of which reports tell how the cars lay, in three dimensions
  accident_table.py study DIR ...    Markdown: medians of the studies in DIR (derail study), one row for each point
  accident_table.py compare DIR ...  Markdown: means of every outcome at every point, and how likely chance alone sets
                                     the point as far apart from the study's base (two-sample tests)

--fill PAGE writes what the command prints between `<!-- begin: COMMAND ... -->` and `<!-- end -->` of a page of docs.
Exit codes: 0 done, 1 a run failed, 2 something is wrong with a file.
"""

import argparse
import csv
import json
import os
import re
import subprocess
import sys

import numpy as np
import yaml
from scipy import stats

ROOT = os.path.join(os.path.dirname(os.path.realpath(__file__)), os.pardir)
ACCIDENTS = os.path.join(ROOT, 'config', 'accidents')
IN_SPACE = os.path.join(ROOT, 'config', 'variants')  # of accidents whose scenario is one of the plane: NAME_3d.yaml
FOOT = 0.3048


class WrongFile(Exception):
    """Something is missing from a file; the text says which."""


def band(values):
    low, middle, high = (f'{v:.0f}' if abs(v) >= 10 else f'{v:.2g}' for v in np.percentile(values, (5, 50, 95)))
    return f'{middle} ({low} to {high})'


def row(*cells):
    return '| ' + ' | '.join(str(c) for c in cells) + ' |'


def outcomes(arguments, path):
    """Outcomes of a scenario, one a seed."""
    command = [arguments.derail, 'run', path, '--quiet', '--json', '-']
    for change in arguments.set:
        command += ['--set', change]
    for seed in range(1, arguments.seeds + 1):
        done = subprocess.run(
            command + ['--set', f'initial.perturbation.seed={seed}'], capture_output=True, text=True, check=False
        )
        if done.returncode != 0:
            raise subprocess.CalledProcessError(done.returncode, ' '.join(command), stderr=done.stderr)
        yield json.loads(done.stdout)


def accidents_of(arguments):
    """Each with its scenario's path and content, the train and the speed in it."""
    with open(os.path.join(ROOT, 'docs', 'data', 'accidents.csv'), encoding='utf-8', newline='') as file:
        for a in csv.DictReader(file):
            if arguments.only and a['file'] not in arguments.only:
                continue
            path = os.path.join(ACCIDENTS, a['file'] + '.yaml')
            with open(path, encoding='utf-8') as scenario:
                yield a, path, yaml.safe_load(scenario)


def in_space(scenario):
    return scenario['base'] == '../accident3d.yaml'


def run(arguments):
    columns = ('accident', 'mph', 'vehicles from the first to derail', 'derailed', 'predicted: median (5 to 95 %)',
               'site, ft', 'predicted main pile, ft', 'cars across', 'remarks')
    lines = [row(*columns), row(*['---'] * len(columns))]
    errors, inside = [], 0
    for a, path, scenario in accidents_of(arguments):
        if in_space(scenario):
            continue
        behind = sum(b['count'] for b in scenario['consist']) - scenario['initial']['cars_ahead']
        runs = list(outcomes(arguments, path))
        counts, real = [o['cars_derailed'] for o in runs], int(a['derailed'])
        low, middle, high = np.percentile(counts, (5, 50, 95))
        errors.append(middle - real)
        inside += bool(low <= real <= high)
        lines.append(row(
            f'[{a["label"]}](../config/accidents/{a["file"]}.yaml)', scenario['initial']['speed'].split()[0], behind,
            real, band(counts), a['site_length_ft'] or '-', band([o['main_pile_length'] / FOOT for o in runs]),
            f'{np.median([o["cars_across"] for o in runs]):.0f}', a['comment']))
    errors = np.array(errors)
    sizes = np.abs(errors)
    lines += ['', f'{len(errors)} accidents, {arguments.seeds} runs each. Median less real count: mean '
              f'{errors.mean():+.1f}, mean of the magnitudes {sizes.mean():.1f}, largest '
              f'{errors[sizes.argmax()]:+.0f}. The real count lies within the 5 to 95 % of the seeds in {inside} of '
              f'{len(errors)}.']
    return '\n'.join(lines) + '\n'


def posture(arguments):
    columns = ('accident', 'mph', 'derailed', 'predicted', 'on their side or over', 'predicted', 'share', 'predicted')
    lines = [row(*columns), row(*['---'] * len(columns))]
    for a, path, scenario in accidents_of(arguments):
        if not a['over']:
            continue
        if not in_space(scenario):
            path = os.path.join(IN_SPACE, a['file'] + '_3d.yaml')
        runs = list(outcomes(arguments, path))
        derailed, over = ([o[q] for o in runs] for q in ('cars_derailed', 'cars_over'))
        lines.append(row(
            f'[{a["label"]}](../{os.path.relpath(path, ROOT)})', scenario['initial']['speed'].split()[0],
            a['derailed'], band(derailed), a['over'], band(over), f'{int(a["over"]) / int(a["derailed"]):.2f}',
            f'{sum(over) / sum(derailed):.2f}'))
    return '\n'.join([*lines, '', f'{arguments.seeds} runs each.']) + '\n'


class Study:
    """What `derail study` has left in a folder; runs that failed left out."""

    def __init__(self, folder):
        try:
            with open(os.path.join(folder, 'about.json'), encoding='utf-8') as file:
                self.columns = json.load(file)['columns']
            with open(os.path.join(folder, 'study.json'), encoding='utf-8') as file:
                about = json.load(file)
            with open(os.path.join(folder, 'runs.csv'), encoding='utf-8', newline='') as file:
                runs = [r for r in csv.DictReader(file) if r['ended'] != 'integration_failed']
        except FileNotFoundError as e:
            raise WrongFile(f'{e.filename}: missing; `derail study` writes it') from None
        self.title, self.outcomes, self.factors = about['title'], about['outcomes'], about['factors']
        self.replicates = about['replicates']
        points = {}
        for r in runs:
            points.setdefault(int(r['point']), []).append(r)
        self.points = [members for _, members in sorted(points.items())]

    def changed(self, members):
        base = self.points[0][0]
        return ', '.join(f'{f["label"]}: {written(members[0][f["key"]], self.columns[f["key"]])}' for f in self.factors
                         if members[0][f['key']] != base[f['key']]) or 'nothing'

    def values(self, members, outcome):
        """As people read them."""
        return np.array([float(m[outcome]) for m in members]) / float(self.columns[outcome]['per_shown'])

    def heading(self, outcome):
        return heading(outcome, self.columns[outcome]['shown_unit'])


def study(arguments):
    lines = []
    for found in map(Study, arguments.what):
        lines += [row('changed', *map(found.heading, found.outcomes)), row(*['---'] * (1 + len(found.outcomes)))]
        for members in found.points:
            lines.append(row(found.changed(members), *(band(found.values(members, q)) for q in found.outcomes)))
        lines += ['', f'{found.title}: {found.replicates} runs for each row.', '']
    return '\n'.join(lines[:-1]) + '\n'


def mean(values):
    return f'{values.mean():.3g}' if values.mean() < 1000 else f'{values.mean():.0f}'


def chances(base, other):
    """Of Kolmogorov-Smirnov's and of Mann-Whitney's test."""
    return stats.ks_2samp(base, other).pvalue, stats.mannwhitneyu(base, other).pvalue


def compare(arguments):
    lines = []
    for found in map(Study, arguments.what):
        base, *others = found.points
        if not others:
            raise WrongFile(f'{found.title}: one point only; nothing to compare')
        lines += [row('mean', 'base', *(f'{found.changed(o)} | p, distance | p, ranks' for o in others)),
                  row(*['---'] * (2 + 3 * len(others)))]
        for q in found.outcomes:
            cells = [mean(found.values(base, q))]
            for other in (found.values(o, q) for o in others):
                cells += [mean(other), *(f'{p:.2g}' for p in chances(found.values(base, q), other))]
            lines.append(row(found.heading(q), *cells))
        lines += ['', f'{found.title}: {found.replicates} runs each.', '']
    return '\n'.join(lines[:-1]) + '\n'


def heading(quantity, unit):
    words = quantity.replace('_', ' ')
    return f'{words}, {unit}' if unit and unit not in words.split() else words


def written(text, column):
    try:
        number = float(text.replace('.inf', 'inf')) / float(column['per_shown'])
    except ValueError:
        return text
    return 'none' if number == float('inf') else f'{number:.6g} {column["shown_unit"]}'.strip()


COMMANDS = {f.__name__: f for f in (run, posture, study, compare)}


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument('command', choices=COMMANDS)
    p.add_argument('what', nargs='*', metavar='FILE', help='a scenario, or folders of studies')
    p.add_argument('--derail', default='derail', help='the program')
    p.add_argument('--seeds', default=10, type=int, help='runs an accident')
    p.add_argument('--only', action='append', default=[], metavar='NAME', help='accident, by its file; may be repeated')
    p.add_argument('--set', action='append', default=[], metavar='KEY=VALUE', help='change of all; may be repeated')
    p.add_argument('--fill', metavar='PAGE', help='to write into; its mark has the command and the folders')
    arguments = p.parse_args()
    if (arguments.command in ('run', 'posture')) != (not arguments.what):
        p.error('run and posture take no files, the others need them')
    try:
        text = COMMANDS[arguments.command](arguments)
        if not arguments.fill:
            print(text, end='')
            return 0
        mark = ' '.join([arguments.command] + [os.path.basename(os.path.normpath(f)) for f in arguments.what])
        with open(arguments.fill, encoding='utf-8') as file:
            page = file.read()
        block = re.compile(rf'(<!-- begin: {re.escape(mark)} -->\n).*?(<!-- end -->)', re.S)
        page, found = block.subn(lambda m: f'{m[1]}\n{text}\n{m[2]}', page)
        if found != 1:
            raise WrongFile(f'{arguments.fill}: {found} times "<!-- begin: {mark} -->"')
        with open(arguments.fill, 'w', encoding='utf-8') as file:
            file.write(page)
    except (WrongFile, OSError) as e:
        print(f'accident_table.py: {e}', file=sys.stderr)
        return 2
    except subprocess.CalledProcessError as e:
        print(f'accident_table.py: {e}\n{e.stderr}', file=sys.stderr)
        return 1
    return 0


if __name__ == '__main__':
    sys.exit(main())
