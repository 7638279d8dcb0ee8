#!/usr/bin/python3
"""Times derail, SciPy and the multibody engine on one scenario, in turn, and prints the ratios.

  scripts/compare_cost.py config/baseline.yaml [--derail PATH] [--runs N] [--slow-runs N]

derail and the engine are timed as whole processes, SciPy (solve_ivp, RK45, right-hand side in NumPy, restarted where a car
passes the point of derailment) inside this one. Medians of processor time, which others on the machine disturb least; each uses
one core. Needs python3-scipy.
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
            raise SystemExit('compare_cost.py: ground.on_track_law guided is not supported')
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
            raise SystemExit(f'compare_cost.py: SciPy: {run.message}')
        t, y, evaluations = run.t[-1], run.y[:, -1], evaluations + run.nfev
        if run.status == 1:
            x = np.where(train.past, -np.inf, y[: train.n])
            train.past[np.argmax(x)] = True
    return evaluations


def spent():
    """Processor time of this process and of those it has waited for [s]."""
    uses = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return sum(use.ru_utime + use.ru_stime for use in uses)


def timed(action, runs):
    seconds = []
    for _ in range(runs):
        start = spent()
        result = action()
        seconds.append(spent() - start)
    return statistics.median(seconds), result


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('file', metavar='FILE', help='scenario, YAML')
    parser.add_argument('--derail', default='derail', help='program to time (default: derail)')
    parser.add_argument('--runs', type=int, default=10, help='of derail (default: 10)')
    parser.add_argument('--slow-runs', type=int, default=3, help='of either of the others (default: 3)')
    given = parser.parse_args()

    def derail(*arguments):
        return subprocess.run([given.derail, *arguments], check=True, stdout=subprocess.PIPE).stdout

    scenario = yaml.safe_load(derail('check', given.file))
    ours, out = timed(lambda: derail('run', given.file, '--json', '-', '--quiet'), given.runs)
    outcome = json.loads(out)
    rows = [('derail run', ours, f'{outcome["steps"]} steps, {outcome["rhs_evaluations"]} evaluations')]
    seconds, evaluations = timed(lambda: by_scipy(scenario, outcome['stop_time']), given.slow_runs)
    rows.append(('SciPy RK45', seconds, f'{evaluations} evaluations'))
    with tempfile.TemporaryDirectory() as folder:
        study = os.path.join(folder, 'study.yaml')
        with open(study, 'w', encoding='utf-8') as file:
            yaml.safe_dump({
                'scenario': os.path.abspath(given.file), 'plan': 'grid', 'replicates': 1,
                'factors': [{'key': 'initial.speed', 'values': [scenario['initial']['speed']]}],
            }, file)
        engine = ('study', study, '--engine', 'multibody', '--jobs', '1', '--quiet', '--out')
        seconds, _ = timed(lambda: derail(*engine, tempfile.mkdtemp(dir=folder)), given.slow_runs)
    rows.append(('multibody engine', seconds, ''))
    for name, seconds, remark in rows:
        print(f'{name:18s} {1e3 * seconds:9.1f} ms   x {seconds / ours:6.1f}   {remark}'.rstrip())
    return 0


if __name__ == '__main__':
    sys.exit(main())
