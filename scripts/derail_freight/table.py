"""The table of accidents as `derail validate` leaves it, and folds by year."""

import csv
import os

import numpy as np
import yaml

from derail_plots.errors import DataError

# Of the table to 2014, near enough equal; a year belongs to one fold alone.
FOLDS = ((2002,), (2008,), (2009, 2010), (2011, 2012), (2013, 2014))

# What a statistical model may know: what is known when the train derails, its cause too. Not what derailed.
NUMBERS = (
    'speed_mph', 'n_cars', 'loaded', 'empty', 'trailing_tons', 'tons_per_car', 'head_end_locos', 'mid_locos', 'rear_locos',
    'first_car_position', 'cars_from_pod_to_rear', 'causing_car_position', 'hazmat_cars', 'class1', 'track_class',
)  # fmt: skip
NEEDED = ('date', 'speed_mph', 'n_cars', 'cars_from_pod_to_rear', 'tons_per_car', 'cars_derailed', 'cause', 'cause_group')


def number(text):
    """0 for a blank field or one that is no number, as an excepted track has."""
    try:
        return float(text)
    except ValueError:
        return 0.0


def folds_of(years, path, folds=FOLDS):
    """Number of the fold of each year. Throws DataError if a year has none; `path`: where they stand."""
    of = {year: i for i, of_fold in enumerate(folds) for year in of_fold}
    lacking = sorted(set(years) - set(of))
    if lacking:
        raise DataError(f'{path}: no fold has the year {lacking[0]}; folds: {folds}')
    return np.array([of[y] for y in years])


class Table:
    """Columns of rows.csv as arrays; rows in its order."""

    def __init__(self, rows, path='rows.csv'):
        if not rows:
            raise DataError(f'{path}: holds no rows')
        missing = [c for c in NEEDED if c not in rows[0]]
        if missing:
            raise DataError(f'{path}: column {missing[0]} is missing; derail validate writes it with a file of ways by cause')
        self.text = {c: [row[c] for row in rows] for c in rows[0]}
        self.path = path
        self.line = np.array([int(row['line']) for row in rows])
        self.real = self['cars_derailed']
        self.group = np.array(self.text['cause_group'])
        try:
            self.year = np.array([int(d[:4]) for d in self.text['date']])
        except ValueError:
            raise DataError(f'{path}: date: not every row begins with a year') from None

    def __len__(self):
        return len(self.line)

    def __getitem__(self, column):
        return np.array([number(t) for t in self.text[column]])

    def folds(self, folds=FOLDS):
        """Number of the fold of each row. Throws DataError if a year has none."""
        return folds_of(self.year, self.path, folds)

    def features(self):
        """Rows x features for statistical models."""
        columns = [self[c] for c in NUMBERS if c in self.text]
        columns += [(self.group == g).astype(float) for g in sorted(set(self.group))]
        letters = sorted({c[:1] for c in self.text['cause']})
        families = sorted({c[:2] for c in self.text['cause']})
        columns.append(np.array([letters.index(c[:1]) for c in self.text['cause']], float))
        columns.append(np.array([families.index(c[:2]) for c in self.text['cause']], float))
        return np.column_stack(columns)

    def kinds(self):
        """{name: which rows} of kinds of trains."""
        if 'loaded' not in self.text or 'empty' not in self.text:
            return {}
        loads, empties = self['loaded'], self['empty']
        unit = (empties == 0) & (self['tons_per_car'] >= 110)
        return {
            'loaded unit trains': unit,
            'empty trains': loads == 0,
            'all others': ~unit & (loads > 0),
        }

    def bands(self):
        """{name: which rows} of speeds."""
        v = self['speed_mph']
        return {
            'below 10 mph': v < 10,
            '10 to 25 mph': (v >= 10) & (v < 25),
            '25 to 40 mph': (v >= 25) & (v < 40),
            '40 mph and more': v >= 40,
        }

    def subsets(self):
        """{name: which rows} that scores are given for."""
        v = self['speed_mph']
        found = {'all': np.ones(len(self), bool), '10 mph and more': v >= 10, '25 mph and more': v >= 25}
        found.update(self.kinds())
        if 'loaded unit trains' in found:
            found['all but loaded unit trains'] = ~found['loaded unit trains']
        if 'class1' in self.text:
            found['Class I railroads'] = self['class1'] == 1
        found.update({f'cause: {g}': self.group == g for g in sorted(set(self.group))})
        found.update(self.bands())
        return {name: k for name, k in found.items() if k.any()}


