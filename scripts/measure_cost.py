#!/usr/bin/python3
"""Measures what runs cost on this machine; the figures of docs/performance.md.

  scripts/measure_cost.py DIR [--derail PATH] [--ode PATH] [--runs N] [--cars N ...]
  scripts/measure_cost.py DIR --fill PAGE

Writes DIR/cost.json, DIR/cost.png and .svg and DIR/cost.txt, the tables. --fill measures nothing: it puts the tables of DIR
into PAGE, between its marks, and the picture beside it, as pictures/cost.png. Takes a minute or two. Processor time of whole
processes, the least of N: others on the machine disturb that least. The table beside other programs has medians of N, of the slow
ones of one run (scripts/compare_cost.py).
Exit codes: 0 done, 1 something could not be written, 2 a run failed.
"""

import argparse
import json
import os
import re
import shutil
import sys

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))  # a catkin devel space runs this file from elsewhere

import compare_cost  # noqa: E402
from compare_cost import Failed, output, spent_by_children, timed  # noqa: E402
from derail_plots import cost, style  # noqa: E402

CARS = (20, 50, 100, 200, 500, 1000)
POINTS = 10  # of a run's way to its end
# Scenarios with the block of cars whose count gives the train's length, and how many others there are.
LENGTHS = (
    ("paper's model", 'baseline.yaml', 'consist[0].count', 0),
    ('accident model', 'accident.yaml', 'consist[1].count', 3),
    ('spatial model', 'accident3d.yaml', 'consist[1].count', 3),
)
PROGRESS = (
    ('accident.yaml, 102 cars', 'accident.yaml'),
    ('accident3d.yaml, 102 cars', 'accident3d.yaml'),
    ('Lac-M\N{LATIN SMALL LETTER E WITH ACUTE}gantic, 79 cars', 'accidents/lac_megantic_2013.yaml'),
)
MARKED = re.compile(r'(<!-- begin: (\w+) -->\n).*?(\n<!-- end -->)', re.DOTALL)


class Meter:
    def __init__(self, derail, runs):
        self.derail, self.runs = derail, runs

    def run(self, *arguments):
        """Least processor time [s], what was printed."""
        return timed(lambda: output([self.derail, *arguments]), self.runs, min, spent_by_children)

    def outcome(self, name, *changes):
        settings = [word for change in changes for word in ('--set', change)]
        seconds, out = self.run('run', config(name), '--quiet', '--json', '-', *settings)
        return seconds, json.loads(out)


def config(name):
    return os.path.realpath(os.path.join(compare_cost.CONFIG, name))


def lengths(meter, counts):
    lines = []
    for name, scenario, key, others in LENGTHS:
        line = {'name': name, 'cars': list(counts), 'seconds': [], 'steps': []}
        for cars in counts:
            seconds, outcome = meter.outcome(scenario, f'{key}={cars - others}')
            line['seconds'].append(seconds)
            line['steps'].append(outcome['steps'])
        lines.append(line)
    return lines


def progress(meter):
    lines = []
    for name, scenario in PROGRESS:
        seconds, outcome = meter.outcome(scenario)
        line = {'name': name, 'until': [0.0], 'seconds': [meter.run('check', config(scenario))[0]]}
        for i in range(1, POINTS):
            until = i / POINTS * outcome['stop_time']
            line['until'].append(until)
            line['seconds'].append(meter.outcome(scenario, f'stop.time_max={until}')[0])
        line['until'].append(outcome['stop_time'])
        line['seconds'].append(seconds)
        lines.append(line)
    return lines


def processor():
    with open('/proc/cpuinfo', encoding='utf-8') as file:
        facts = dict(line.split(':', 1) for line in file if ':' in line)
    facts = {key.strip(): value.strip() for key, value in facts.items()}
    return (f"{facts.get('model name', 'unknown')} (family {facts.get('cpu family', '?')}, model {facts.get('model', '?')}), "
            f'{len(os.sched_getaffinity(0))} processors')


def runs_table(measured):
    lines = ['| whole run | cars | processor time | of a car and step |', '|---|---|---|---|']
    lines.append(f"| start of the program alone | | {cost.time(measured['start'])} | |")
    for line in measured['lengths']:
        for cars, seconds, steps in zip(line['cars'], line['seconds'], line['steps']):
            if cars not in (line['cars'][0], 100, line['cars'][-1]):
                continue
            each = 1e9 * (seconds - measured['start']) / (cars * steps)
            lines.append(f"| {line['name']} | {cars} | {cost.time(seconds)} | {each:.0f} ns |")
    return '\n'.join(lines)


def measure(given):
    meter = Meter(given.derail, given.runs)
    measured = {
        'machine': processor(),
        'start': Meter(given.derail, 10 * given.runs).run('--version')[0],  # short, so that others disturb it more
        'lengths': lengths(meter, given.cars),
        'progress': progress(meter),
        'compared': compare_cost.measured(given.derail, config('baseline.yaml'), given.ode, given.runs, 1),
    }
    os.makedirs(given.folder, exist_ok=True)
    with open(os.path.join(given.folder, 'cost.json'), 'w', encoding='utf-8') as file:
        json.dump(measured, file, indent=1)
    return measured


def fill(folder, page, tables):
    with open(page, encoding='utf-8') as file:
        text = file.read()
    marks = [m[2] for m in MARKED.finditer(text)]
    if sorted(marks) != sorted(tables):
        raise Failed(f'{page}: marks {", ".join(marks) or "none"}; wanted: each of {", ".join(tables)} once')
    text = MARKED.sub(lambda m: m[1] + tables[m[2]] + m[3], text)
    with open(page, 'w', encoding='utf-8') as file:
        file.write(text)
    shutil.copyfile(os.path.join(folder, 'cost.png'), os.path.join(os.path.dirname(page), 'pictures', 'cost.png'))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('folder', metavar='DIR', help='where the results go')
    compare_cost.add_programs(parser)
    parser.add_argument('--runs', type=int, default=5, help='of each, the least counts (default: 5)')
    parser.add_argument('--cars', type=int, nargs='+', default=CARS, help='lengths of trains')
    parser.add_argument('--fill', metavar='PAGE', help='put what is in DIR into this page')
    given = parser.parse_args()
    try:
        if given.fill:
            with open(os.path.join(given.folder, 'cost.json'), encoding='utf-8') as file:
                measured = json.load(file)
        else:
            measured = measure(given)
        tables = {'machine': measured['machine'], 'runs': runs_table(measured), 'compared': compare_cost.table(measured['compared'])}
        style.apply()
        style.save(cost.figure(measured), given.folder, 'cost', 'What runs cost')
        with open(os.path.join(given.folder, 'cost.txt'), 'w', encoding='utf-8') as file:
            file.write('\n\n'.join(tables.values()) + '\n')
        if given.fill:
            fill(given.folder, given.fill, tables)
    except Failed as e:
        print(f'measure_cost.py: {e}', file=sys.stderr)
        return 2
    except OSError as e:
        print(f'measure_cost.py: {e.filename}: {e.strerror}', file=sys.stderr)
        return 1
    return 0


if __name__ == '__main__':
    sys.exit(main())
