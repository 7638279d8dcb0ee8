#!/usr/bin/python3
"""Kills `derail run FILE --bag` at many moments and runs the same command again: the bag must be, byte for byte, that of a run which was
left alone, and nothing else may lie beside it.

  kill_bag.py DERAIL FILE [--moments 100] [--folder WHERE] [-- OPTIONS OF derail run]

Exit codes: 0 as promised, 1 not.
"""

import argparse
import os
import subprocess
import sys
import tempfile
import time

LIMIT = 600.0  # wall seconds for a run
GOLDEN = 0.6180339887  # its multiples fill a run evenly


class NotAsPromised(Exception):
    """What was found after a kill; the text says what."""


def kill_at_moments(command, moments, where=None):
    """`command` without --bag; moments are those before the bag has its name. Throws NotAsPromised."""
    with tempfile.TemporaryDirectory(prefix='train_derail_kill_', dir=where) as folder:
        bag = os.path.join(folder, 'run.bag')
        command = [*command, '--quiet', '--bag', bag]

        def run():
            done = subprocess.run(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, timeout=LIMIT, check=False)
            if done.returncode != 0:
                raise NotAsPromised(f'exit code {done.returncode}: {done.stderr}')
            if os.listdir(folder) != ['run.bag']:
                raise NotAsPromised(f'left behind: {sorted(os.listdir(folder))}')
            with open(bag, 'rb') as file:
                return file.read()

        started = time.monotonic()
        whole = run()
        shortest = time.monotonic() - started
        killed = 0
        for attempt in range(10 * moments):
            os.remove(bag)
            started = time.monotonic()
            with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
                try:
                    process.wait(shortest * (attempt * GOLDEN % 1.0))
                    shortest = min(shortest, time.monotonic() - started)
                except subprocess.TimeoutExpired:
                    process.kill()
            if not os.path.exists(bag):
                killed += 1
                started = time.monotonic()
                run()
                shortest = min(shortest, time.monotonic() - started)
            with open(bag, 'rb') as file:
                if file.read() != whole:
                    raise NotAsPromised(f'attempt {attempt}: another bag')
            if killed == moments:
                return
        raise NotAsPromised(f'only {killed} of {10 * moments} runs were killed before their bag was there')


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('derail')
    parser.add_argument('file')
    parser.add_argument('--moments', type=int, default=100)
    parser.add_argument('--folder', help='where the bags are written and removed; default: that of temporary files')
    given = sys.argv[1:]
    end = given.index('--') if '--' in given else len(given)
    a = parser.parse_args(given[:end])
    try:
        kill_at_moments([a.derail, 'run', a.file, *given[end + 1:]], a.moments, a.folder)
    except NotAsPromised as e:
        print(f'kill_bag.py: {e}', file=sys.stderr)
        return 1
    print(f'{a.moments} kills: the same bag every time, nothing else left')
    return 0


if __name__ == '__main__':
    sys.exit(main())