def read_table(folder):
    """rows.csv of a folder of `derail validate`. Throws DataError."""
    path = os.path.join(folder, 'rows.csv')
    try:
        with open(path, encoding='utf-8', newline='') as file:
            return Table(list(csv.DictReader(file)), path)
    except OSError as e:
        raise DataError(f'{path}: {e.strerror}; `derail validate` writes it') from None


def group_of(code, groups):
    """Name of the group of a cause, as `derail validate` finds it: by code, else by heading, else the last."""
    for g in groups:
        if code in g.get('codes', ()):
            return g['name']
    for g in groups:
        if any(code.startswith(f) for f in g.get('families', ())):
            return g['name']
    return groups[-1]['name']


def with_reports(table, path, causes):
    """Rows of the table, and behind them all rows of the table of accidents that it was computed from, or of a longer one like that:
    with the package's names of columns, not an export of the form, of which `derail validate` leaves rows out.

    `causes`: the file of groups of causes. Throws DataError.
    """
    try:
        with open(path, encoding='utf-8', newline='') as file:
            reports = list(csv.DictReader(file))
        with open(causes, encoding='utf-8') as file:
            groups = yaml.safe_load(file)['groups']
    except OSError as e:
        raise DataError(f'{e.filename}: {e.strerror}') from None
    except (KeyError, TypeError, yaml.YAMLError):
        raise DataError(f'{causes}: not a file of groups of causes') from None
    columns = [c for c in table.text if reports and (c in reports[0] or c in ('line', 'cause_group'))]
    rows = [{c: table.text[c][i] for c in columns} for i in range(len(table))]
    for i, r in enumerate(reports):
        rows.append({**{c: r[c] for c in columns if c in r}, 'line': str(i + 2), 'cause_group': group_of(r.get('cause', ''), groups)})
    return Table(rows, path)


class Members:
    """Members of members.csv that did not fail: row of the table, way, cars derailed, sampled inputs."""

    def __init__(self, table, rows, path='members.csv'):
        place = {line: i for i, line in enumerate(table.line)}
        kept = [r for r in rows if int(r['line']) in place and r.get('ended', '') != 'integration_failed']
        if not kept or 'way' not in kept[0]:
            raise DataError(f'{path}: no members with a way; derail validate writes them with a file of ways by cause')
        self.row = np.array([place[int(r['line'])] for r in kept])
        self.way = np.array([r['way'] for r in kept])
        self.cars = np.array([float(r['derailed_without_locomotives']) for r in kept])
        place = table['first_car_position'] if 'first_car_position' in table.text else None
        if place is None or 'first_car_position' not in kept[0]:
            self.moved = np.zeros(len(kept), bool)
        else:
            self.moved = np.array([float(r['first_car_position']) for r in kept]) != place[self.row]
        self.rows = kept

    def input(self, key):
        """Values of a sampled input; NaN where the way does not vary it."""
        return np.array([float(r[key]) if r.get(key) else np.nan for r in self.rows])


def read_members(folder, table):
    """members.csv of a folder of `derail validate`. Throws DataError."""
    path = os.path.join(folder, 'members.csv')
    try:
        with open(path, encoding='utf-8', newline='') as file:
            return Members(table, list(csv.DictReader(file)), path)
    except OSError as e:
        raise DataError(f'{path}: {e.strerror}; `derail validate` writes it') from None
    except (KeyError, ValueError) as e:
        raise DataError(f'{path}: {e}: not a table of `derail validate`, or a number is missing') from None


def members_by_row(table, members):
    """Of each row of the table the numbers of its members. Throws DataError if a row has none."""
    of_row = [np.flatnonzero(members.row == i) for i in range(len(table))]
    if min(len(m) for m in of_row) == 0:
        raise DataError(f'{table.path}: a row has no members that did not fail')
    return of_row
