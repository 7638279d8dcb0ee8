#!/usr/bin/python3
"""Example of a subscriber in Python: how the pile-up of a simulated train spreads, as a CSV table.

One row a point of the grid of simulated time, about the footprints of the cars past the point of derailment or off the
track, from above: a car that lies on its side is as wide as it is high. Extents are empty while there is none. Further
runs go on in the same file with their run_id.

Parameters: ~file, the table, which is written anew (required); ~simulator, name of the simulator's node (default:
train_derail); ~resume, start a paused simulator once its topics arrive, so that nothing of the run is missed (default:
false). Exit codes: 0 done, 1 the file could not be written, 2 a parameter is not valid.
"""

import csv
import math
import os
import queue
import signal
import sys
import time

import rosgraph.names
import rospy
import std_srvs.srv
import yaml

from train_derail.msg import CarStates, Inputs

COLUMNS = (
    'run_id',
    'time_s',
    'cars_past_pod',
    'cars_off_track',
    'x_min_m',
    'x_max_m',
    'length_m',
    'y_min_m',
    'y_max_m',
    'width_m',
)
DEFAULTS = {'file': None, 'simulator': 'train_derail', 'resume': False}
WAIT = 0.2  # longest that a signal goes unseen, wall seconds
ROUNDING = 1e-6  # of a grid spacing
DRAIN = 5.0  # longest that messages are still taken after a signal, wall seconds


class ParameterError(Exception):
    """Says node, key, value, allowed range."""


def read_parameters():
    given = rospy.get_param('~', {})

    def refuse(key, problem, allowed):
        raise ParameterError(f"{rospy.get_name()}: {key} = '{parameters[key]}': {problem}; allowed: {allowed}")

    parameters = {**DEFAULTS, **given}
    for key in parameters:
        if key not in DEFAULTS:
            refuse(key, 'unknown parameter', ', '.join(DEFAULTS))
    if parameters['file'] is None:
        raise ParameterError(f'{rospy.get_name()}: file: not set; allowed: path of the table to write')
    for key in ('file', 'simulator'):
        if not isinstance(parameters[key], str) or not parameters[key]:
            refuse(key, 'must be text', 'not empty')
    if not rosgraph.names.is_legal_name(parameters['simulator']):
        refuse('simulator', 'not a name of a node', 'letters, digits, _ and /')
    if not isinstance(parameters['resume'], bool):
        refuse('resume', 'must be a truth value', 'true, false')
    return parameters


def car_sizes(inputs):
    """(length, width, height, height of the centre of mass) of every car [m], front to rear."""
    blocks = yaml.safe_load(inputs.yaml)['consist']
    # Only in three dimensions a block has a centre of mass above the rails; in the plane nothing rolls.
    centres = [float(b.get('centre_height', 0.0)) for b in blocks for _ in range(int(b['count']))]
    return list(zip(inputs.car_length, inputs.car_width, inputs.car_height, centres))


def level_axes(q):
    """The x and y parts, in the world, of the car's own axes to the front, the left and the roof."""
    to_x = 1.0 - 2.0 * (q.y * q.y + q.z * q.z), 2.0 * (q.x * q.y - q.z * q.w), 2.0 * (q.x * q.z + q.y * q.w)
    to_y = 2.0 * (q.x * q.y + q.z * q.w), 1.0 - 2.0 * (q.x * q.x + q.z * q.z), 2.0 * (q.y * q.z - q.x * q.w)
    return to_x, to_y


def extent(cars, sizes):
    """x_min, x_max, y_min, y_max of the footprints of the derailed cars [m]; None if there is none."""
    corners = []
    for car, (length, width, height, centre) in zip(cars, sizes):
        if car.past_pod or car.off_track:
            ends = []
            place = car.pose.position
            for at, axes in zip((place.x, place.y), level_axes(car.pose.orientation)):
                middle = at + axes[2] * (0.5 * height - centre)  # the box from the rails to the roof
                half = 0.5 * sum(size * abs(axis) for size, axis in zip((length, width, height), axes))
                ends += [middle - half, middle + half]
            corners.append(ends)
    if not corners:
        return None
    x_min, x_max, y_min, y_max = zip(*corners)
    return min(x_min), max(x_max), min(y_min), max(y_max)


