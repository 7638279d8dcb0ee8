"""Reads what `derail study` leaves in a folder; all numbers in the units that people read."""

import csv
import json
import math
import os
import zlib
from dataclasses import dataclass, field

import numpy as np

from derail_plots.errors import DataError
from derail_plots.style import number

FAILED = 'integration_failed'


@dataclass(frozen=True)
class Column:
    """A column of runs.csv: an input or an outcome."""

    name: str
    title: str
    unit: str
    shown_unit: str
    per_shown: float

    @property
    def numeric(self):
        return self.unit != ''

    @property
    def label(self):
        """For axes: 'train speed (mph)'."""
        return f'{self.title} ({self.shown_unit})' if self.shown_unit else self.title

    def shown(self, text):
        """An SI number as it stands in a file, in the shown unit."""
        return float(text) / self.per_shown

    def text(self, text):
        """A value for labels: '37 mph', 'isotropic'."""
        return f'{number(self.shown(text))} {self.shown_unit}'.strip() if self.numeric else text


@dataclass(frozen=True)
class Spread:
    """Of one outcome at one point, in the shown unit; NaN if no run was left."""

    runs: int
    low: float
    median: float
    high: float
    kind: str = ''  # what `low` and `high` are: '5 to 95 %', or of few runs 'lowest to highest'

    @property
    def words(self):
        """'lowest to highest of 7 runs'."""
        return f'{self.kind} of {self.runs} run{"" if self.runs == 1 else "s"}'

    @property
    def known(self):
        return math.isfinite(self.median)


@dataclass
class Study:
    """A finished study."""

    title: str
    plan: str
    replicates: int
    factors: list  # of Column
    outcomes: list  # of Column
    base: dict  # key -> SI text
    log_factors: set  # names of those that are sampled over a logarithm
    points: dict = field(default_factory=dict)  # point -> {factor name: SI text}
    spreads: dict = field(default_factory=dict)  # (point, outcome name) -> Spread
    sobol: list = field(default_factory=list)  # rows of sobol.csv as dicts
    runs: int = 0
    failed: int = 0
    samples: dict = field(default_factory=dict)  # column name -> array over runs that did not fail
    sample_points: list = field(default_factory=list)  # the point of each of them

    @property
    def counted(self):
        """What the pictures are made of."""
        text = f'{self.runs} runs'
        if self.plan in ('one_at_a_time', 'grid'):
            text += f', {self.replicates} a point'
        return text + (f', {self.failed} failed' if self.failed else '')

    @property
    def ranges(self):
        """What the ranges of all points are: 'lowest to highest of 7 runs', '5 to 95 % of 24 to 25 runs'."""
        kinds = {}
        for spread in self.spreads.values():
            if spread.known:
                kinds.setdefault(spread.kind, set()).add(spread.runs)
        counts = {kind: f'{min(runs)} to {max(runs)}' if len(runs) > 1 else f'{min(runs)}' for kind, runs in kinds.items()}
        return '; '.join(f'{kind} of {count} runs' for kind, count in counts.items())

    def spread(self, point, outcome):
        return self.spreads.get((point, outcome.name), Spread(0, math.nan, math.nan, math.nan))


def _open(folder, name, made_by):
    path = os.path.join(folder, name)
    try:
        return open(path, encoding='utf-8', newline='')
    except FileNotFoundError:
        raise DataError(f'{path}: missing; {made_by} writes it') from None
    except OSError as e:
        raise DataError(f'{path}: {e.strerror}') from None


def _json(folder, name, made_by):
    with _open(folder, name, made_by) as file:
        try:
            return json.load(file)
        except ValueError as e:
            raise DataError(f'{file.name}: not JSON: {e}') from None


