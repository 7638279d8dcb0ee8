#!/usr/bin/python3
"""Times one train in derail's models, SciPy, the multibody engine and ODE, in turn, and prints a table.

  scripts/compare_cost.py config/baseline.yaml [--derail PATH] [--ode PATH] [--runs N] [--slow-runs N]

FILE is a scenario of the paper's model. What is computed differs: the last column says it.

derail, the engine and ODE are timed as whole processes, SciPy (solve_ivp, RK45, right-hand side in NumPy, restarted where a car
passes the point of derailment) inside this one. Medians of processor time, which others on the machine disturb least; each uses
one core. Needs python3-scipy. ODE: the program benchmark/ode_chain of a build with -DTRAIN_DERAIL_BENCHMARKS=ON, where
libode-dev is installed.
"""

import argparse
import json
import os
import resource
import statistics
import subprocess
import sys
import tempfile

import numpy as np
import yaml
from scipy.integrate import solve_ivp

CONFIG = os.path.join(os.path.dirname(os.path.realpath(__file__)), os.pardir, 'config')
ODE_STEP, ODE_ITERATIONS = 0.002, 20  # s, that of config/accident.yaml; ODE's own default


def expand(scenario):
    """Mass, inertia, half length, half truck spacing, weight: an array each, one entry a car."""
    rows = []
    for block in scenario['consist']:
        mass = block['weight'] / 9.80665
        inertia = block.get('yaw_inertia', block.get('yaw_inertia_factor', 0.093) * mass * block['length'] ** 2)
        spacing = block.get('truck_spacing', block.get('truck_spacing_factor', 0.71) * block['length'])
        rows += [(mass, inertia, 0.5 * block['length'], 0.5 * spacing, block['weight'])] * block['count']
    return np.array(rows).T


class Train:
    """Equations of motion (docs/model.md) for the on-track laws isotropic and along_track."""

    def __init__(self, scenario):
        self.mass, self.inertia, self.half, self.truck, self.weight = expand(scenario)
        self.coupler, self.ground = scenario['coupler'], scenario['ground']
        if self.ground['on_track_law'] == 'guided':
            raise Failed('ground.on_track_law guided is not supported')
        self.n = len(self.mass)
        self.past = np.zeros(self.n, bool)

    def initial(self, scenario):
        y = np.zeros((6, self.n))
        y[0, 1:] = -np.cumsum(self.half[:-1] + self.half[1:] + self.coupler['length'])
        y[3] = scenario['initial']['speed']
        y[5, 0] = scenario['initial']['yaw_rate']
        return y.ravel()

    def moment(self, c, s, ux, uy):
        k = self.coupler
        gamma = np.arctan2(c * uy - s * ux, c * ux + s * uy)
        excess = np.sign(gamma) * np.maximum(np.abs(gamma) - k['swing_limit'], 0.0)
        return np.clip(k['swing_stiffness'] * excess, -k['swing_moment_max'], k['swing_moment_max'])

    def rate(self, _, state):
        x, y, theta, vx, vy, omega = state.reshape(6, self.n)
        c, s = np.cos(theta), np.sin(theta)
        mu = np.where(self.past, self.ground['off_track_friction'], self.ground['on_track_friction'])
        load = 0.5 * mu * self.weight
        lateral = 1.0 if self.ground['on_track_law'] == 'isotropic' else self.past.astype(float)
        fx, fy, moment = np.zeros(self.n), np.zeros(self.n), np.zeros(self.n)
        for sign in (1.0, -1.0):
            u, v = vx - sign * self.truck * omega * s, lateral * (vy + sign * self.truck * omega * c)
            factor = -load / np.sqrt(u * u + v * v + self.ground['regularization_speed'] ** 2)
            fx += factor * u
            fy += factor * v
            moment += sign * self.truck * factor * (c * v - s * u)
        k = self.coupler
        a, b = slice(None, -1), slice(1, None)
        dx = x[a] - x[b] - self.half[a] * c[a] - self.half[b] * c[b]
        dy = y[a] - y[b] - self.half[a] * s[a] - self.half[b] * s[b]
        gap = np.hypot(dx, dy)
        ux, uy = dx / gap, dy / gap
        beyond = gap - k['length']
        axial = -k['stiffness'] * np.sign(beyond) * np.maximum(np.abs(beyond) - 0.5 * k['slack'], 0.0)
        lead, trail = self.moment(c[a], s[a], ux, uy), self.moment(c[b], s[b], ux, uy)
        side = (lead + trail) / gap
        px, py = axial * ux + side * uy, axial * uy - side * ux
        fx[a] += px
        fx[b] -= px
        fy[a] += py
        fy[b] -= py
        moment[a] += lead - self.half[a] * (c[a] * py - s[a] * px)
        moment[b] += trail - self.half[b] * (c[b] * py - s[b] * px)
        return np.concatenate((vx, vy, omega, fx / self.mass, fy / self.mass, moment / self.inertia))

    def foremost(self, _, state):
        """Zero where the next car reaches the point of derailment."""
        x = state[: self.n][~self.past]
        return x.max() if len(x) else -1.0


