#!/usr/bin/python3
"""Compares studies with the numbers of Jeong, Lyons, Orringer and Perlman (2007); searches for what they leave unsaid.

  reproduction.py search DIR       runs the search into DIR and ranks its samples
  reproduction.py rank DIR         ranks the samples in DIR again
  reproduction.py candidates DIR   runs the candidates of search.yaml into DIR and compares their medians
  reproduction.py compare DIR      Markdown: that comparison alone
  reproduction.py table DIR ...    Markdown: the paper's statements, a column of ours for each folder of a study
  reproduction.py spread DIR       Markdown: how wide single runs are at the baseline
  reproduction.py sobol DIR        Markdown: the indices of config/studies/monte_carlo.yaml
  reproduction.py fill DIR         writes these tables anew into docs/reproduction.md; its folders lie in DIR

Reads config/reproduction/paper_numbers.yaml and search.yaml. Medians of ensembles are compared, never single runs.
Exit codes: 0 done, 1 a study failed, 2 something is wrong with a file.
"""

import argparse
import contextlib
import csv
import io
import json
import os
import re
import subprocess
import sys
import textwrap

import numpy as np
import yaml

ROOT = os.path.join(os.path.dirname(os.path.realpath(__file__)), os.pardir)
CONFIG = os.path.join(ROOT, 'config')
CLOSINGS = ('closing_speed_max', 'relative_speed_max', 'centre_speed_max')
FORCES = ('coupler_force_peak', 'coupler_buff_peak', 'coupler_draft_peak')
CLOSING = 'relative_speed_max'  # the reading that docs/reproduction.md settles for
FORCE = 'coupler_force_peak'
COUNT = 'cars_off_track'


class WrongFile(Exception):
    """Something is missing from a file; the text says which."""


class NotVaried(WrongFile):
    """The study does not vary an input that is asked for."""


def load(name):
    with open(os.path.join(CONFIG, 'reproduction', name), encoding='utf-8') as file:
        return yaml.safe_load(file)


class Results:
    """The runs of one study folder, in the units that people read."""

    def __init__(self, folder):
        self.folder = folder
        try:
            with open(os.path.join(folder, 'about.json'), encoding='utf-8') as file:
                self.columns = json.load(file)['columns']
            with open(os.path.join(folder, 'study.json'), encoding='utf-8') as file:
                study = json.load(file)
            with open(os.path.join(folder, 'runs.csv'), encoding='utf-8', newline='') as file:
                rows = list(csv.DictReader(file))
        except FileNotFoundError as e:
            raise WrongFile(f'{e.filename}: missing; `derail study` writes it') from None
        self.base = study['scenario']
        self.outcomes = study['outcomes']
        self.factors = [f['key'] for f in study['factors']]
        self.failed = sum(r['ended'] == 'integration_failed' for r in rows)
        self.rows = [r for r in rows if r['ended'] != 'integration_failed']

    def shown(self, name, text):
        return float(text) / float(self.columns[name]['per_shown'])

    def column(self, name, rows=None):
        return np.array([self.shown(name, r[name]) for r in (self.rows if rows is None else rows)])

    def base_value(self, key):
        return self.shown(key, self.base[key])

    def at(self, place):
        """Rows of the point [input, scale]; of the base for []."""
        key, scale = place or (None, None)
        if key is not None and key not in self.factors:
            raise NotVaried(f'{self.folder}: the study does not vary {key}')

        def wanted(row):
            for factor in self.factors:
                value = float(self.base[factor]) * (scale if factor == key else 1.0)
                if abs(float(row[factor]) - value) > 1e-9 * abs(value):
                    return False
            return True

        rows = [r for r in self.rows if wanted(r)]
        if not rows:
            raise WrongFile(f'{self.folder}/runs.csv: no run at {place or "the base"}')
        return rows

    def scales(self, key):
        """Scales of one input in rising order, without the base."""
        if key not in self.factors:
            raise NotVaried(f'{self.folder}: the study does not vary {key}')
        base = float(self.base[key])
        return sorted({round(float(r[key]) / base, 6) for r in self.rows} - {1.0})


