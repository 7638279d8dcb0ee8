#!/usr/bin/python3
"""What the module for Python costs over derail: processes of derail against calls in a process that is there, in turn.

  PYTHONPATH=build/devel/lib/python3/dist-packages benchmark/measure_python.py build/devel/lib/train_derail/derail [ROUNDS]

Processor time, which other work on the machine changes least, and wall time: the least of all rounds. derail's has the start of its
process in it. The module's has not, as a notebook starts once: what importing it takes is measured apart."""

import resource
import subprocess
import sys
import time

import train_derail

CASES = (
    ('baseline.yaml', {}),
    ('baseline.yaml', {'consist[0].count': 200}),
    ('accident.yaml', {'stop.time_max': '5 s'}),
)


def taken(work):
    """(processor time, wall time) of this process and those it has waited for [s]."""
    def used():
        return sum(u.ru_utime + u.ru_stime for u in map(resource.getrusage, (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)))
    processor, wall = used(), time.perf_counter()
    work()
    return used() - processor, time.perf_counter() - wall


def command(*words):
    # vfork and exec only: what this process has in memory is not copied.
    return lambda: subprocess.run(words, stdout=subprocess.DEVNULL, check=True, close_fds=False)


def least(rounds, *works):
    """Least times of each of the works, which take turns."""
    rows = [[taken(work) for work in works] for _ in range(rounds)]
    return [[min(row[k][i] for row in rows) for i in (0, 1)] for k in range(len(works))]


def main(derail, rounds):
    for name, changes in CASES:
        path = train_derail.load(f'config/{name}').source
        sets = [word for key, value in changes.items() for word in ('--set', f'{key}={value}')]
        by_derail, by_module, with_csv, with_states = least(
            rounds, command(derail, 'run', path, '--quiet', *sets), lambda: train_derail.run(path, changes),
            command(derail, 'run', path, '--quiet', '--csv', '-', *sets), lambda: train_derail.run(path, changes, states=True))
        print(f'{name} {changes or ""}'.strip())
        for what, a, b in (('outcome', by_derail, by_module), ('states too (--csv)', with_csv, with_states)):
            for i, kind in enumerate(('processor', 'wall')):
                print(f'  {what:<20}{kind:<11}derail {1e3 * a[i]:8.1f} ms   module {1e3 * b[i]:8.1f} ms   ratio {b[i] / a[i]:.3f}')
    start, numpy, module = least(max(rounds // 3, 2), *(command(sys.executable, '-c', code) for code in ('', 'import numpy', 'import train_derail; train_derail.run')))
    print(f'Python {1e3 * start[0]:.0f} ms, with numpy {1e3 * numpy[0]:.0f} ms, with the module {1e3 * module[0]:.0f} ms of processor time')


if __name__ == '__main__':
    main(sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else 20)