def by_scipy(scenario, end):
    """Evaluations of the right-hand side."""
    train = Train(scenario)
    t, y, evaluations = 0.0, train.initial(scenario), 0
    crossing = lambda t, y: train.foremost(t, y)  # noqa: E731
    crossing.terminal = True
    train.past[0] = True
    while t < end:
        run = solve_ivp(
            train.rate, (t, end), y, method='RK45', events=crossing,
            rtol=float(scenario['solver']['rtol']), atol=float(scenario['solver']['atol']),
        )
        if not run.success:
            raise Failed(f'SciPy: {run.message}')
        t, y, evaluations = run.t[-1], run.y[:, -1], evaluations + run.nfev
        if run.status == 1:
            x = np.where(train.past, -np.inf, y[: train.n])
            train.past[np.argmax(x)] = True
    return evaluations


class Failed(Exception):
    """A run did; the text says which and why."""


def spent_by_children():
    """Processor time of the processes that this one has waited for [s]."""
    use = resource.getrusage(resource.RUSAGE_CHILDREN)
    return use.ru_utime + use.ru_stime


def spent():
    """The same with that of this process."""
    use = resource.getrusage(resource.RUSAGE_SELF)
    return use.ru_utime + use.ru_stime + spent_by_children()


def timed(action, runs, of=statistics.median, spent=spent):
    """`of` the processor times of so many runs [s], and what the last returned."""
    seconds = []
    for _ in range(runs):
        start = spent()
        result = action()
        seconds.append(spent() - start)
    return of(seconds), result


def output(command, **more):
    """What a program prints."""
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, check=False, **more)
    if done.returncode != 0:
        said = done.stderr if isinstance(done.stderr, str) else done.stderr.decode()
        raise Failed(f'{" ".join(command)}: exit code {done.returncode}: {said.strip()}')
    return done.stdout


class Derail:
    """The program, on scenarios of FILE's train."""

    def __init__(self, program, scenario, folder):
        self.program, self.scenario, self.folder = program, scenario, folder

    def __call__(self, *arguments):
        return output([self.program, *arguments])

    def outcome(self, file):
        return json.loads(self('run', file, '--json', '-', '--quiet'))

    def written(self, name, tree):
        path = os.path.join(self.folder, name)
        with open(path, 'w', encoding='utf-8') as file:
            yaml.safe_dump(tree, file)
        return path

    def like(self, preset):
        """A scenario with the cars and the speed of FILE and all else of a preset."""
        return self.written(f'like_{preset}', {
            'base': os.path.realpath(os.path.join(CONFIG, preset)),
            'consist': self.scenario['consist'],
            'initial': {'speed': self.scenario['initial']['speed']},
        })

    def by_engine(self, file):
        study = self.written('study.yaml', {
            'scenario': os.path.abspath(file), 'plan': 'grid', 'replicates': 1,
            'factors': [{'key': 'initial.speed', 'values': [self.scenario['initial']['speed']]}],
        })
        out = tempfile.mkdtemp(dir=self.folder)
        self('study', study, '--engine', 'multibody', '--jobs', '1', '--quiet', '--out', out)


