#!/usr/bin/python3
"""What the module for Python costs over derail: whole processes of derail against calls in a process that is there, in turn.

  PYTHONPATH=build/devel/lib/python3/dist-packages benchmark/measure_python.py build/devel/lib/train_derail/derail [ROUNDS]

Computing: `wall_time` of either, which neither start nor reading is part of. Wall: of the call, reading of the file included;
derail's has the start of its process in it, the module's has not: importing it is measured apart."""

import json
import statistics
import subprocess
import sys
import time

import train_derail

CASES = (
    ('baseline.yaml', {}),
    ('baseline.yaml, 200 cars', {'consist[0].count': 200}),
    ('accident.yaml, 5 s', {'stop.time_max': '5 s'}),
)


def by_derail(derail, path, changes):
    sets = [word for key, value in changes.items() for word in ('--set', f'{key}={value}')]
    start = time.perf_counter()
    text = subprocess.run([derail, 'run', path, '--quiet', '--json', '-', *sets], capture_output=True, check=True).stdout
    return time.perf_counter() - start, json.loads(text)['wall_time']


def by_module(path, changes):
    start = time.perf_counter()
    run = train_derail.run(path, changes)
    return time.perf_counter() - start, run.outcome['wall_time']


def main(derail, rounds):
    print(f'{"":<26}{"derail, wall":>14}{"module, wall":>14}{"ratio":>8}{"derail, comp.":>15}{"module, comp.":>15}{"ratio":>8}   (least of {rounds})')
    for title, changes in CASES:
        path = train_derail.load(f'config/{title.split(",")[0]}').source
        rows = []
        for _ in range(rounds):
            rows.append((*by_derail(derail, path, changes), *by_module(path, changes)))
        wall, computing, module_wall, module_computing = (min(column) for column in zip(*rows))
        print(f'{title:<26}{1e3 * wall:>11.1f} ms{1e3 * module_wall:>11.1f} ms{module_wall / wall:>8.3f}'
              f'{1e3 * computing:>12.1f} ms{1e3 * module_computing:>12.1f} ms{module_computing / computing:>8.3f}')
    imports = []
    for code in ('import numpy', 'import train_derail; train_derail.run'):
        took = []
        for _ in range(max(rounds // 4, 3)):
            start = time.perf_counter()
            subprocess.run([sys.executable, '-c', code], check=True)
            took.append(time.perf_counter() - start)
        imports.append(statistics.median(took))
    print(f'start of Python with numpy {1e3 * imports[0]:.0f} ms, with the module {1e3 * imports[1]:.0f} ms (medians)')


if __name__ == '__main__':
    main(sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else 20)
