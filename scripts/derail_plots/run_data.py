"""Reads what `derail run --csv` writes: states of all cars and couplers over time, SI."""

import gzip
import io
import shutil
import subprocess
from dataclasses import dataclass

import numpy as np
import yaml

from derail_plots.errors import DataError

FOOT = 0.3048  # m
KIP = 4448.2216152605  # N
ASIDE_OF_A_STRAIGHT = 1.0  # m: more than play and alignment
DRAWN_WIDTH = 10 * FOOT  # of cars whose width is not known
COLUMNS = (
    'time_s',
    'car',
    'x_m',
    'y_m',
    'theta_rad',
    'past_pod',
    'off_track',
    'gap_m',
    'axial_force_N',
)
PEAKS = ('buff_peak_N', 'draft_peak_N')
POSTURE = ('tilt_rad',)


@dataclass(frozen=True)
class States:
    """Arrays of times x cars; what belongs to the coupler behind a car is NaN at the last one."""

    time: np.ndarray
    x_m: np.ndarray
    y_m: np.ndarray
    theta_rad: np.ndarray
    past_pod: np.ndarray
    off_track: np.ndarray
    gap_m: np.ndarray
    axial_force_N: np.ndarray
    # Largest magnitudes since the time before; None in tables of a version that did not know them.
    buff_peak_N: np.ndarray = None
    draft_peak_N: np.ndarray = None
    # Angle of each car's vertical axis with the vertical; None if the table does not have it.
    tilt_rad: np.ndarray = None

    @property
    def cars(self):
        return self.x_m.shape[1]


def read_states(path):
    """Throws DataError."""
    try:
        opened = gzip.open if path.endswith('.gz') else open
        with opened(path, 'rt', encoding='utf-8') as file:
            header = file.readline().strip().split(',')
            text = file.read()
    except OSError as e:
        raise DataError(f'{path}: {e.strerror}') from None
    except (UnicodeDecodeError, EOFError):
        raise DataError(f'{path}: not a text file') from None
    missing = [c for c in COLUMNS if c not in header]
    if missing:
        raise DataError(f'{path}: no column {missing[0]}; not a table of `derail run --csv`')
    columns = COLUMNS
    for more in (PEAKS, POSTURE):
        columns += more if all(c in header for c in more) else ()
    for _ in range(2):  # every second of neighbouring empty fields is left over from the first pass
        text = text.replace(',,', ',nan,')
    try:
        table = np.loadtxt(
            io.StringIO(text.replace(',\n', ',nan\n')),
            delimiter=',',
            ndmin=2,
            usecols=[header.index(c) for c in columns],
        )
    except ValueError as e:
        raise DataError(f'{path}: {e}') from None
    return _shaped(path, columns, table)


def _shaped(path, names, table):
    cars = int(table[:, 1].max()) if table.size else 0
    if (
        cars < 1
        or len(table) % cars
        or np.any(table[:, 1].reshape(-1, cars) != np.arange(1, cars + 1))
    ):
        raise DataError(f'{path}: not every time has all cars; was it written whole?')
    columns = {name: table[:, i].reshape(-1, cars) for i, name in enumerate(names[2:], 2)}
    return States(table[::cars, 0], **columns)


def scenario_in_si(scenario, overrides, derail):
    """The scenario as `derail check` understands it, every default spelt out."""
    program = shutil.which(derail)
    if program is None:
        raise DataError(f'{derail}: no such program; --derail says where it is')
    command = [program, 'check', scenario]
    for override in overrides:
        command += ['--set', override]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise DataError(done.stderr.strip())
    return yaml.safe_load(done.stdout)


def sizes_from_scenario(scenario, tree, cars):
    """Lengths and widths of all cars; `tree` from scenario_in_si()."""
    blocks = [(int(b['count']), float(b['length']), float(b['width'])) for b in tree['consist']]
    if sum(count for count, _, _ in blocks) != cars:
        raise DataError(
            f'{scenario}: {sum(count for count, _, _ in blocks)} cars, but the states are of {cars}'
        )
    return tuple(np.concatenate([np.full(b[0], b[i]) for b in blocks]) for i in (1, 2))


def centre_line(tree, s):
    """The track at arc lengths s [m], one row (x, y) each: arcs of constant curvature, straight between them and beyond.
    x = y = 0 and along +x at s = 0."""
    curves = [
        (float(c['start']), float(c['length']), float(c['curvature']))
        for c in (tree.get('track') or {}).get('curves') or []
    ]
    ends = sorted({0.0, *(c[0] for c in curves), *(c[0] + c[1] for c in curves)})

    def curvature(at):
        return sum(c[2] for c in curves if c[0] <= at < c[0] + c[1])

    def along(point, heading, k, length):
        """The end of an arc, and the heading there."""
        turn = k * length
        # sin(turn / 2) / (turn / 2): a straight line is an arc too
        chord = length * np.sinc(turn / (2.0 * np.pi))
        middle = heading + 0.5 * turn
        return point + chord * np.array([np.cos(middle), np.sin(middle)]), heading + turn

    def walk(target):
        """From the origin, arc by arc, forwards or backwards."""
        at, point, heading = 0.0, np.zeros(2), 0.0
        while at != target:
            if target > at:
                to = min([e for e in ends if e > at] + [target], key=lambda e: min(e, target))
                to = min(to, target)
            else:
                to = max([e for e in ends if e < at] + [target], key=lambda e: max(e, target))
                to = max(to, target)
            point, heading = along(point, heading, curvature(0.5 * (at + to)), to - at)
            at = to
        return point

    return np.array([walk(float(target)) for target in s])


def is_straight(states):
    """Whether the cars that are still on the track have always stood on the line y = 0."""
    on = states.off_track == 0
    return bool(np.all(np.abs(states.y_m[on]) < ASIDE_OF_A_STRAIGHT))


def sizes_from_states(path, states):
    """The same without a scenario: the gaps of the first, stretched train tell the length."""
    if states.cars < 2:
        raise DataError(f'{path}: the length of a single car is not in it; give --scenario')
    apart = np.hypot(np.diff(states.x_m[0]), np.diff(states.y_m[0]))
    lengths = apart - states.gap_m[0, :-1]
    if np.ptp(lengths) > 0.01 * lengths.mean():
        raise DataError(f'{path}: the cars differ in length; give --scenario')
    return np.full(states.cars, lengths.mean()), np.full(states.cars, DRAWN_WIDTH)