def by_ode(program, scenario):
    """What it prints."""
    mass, inertia, half, _, _ = expand(scenario)
    width = [block['width'] for block in scenario['consist'] for _ in range(block['count'])]
    ground, initial, stop = scenario['ground'], scenario['initial'], scenario['stop']
    run = (scenario['coupler']['length'], ground['on_track_friction'], ground['off_track_friction'], initial['speed'],
           initial['yaw_rate'], ODE_STEP, stop['speed'], stop['time_max'], ODE_ITERATIONS)
    lines = [run, *zip(mass, inertia, 2.0 * half, width)]
    text = '\n'.join(' '.join(f'{x:.17g}' for x in line) for line in lines)
    return json.loads(output([program], input=text, text=True))


def measured(program, file, ode=None, runs=10, slow_runs=3):
    """Rows: name, processor time [s], simulated time [s], what is computed."""
    rows = []

    def row(name, what, count, action, simulated=None):
        seconds, result = timed(action, count)
        rows.append((name, seconds, simulated or result['stop_time'], what))

    with tempfile.TemporaryDirectory() as folder:
        derail = Derail(program, yaml.safe_load(Derail(program, None, folder)('check', file)), folder)
        row('derail, the paper\'s model', 'plane; elastic couplers with slack', runs, lambda: derail.outcome(file))
        stop = rows[0][2]
        for name, preset, what in (
            ('derail, accident model', 'accident.yaml', 'plane; rails, brakes, contact'),
            ('derail, spatial model', 'accident3d.yaml', 'the same in three dimensions'),
        ):
            like = derail.like(preset)
            row(name, what, runs, lambda like=like: derail.outcome(like))
        row('SciPy RK45', 'as the first', slow_runs, lambda: by_scipy(derail.scenario, stop), stop)
        row('multibody engine', 'as the first', slow_runs, lambda: derail.by_engine(file), stop)
        if ode:
            row('ODE', 'three dimensions; rigid bars, contact', slow_runs, lambda: by_ode(ode, derail.scenario))
    return rows


def table(rows):
    """Markdown."""
    lines = ['| one train | ms | simulated, s | ms a simulated second, over the first | what is computed |',
             '|---|---|---|---|---|']
    first = rows[0][1] / rows[0][2]
    for name, seconds, simulated, what in rows:
        each = seconds / simulated / first
        lines.append(f'| {name} | {1e3 * seconds:.{0 if seconds > 0.1 else 1}f} | {simulated:.1f} | {each:.{0 if each > 9.5 else 1}f} | {what} |')
    return '\n'.join(lines)


def add_programs(parser):
    parser.add_argument('--derail', default='derail', help='program to time (default: derail)')
    parser.add_argument('--ode', metavar='PROGRAM', help='benchmark/ode_chain of a build; without it no row for ODE')


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('file', metavar='FILE', help='scenario, YAML')
    add_programs(parser)
    parser.add_argument('--runs', type=int, default=10, help='of derail (default: 10)')
    parser.add_argument('--slow-runs', type=int, default=3, help='of each of the others (default: 3)')
    given = parser.parse_args()
    try:
        print(table(measured(given.derail, given.file, given.ode, given.runs, given.slow_runs)))
    except Failed as e:
        print(f'compare_cost.py: {e}', file=sys.stderr)
        return 1
    except OSError as e:
        print(f'compare_cost.py: {e.filename}: {e.strerror}', file=sys.stderr)
        return 1
    return 0


if __name__ == '__main__':
    sys.exit(main())