def derail_study(arguments, study, out, changes, more=()):
    """Runs a study, or what is missing of it."""
    os.makedirs(os.path.dirname(out), exist_ok=True)
    command = [arguments.derail, 'study', os.path.join(CONFIG, 'studies', study), '--out', out, '--quiet']
    command += ['--jobs', str(arguments.jobs), *more]
    for change in changes:
        command += ['--set', change]
    if os.path.exists(os.path.join(out, 'study.json')):
        command.append('--resume')
    subprocess.run(command, check=True)


def misfit(count, closing, force):
    """Squared distance from the paper at 18.5, 37 and 55.5 mph (first axis), in units of the bands' half widths."""
    total = ((count.T - [6, 13, 24]) / [1.0, 1.0, 3.0]) ** 2
    total = total + ((closing.T - [13.3, 19.0, 30.0]) / [2.5, 2.5, 4.0]) ** 2
    ratio = np.log(force)
    total = total.sum(axis=-1) + ((ratio[1] - np.log(1821)) / np.log(1.25)) ** 2
    total = total + ((ratio[2] - ratio[1] - np.log(2.0)) / np.log(1.2)) ** 2
    return total + ((ratio[2] - ratio[0] - np.log(6.0)) / np.log(1.3)) ** 2


def search(arguments):
    plan = load('search.yaml')
    for reading, changes in plan['readings'].items():
        for speed in plan['speeds']:
            out = os.path.join(arguments.folders[0], reading, speed.replace(' ', '_'))
            derail_study(arguments, 'reproduction_search.yaml', out, [*changes, f'initial.speed={speed}'])
    rank(arguments)


def rank(arguments):
    plan = load('search.yaml')
    found = []
    for reading in plan['readings']:
        cases = [Results(os.path.join(arguments.folders[0], reading, s.replace(' ', '_'))) for s in plan['speeds']]
        by_point = [{r['point']: r for r in case.rows} for case in cases]
        common = sorted(set.intersection(*(set(p) for p in by_point)), key=int)
        samples = [[p[point] for point in common] for p in by_point]

        def columns(name, cases=cases, samples=samples):
            return np.array([case.column(name, rows) for case, rows in zip(cases, samples)])

        for closing in CLOSINGS:
            for force in FORCES:
                score = misfit(columns(COUNT), columns(closing), columns(force))
                for i in np.argsort(score)[: arguments.best]:
                    row = samples[0][i]
                    inputs = {f: cases[0].shown(f, row[f]) for f in cases[0].factors}
                    yields = [columns(q)[:, i] for q in (COUNT, closing, force)]
                    found.append((score[i], reading, closing, force, inputs, yields))
        print(f'{reading}: {len(common)} samples')
    found.sort(key=lambda f: f[0])
    print('misfit reading closing force | L D/L I/ML2 slack K_m m_max v_eps threshold | count | closing | force')
    for score, reading, closing, force, inputs, (n, c, f) in found[: 3 * arguments.best]:
        print(
            f'{score:6.2f} {reading} {closing} {force} | '
            + ' '.join(f'{v:.4g}' for v in inputs.values())
            + f' | {n.round(0)} | {c.round(1)} | {f.round(0)}'
        )


def candidates(arguments):
    for candidate in load('search.yaml')['candidates']:
        out = os.path.join(arguments.folders[0], candidate['name'])
        derail_study(arguments, 'reproduction_cases.yaml', out, candidate['set'])
    compare(arguments)