def _rows(folder, name, wanted, made_by):
    """Rows of a table as dicts; `wanted` columns must be there."""
    with _open(folder, name, made_by) as file:
        reader = csv.DictReader(file)
        missing = [c for c in wanted if c not in (reader.fieldnames or [])]
        if missing:
            raise DataError(f'{file.name}: no column {missing[0]!r}')
        for row in reader:
            if None in row or None in row.values():
                raise DataError(f'{file.name}:{reader.line_num}: not as many fields as columns')
            yield row


def _unchanged(folder, about, name):
    """A table that was changed by hand is not drawn: about.json, which is written last, holds the CRC-32 of each."""
    with _open(folder, name, '`derail study`') as file:
        crc = 0
        while block := file.buffer.read(1 << 20):
            crc = zlib.crc32(block, crc)
    if about.get('crc32', {}).get(name) != f'{crc:08x}':
        raise DataError(
            f'{os.path.join(folder, name)}: not as it was written (its checksum in about.json differs); '
            '`derail study FILE --resume` writes it anew'
        )


def _columns(folder, about, names):
    path = os.path.join(folder, 'about.json')
    out = []
    for name in names:
        try:
            c = about['columns'][name]
            out.append(Column(name, c['title'], c['unit'], c['shown_unit'], float(c['per_shown'])))
        except KeyError as e:
            raise DataError(
                f'{path}: no {e} for {name}; written by an older version? '
                '`derail study FILE --resume` writes it anew'
            ) from None
    return out


def _read_runs(study, folder):
    names = [c.name for c in study.factors + study.outcomes]
    samples = {c.name: [] for c in study.factors + study.outcomes if c.numeric}
    for row in _rows(folder, 'runs.csv', ['point', 'ended', *names], '`derail study`'):
        study.runs += 1
        study.points.setdefault(int(row['point']), {c.name: row[c.name] for c in study.factors})
        if row['ended'] == FAILED:
            study.failed += 1
            continue
        study.sample_points.append(int(row['point']))
        for column in study.factors + study.outcomes:
            if column.numeric:
                samples[column.name].append(column.shown(row[column.name]))
    study.samples = {name: np.array(values) for name, values in samples.items()}


def _read_summary(study, folder):
    outcomes = {c.name: c for c in study.outcomes}
    for row in _rows(
        folder,
        'summary.csv',
        ['point', 'outcome', 'runs', 'low', 'median', 'high', 'range'],
        '`derail study`',
    ):
        column = outcomes.get(row['outcome'])
        if column:
            study.spreads[int(row['point']), column.name] = Spread(
                int(row['runs']), *(column.shown(row[q]) for q in ('low', 'median', 'high')), row['range']
            )


def read(folder):
    """The study in a folder. Throws DataError."""
    if not os.path.isdir(folder):
        raise DataError(f'{folder}: no such folder')
    raw = _json(folder, 'study.json', '`derail study`')
    about = _json(folder, 'about.json', '`derail study` (at its end) or `derail merge`')
    try:
        keys = [f['key'] for f in raw['factors']]
        study = Study(
            raw['title'],
            raw['plan'],
            raw['replicates'],
            _columns(folder, about, keys),
            _columns(folder, about, raw['outcomes']),
            raw['scenario'],
            {f['key'] for f in raw['factors'] if f.get('distribution') == 'log_uniform'},
        )
    except KeyError as e:
        raise DataError(f"{os.path.join(folder, 'study.json')}: no {e}") from None
    for name in ('runs.csv', 'summary.csv', *(['sobol.csv'] if study.plan == 'saltelli' else [])):
        _unchanged(folder, about, name)
    try:
        _read_runs(study, folder)
        _read_summary(study, folder)
    except ValueError as e:
        raise DataError(f'{folder}: a number cannot be read: {e}') from None
    if study.plan == 'saltelli':
        study.sobol = list(
            _rows(
                folder,
                'sobol.csv',
                ['outcome', 'factor', 'first', 'total', 'samples'],
                '`derail study`',
            )
        )
    if study.runs == study.failed:
        raise DataError(
            f"{os.path.join(folder, 'runs.csv')}: no run that did not fail, nothing to draw"
        )
    return study