def row(states, sizes):
    counts = [sum(c.past_pod for c in states.cars), sum(c.off_track for c in states.cars)]
    box = extent(states.cars, sizes)
    if box is None:
        return [states.run_id, states.time, *counts, None, None, 0.0, None, None, 0.0]
    x_min, x_max, y_min, y_max = box
    return [states.run_id, states.time, *counts, x_min, x_max, x_max - x_min, y_min, y_max, y_max - y_min]


class Table:
    """Each row is on its way to the disk when append() returns. Throws OSError."""

    def __init__(self, path):
        self._file = open(path, 'w', encoding='utf-8', newline='', buffering=1)
        self._writer = csv.writer(self._file, lineterminator='\n')
        self.append(COLUMNS)

    def append(self, values):
        try:
            self._writer.writerow(values)
        except OSError:
            self._file.buffer.raw.close()  # else Python tries once more when it forgets the file, and complains
            raise

    def close(self):
        if self._file.closed:
            return
        try:
            os.fsync(self._file.fileno())
        except OSError:
            pass  # a pipe or a device has no disk to be safe on
        self._file.close()


class Recorder:
    """Brings states and inputs together, which come by connections of their own: either may be first."""

    def __init__(self, table):
        self._table = table
        self._runs = {}  # sizes of the cars and grid spacing, by run_id; of the current run and later ones
        self._waiting = []  # states whose inputs have not come yet
        self._last = None
        self.rows = 0
        self.missed = 0  # points of the grid that never came

    def take(self, message):
        if isinstance(message, Inputs):
            self._runs[message.run_id] = car_sizes(message), message.output_interval
        else:
            self._waiting.append(message)
        while self._waiting:
            run_id = self._waiting[0].run_id
            if run_id in self._runs:
                self._write(self._waiting.pop(0))
            elif any(later > run_id for later in self._runs):
                rospy.logwarn_once('run %d was displaced before its inputs came; it is left out', run_id)
                self._waiting.pop(0)
            else:
                break

    def _write(self, states):
        key = (states.run_id, states.time)
        if key == self._last:  # latched: a new connection brings the last one again
            return
        sizes, interval = self._runs[states.run_id]
        self._table.append(row(states, sizes))
        goes_on = self._last is not None and self._last[0] == states.run_id and self._last[1] < states.time
        before = self._last[1] if goes_on else -interval
        self.missed += max(0, math.ceil((states.time - before) / interval - ROUNDING) - 1)
        self.rows += 1
        self._last = key
        self._runs = {r: known for r, known in self._runs.items() if r >= states.run_id}


def resume(simulator):
    try:
        answer = rospy.ServiceProxy(simulator + '/resume', std_srvs.srv.Trigger)()
        if not answer.success:
            rospy.logwarn('%s/resume: %s', simulator, answer.message)
    except rospy.ServiceException as e:
        rospy.logerr('%s/resume does not answer: %s', simulator, e)


def record(parameters, table, stop):
    """Until a signal comes, and then for as long as messages keep coming."""
    messages = queue.Queue()
    simulator = rospy.resolve_name(parameters['simulator'])
    rospy.Subscriber(simulator + '/inputs', Inputs, messages.put)
    rospy.Subscriber(simulator + '/cars', CarStates, messages.put)
    recorder = Recorder(table)
    to_resume = parameters['resume']
    deadline = None
    while True:
        if stop and deadline is None:
            deadline = time.monotonic() + DRAIN
        try:
            recorder.take(messages.get(timeout=WAIT))
        except queue.Empty:
            if deadline or rospy.is_shutdown():
                break
        if deadline and time.monotonic() > deadline:
            break
        # Both topics are latched: once something has come, nothing is missed from here on.
        if to_resume and recorder.rows:
            to_resume = False
            resume(simulator)
    return recorder


def main():
    rospy.init_node('pile_up_extent', disable_signals=True)
    stop = []
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda n, frame: stop.append(n))
    try:
        parameters = read_parameters()
        path = os.path.abspath(os.path.expanduser(parameters['file']))
        table = Table(path)
        rospy.loginfo('writing %s', path)
        try:
            recorder = record(parameters, table, stop)
        finally:
            table.close()
        rospy.loginfo('%d rows in %s', recorder.rows, path)
        if recorder.missed:
            rospy.logwarn('%d points of the grid never came: the table has gaps', recorder.missed)
    except ParameterError as e:
        rospy.logfatal('%s', e)
        return 2
    except OSError as e:
        rospy.logfatal('%s: cannot be written: %s', path, e.strerror)
        return 1
    finally:
        rospy.signal_shutdown('done')
    return 0


if __name__ == '__main__':
    sys.exit(main())