def compare(arguments):
    tests = [n for n in load('paper_numbers.yaml')['numbers'] if n.get('test')]
    speeds = [['initial.speed', 0.5], [], ['initial.speed', 1.5]]
    frictions = [[f'ground.{where}_track_friction', scale] for where in ('on', 'off') for scale in (0.5, 1.5)]
    print(
        '| set | closing taken from | cars | closing, mph | peak force, kip '
        '| closing at on-track, off-track friction -50, +50 % | met | misfit |'
    )
    print('|---|---|---|---|---|---|---|---|')
    for candidate in load('search.yaml')['candidates']:
        results = Results(os.path.join(arguments.folders[0], candidate['name']))
        for closing in (c for c in CLOSINGS if c in results.outcomes):
            reading = {'count': COUNT, 'closing': closing, 'force': FORCE}
            met = sum(evaluate(results, n, reading).met for n in tests)

            def medians(name, places, results=results):
                return np.array([np.median(results.column(name, results.at(p))) for p in places])

            n, c, f = (medians(name, speeds) for name in (COUNT, closing, FORCE))
            changes = 100.0 * (medians(closing, frictions) / c[1] - 1.0)
            cells = [' / '.join(number(v) for v in group) for group in (n, c, f, changes)]
            title = results.columns[closing]['title']
            score = number(float(misfit(n, c, f)))
            print(f"| {candidate['name']} | {title} | {' | '.join(cells)} % | {met} of {len(tests)} | {score} |")


class Verdict:
    """Ours beside the paper's: text, and is it met (None: not computed)."""

    def __init__(self, text, met):
        self.text, self.met = text, met


def number(value):
    """As people write it: whole cars and kips, tenths of small numbers."""
    return (f'{value:.0f}' if abs(value) >= 100 else f'{value:.3g}').replace('-', '\N{MINUS SIGN}')


def span(values, unit=''):
    low, middle, high = np.quantile(values, [0.05, 0.5, 0.95])
    return f'{number(middle)} ({number(low)} to {number(high)}) {unit}'.strip()


def within(value, band):
    return bool(band[0] <= value <= band[1])


def slope(results, key, quantity):
    """Least-squares change of a quantity over the whole range of one input, and its standard error."""
    scales = [1.0, *results.scales(key)]
    groups = [results.column(quantity, results.at([key, s] if s != 1.0 else [])) for s in scales]
    x = np.concatenate([np.full(len(g), s) for s, g in zip(scales, groups)])
    y = np.concatenate(groups)
    dx = x - x.mean()
    b = (dx * y).sum() / (dx**2).sum()
    rest = y - y.mean() - b * dx
    error = np.sqrt((rest**2).sum() / (len(y) - 2) / (dx**2).sum())
    reach = max(scales) - min(scales)
    return b * reach, error * reach, [np.median(g) for _, g in sorted(zip(scales, groups), key=lambda p: p[0])]


def ratios(a, b):
    """Of every run at one point to every run at another: what two single runs would have said."""
    return (a[:, None] / b[None, :]).ravel()


def evaluate(results, entry, reading):
    kind = entry['kind']
    if kind == 'none':
        return Verdict('not computed', None)
    quantity = reading[entry['quantity']]
    unit = load('paper_numbers.yaml')['units'][entry['quantity']]

    def values(place):
        return results.column(quantity, results.at(place))

    def median(place):
        return float(np.median(values(place)))

    def changes(key):
        return [100.0 * (median([key, s]) / median([]) - 1.0) for s in results.scales(key)]

    if kind == 'value':
        return Verdict(span(values(entry['of']), unit), within(median(entry['of']), entry['band']))
    if kind in ('ratio', 'change'):
        over = entry.get('over', [])
        ratio = median(entry['of']) / median(over)
        spread = np.quantile(ratios(values(entry['of']), values(over)), [0.05, 0.95])
        if kind == 'change':
            ratio, spread = 100.0 * (ratio - 1.0), 100.0 * (spread - 1.0)
        percent = ' %' if kind == 'change' else ''
        text = f'{number(ratio)} ({number(spread[0])} to {number(spread[1])}){percent}'
        return Verdict(text, within(ratio, entry['band']))
    if kind == 'most':
        most = max(changes(entry['inputs'][0]), key=abs)
        return Verdict(f'{number(most)} %', within(abs(most), entry['band']))
    if kind == 'first':
        reach = {key: np.ptp([0.0, *changes(key)]) for key in load('paper_numbers.yaml')['inputs']}
        first, second = sorted(reach, key=reach.get, reverse=True)[:2]
        text = f'{first}: {number(reach[first])} % from end to end; next {second}: {number(reach[second])} %'
        return Verdict(text, first == entry['inputs'][0])
    if kind in ('rising', 'falling'):
        change, error, medians = slope(results, entry['inputs'][0], quantity)
        sign = 1.0 if kind == 'rising' else -1.0
        text = f'{number(change)} \N{PLUS-MINUS SIGN} {number(2 * error)} {unit} over the range; medians ' + ' / '.join(
            number(m) for m in medians
        )
        return Verdict(text, bool(sign * change >= max(entry['least'], 2.0 * error)))
    if kind == 'half':
        share = results.column(quantity) / results.column('initial.speed')  # both in mph
        return Verdict(span(share), within(float(np.median(share)), entry['band']))
    if kind == 'pairs':
        sample = values([])
        share = agreeing(sample, entry['within'])
        low, high = np.quantile(ratios(sample, sample), [0.05, 0.95])
        return Verdict(
            f'{number(100 * share)} % of pairs agree so; ratio of two runs {number(low)} to {number(high)}',
            within(entry['paper'][1] / entry['paper'][0], [low, high]),
        )
    raise WrongFile(f"paper_numbers.yaml: kind {kind!r} of {entry['id']} is not known")


def verdict(results, entry, reading):
    """As evaluate; where the study leaves an input out, it says so."""
    try:
        return evaluate(results, entry, reading)
    except NotVaried:
        return Verdict('not run', None)


def agreeing(sample, tolerance):
    """Share of the pairs of different runs that agree within a relative tolerance."""
    a, b = sample[:, None], sample[None, :]
    close = np.abs(a - b) <= tolerance * np.minimum(a, b) + 1e-9
    n = len(sample)
    return (close.sum() - n) / (n * (n - 1))


WORDS = {True: 'met', False: '**missed**', None: 'not tested'}


def table(arguments):
    numbers = load('paper_numbers.yaml')
    reading = {'count': COUNT, 'closing': arguments.closing, 'force': FORCE}
    everything = [Results(f) for f in arguments.folders]
    names = [os.path.basename(os.path.normpath(f)) for f in arguments.folders]
    print('| | where | the paper says | band |\n|---|---|---|---|')
    for entry in numbers['numbers']:
        band = entry.get('band')
        limits = ''
        if band:
            limits = f'> {number(band[0])}' if np.isinf(band[1]) else f'{number(band[0])} to {number(band[1])}'
        bold = '**' if entry.get('test') else ''
        print(f"| {entry['id']} | {entry['where']} | {entry['text']} | {bold}{limits}{bold} |")
    print('\n| | ' + ' | | '.join(names) + ' | |')
    print('|---' * (1 + 2 * len(names)) + '|')
    met = [[] for _ in names]
    for entry in numbers['numbers']:
        verdicts = [verdict(r, entry, reading) for r in everything]
        print(f"| {entry['id']} | " + ' | '.join(f'{v.text} | {WORDS[v.met]}' for v in verdicts) + ' |')
        for list_, v in zip(met, verdicts):
            list_.append((bool(entry.get('test')), v.met))
    print()
    for entry in numbers['numbers']:
        if 'why' in entry:
            print(textwrap.fill(f"- {entry['id']}: {entry['why']}", 100, subsequent_indent='  ', break_on_hyphens=False))
    print()
    for name, results, list_ in zip(names, everything, met):
        tests = [m for test, m in list_ if test]
        known = [m for _, m in list_ if m is not None]
        runs = len(results.rows)
        print(
            f'- {name}: {sum(tests)} of {len(tests)} numbers of the agreed band (bold), '
            f'{sum(known)} of {len(known)} rows met;\n'
            f'  {runs} runs, {len(results.at([]))} at the baseline, {results.failed} failed.'
        )


def spread(arguments):
    results = Results(arguments.folders[0])
    print(
        '| at the baseline | median (5 to 95 %) | coefficient of variation '
        '| pairs of runs within 2 % | within 10 % |'
    )
    print('|---|---|---|---|---|')
    for name in results.outcomes:
        c, sample = results.columns[name], results.column(name, results.at([]))
        print(
            f"| {c['title']} | {span(sample, c['shown_unit'])} | {100 * sample.std(ddof=1) / sample.mean():.0f} % "
            f'| {100 * agreeing(sample, 0.02):.0f} % | {100 * agreeing(sample, 0.1):.0f} % |'
        )
    slow, fast = (results.column(FORCE, results.at(['initial.speed', s])) for s in (0.5, 1.5))
    print(f'\nPeak force at 55.5 mph over that at 18.5 mph, one run each: {span(ratios(fast, slow))}.')


def sobol(arguments):
    folder = arguments.folders[0]
    with open(os.path.join(folder, 'sobol.csv'), encoding='utf-8', newline='') as file:
        rows = list(csv.DictReader(file))
    results = Results(folder)
    outcomes = (COUNT, arguments.closing, FORCE)
    print('| input | ' + ' | '.join(f"{results.columns[o]['title']}: first | total" for o in outcomes) + ' |')
    print('|---' * (1 + 2 * len(outcomes)) + '|')
    for key in results.factors:
        cells = []
        for outcome in outcomes:
            row = next(r for r in rows if r['outcome'] == outcome and r['factor'] == key)
            for index in ('first', 'total'):
                value, low, high = (float(row[index + end]) for end in ('', '_low', '_high'))
                cells.append(f'{value:.2f} ({low:.2f} to {high:.2f})'.replace('-', '\N{MINUS SIGN}'))
        print(f"| {results.columns[key]['title']} | " + ' | '.join(cells) + ' |')


MARKED = re.compile(r'(<!-- begin: (.*?) -->\n).*?(<!-- end -->)', re.DOTALL)


def fill(arguments):
    """Every `<!-- begin: COMMAND FOLDER ... -->` of the page holds what that command prints."""
    path = os.path.join(ROOT, 'docs', 'reproduction.md')
    with open(path, encoding='utf-8') as file:
        page = file.read()

    def block(match):
        command, *words = match[2].split()
        inner = parser().parse_args([command, *words])
        inner.folders = [os.path.join(arguments.folders[0], f) for f in inner.folders]
        with contextlib.redirect_stdout(io.StringIO()) as said:
            COMMANDS[command](inner)
        return f'{match[1]}\n{said.getvalue()}\n{match[3]}'

    page = MARKED.sub(block, page)
    with open(path, 'w', encoding='utf-8') as file:
        file.write(page)


COMMANDS = {f.__name__: f for f in (search, rank, candidates, compare, table, spread, sobol, fill)}


def parser():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument('command', choices=COMMANDS)
    p.add_argument('folders', nargs='+', metavar='DIR')
    p.add_argument('--derail', default='derail', help='the program')
    p.add_argument('--jobs', default=1, type=int, help='its threads')
    p.add_argument('--best', default=5, type=int, help='samples to show a reading')
    p.add_argument('--closing', default=CLOSING, choices=CLOSINGS, help="what 'closing' means")
    return p


def main():
    arguments = parser().parse_args()
    try:
        COMMANDS[arguments.command](arguments)
    except WrongFile as e:
        print(f'reproduction.py: {e}', file=sys.stderr)
        return 2
    except subprocess.CalledProcessError as e:
        print(f'reproduction.py: {e}', file=sys.stderr)
        return 1
    return 0


if __name__ == '__main__':
    sys.exit(main())
