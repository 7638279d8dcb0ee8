#!/usr/bin/python3
"""The examples as users start them: launch files, output against the command line's and ~outcome, refusals."""

import csv
import importlib.util
import json
import math
import os
import re
import signal
import subprocess
import sys
import tempfile
import unittest

import roslib.packages
import rospy
import rostest
import yaml

import waiting
from train_derail.msg import CarState, Inputs, Outcome
from train_derail.srv import Restart

LIMIT = 150.0  # wall seconds for anything
KIP = 4448.2216152605  # N


def program(name):
    return roslib.packages.find_node('train_derail', name)[0]


def end(process):
    if process.poll() is None:
        process.send_signal(signal.SIGINT)
        try:
            process.communicate(timeout=LIMIT)
        except subprocess.TimeoutExpired:
            process.kill()
            process.communicate()


def wait_for(condition, what):
    if not waiting.wait_for(condition, LIMIT):
        raise AssertionError('no ' + what)


def read_table(path):
    with open(path, encoding='utf-8', newline='') as f:
        return list(csv.DictReader(f))


class ExamplesTest(unittest.TestCase):

    @classmethod
    def setUpClass(cls):
        cls.scenario_file = rospy.get_param('~scenario_file')
        cls.folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.folder.cleanup)
        cls.states_file = os.path.join(cls.folder.name, 'states.csv')
        done = subprocess.run([program('derail'), 'run', cls.scenario_file, '--json', '-', '--csv', cls.states_file],
                              stdout=subprocess.PIPE, text=True, timeout=LIMIT, check=True)
        cls.outcome = json.loads(done.stdout)
        cls.states = read_table(cls.states_file)

    def path(self, name):
        return os.path.join(self.folder.name, name)

    def launch(self, name, *arguments):
        process = subprocess.Popen(
            ['roslaunch', 'train_derail', name, 'config:=' + self.scenario_file, 'rviz:=false', 'rate:=0', *arguments],
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        self.addCleanup(end, process)
        return process

    def assert_close(self, a, b, what):
        self.assertTrue(math.isclose(float(a), float(b), rel_tol=1e-9, abs_tol=1e-12), '%s: %s, %s' % (what, a, b))

    def test_pile_up_ends_with_the_simulator_and_agrees_with_the_command_line(self):
        table_file = self.path('launched.csv')
        launched = self.launch('pile_up_extent.launch', 'file:=' + table_file, 'exit_when_done:=true')
        said, _ = launched.communicate(timeout=LIMIT)
        table = read_table(table_file)
        by_time = {}
        for state in self.states:
            by_time.setdefault(float(state['time_s']), []).append(state)
        self.assertEqual([float(r['time_s']) for r in table], sorted(by_time), said)
        with open(self.scenario_file, encoding='utf-8') as f:
            block = yaml.safe_load(f)['consist'][0]
        feet = float(block['length'].split()[0])
        half_length, half_width = 0.5 * 0.3048 * feet, self.half_width()
        empty = 0
        for r in table:
            self.assertEqual(r['run_id'], '1')
            cars = by_time[float(r['time_s'])]
            self.assertEqual(int(r['cars_past_pod']), sum(int(c['past_pod']) for c in cars))
            self.assertEqual(int(r['cars_off_track']), sum(int(c['off_track']) for c in cars))
            corners = []
            for c in cars:
                if c['past_pod'] == '0' and c['off_track'] == '0':
                    continue
                x, y, theta = (float(c[k]) for k in ('x_m', 'y_m', 'theta_rad'))
                for u in (half_length, -half_length):
                    for v in (half_width, -half_width):
                        corners.append((x + u * math.cos(theta) - v * math.sin(theta),
                                        y + u * math.sin(theta) + v * math.cos(theta)))
            if not corners:
                empty += 1
                self.assertEqual([r['x_min_m'], r['y_max_m']], ['', ''])
                self.assertEqual([float(r['length_m']), float(r['width_m'])], [0, 0])
                continue
            xs, ys = zip(*corners)
            for key, expected in (('x_min_m', min(xs)), ('x_max_m', max(xs)), ('length_m', max(xs) - min(xs)),
                                  ('y_min_m', min(ys)), ('y_max_m', max(ys)), ('width_m', max(ys) - min(ys))):
                self.assert_close(r[key], expected, key)
        self.assertLess(empty, len(table) / 2, 'a run without a pile-up tests nothing')
        self.assert_close(table[-1]['length_m'], self.outcome['pile_up_length'], 'length')
        self.assert_close(table[-1]['width_m'], self.outcome['pile_up_width'], 'width')

    def test_pile_up_has_a_car_on_its_side_as_wide_as_it_is_high(self):
        source = os.path.join(roslib.packages.get_pkg_dir('train_derail'), 'examples', 'pile_up_extent', 'pile_up_extent.py')
        spec = importlib.util.spec_from_file_location('pile_up_extent', source)
        example = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(example)
        inputs = Inputs(car_length=[18.0], car_width=[3.0], car_height=[4.2],
                        yaml='consist: [{count: 1, length: 18, width: 3, centre_height: 2}]')
        car = CarState(off_track=True)
        car.pose.position.x, car.pose.position.y = 10.0, 5.0
        half = math.sqrt(0.5)
        for (roll, yaw), expected in (
                ((0.0, 0.0), (1.0, 19.0, 3.5, 6.5)),
                ((0.5 * math.pi, 0.0), (1.0, 19.0, 2.8, 7.0)),  # to the right: its roof lies there
                ((0.0, 0.25 * math.pi), (10 - 10.5 * half, 10 + 10.5 * half, 5 - 10.5 * half, 5 + 10.5 * half))):
            car.pose.orientation.x, car.pose.orientation.z = math.sin(0.5 * roll), math.sin(0.5 * yaw)
            car.pose.orientation.w = math.cos(0.5 * (roll + yaw))
            car.theta = yaw
            for a, b in zip(example.extent([car], example.car_sizes(inputs)), expected):
                self.assert_close(a, b, (roll, yaw))

    def half_width(self):
        done = subprocess.run([program('derail'), 'check', self.scenario_file], stdout=subprocess.PIPE, text=True,
                              timeout=LIMIT, check=True)
        return 0.5 * float(yaml.safe_load(done.stdout)['consist'][0]['width'])

    def test_pile_up_agrees_with_the_outcome_of_every_run(self):
        ended = {}

        def keep(message):
            if message.ended != Outcome.RUNNING:
                ended[message.run_id] = message

        subscriber = rospy.Subscriber('/train_derail/outcome', Outcome, keep)
        self.addCleanup(subscriber.unregister)
        table_file = self.path('two_runs.csv')
        launched = self.launch('pile_up_extent.launch', 'file:=' + table_file)
        wait_for(lambda: 1 in ended, 'end of run 1')
        # A mixed train: each car's own size counts.
        answer = rospy.ServiceProxy('/train_derail/restart', Restart)(
            scenario=yaml.safe_dump({
                'title': 'mixed',
                'consist': [{'count': count, 'length': length, 'width': length / 6, 'weight': '150 kip'}
                            for count, length in ((1, 14.0), (2, 20.0), (1, 16.0), (2, 24.0), (1, 18.0), (2, 26.0))],
                'initial': {'speed': '60 mph', 'yaw_rate': 0.3},
                'stop': {'time_max': 4.0}}))
        self.assertTrue(answer.success, answer.message)
        wait_for(lambda: 2 in ended, 'end of run 2')
        last = {}

        def written():
            last.update({int(r['run_id']): r for r in read_table(table_file) if r['width_m']})
            return 2 in last and float(last[2]['time_s']) >= ended[2].stop_time

        wait_for(written, 'last row')
        end(launched)
        table = read_table(table_file)
        self.assertEqual([int(r['run_id']) for r in table], sorted(int(r['run_id']) for r in table))
        for run_id, outcome in ended.items():
            row = last[run_id]
            self.assertGreater(outcome.pile_up_length, 10.0)
            self.assert_close(row['time_s'], outcome.stop_time, 'time')
            self.assert_close(row['length_m'], outcome.pile_up_length, 'length')
            self.assert_close(row['width_m'], outcome.pile_up_width, 'width')
            self.assertEqual(int(row['cars_past_pod']), outcome.cars_past_pod)
            self.assertEqual(int(row['cars_off_track']), outcome.cars_off_track)

    def test_coupler_table_agrees_with_the_command_line(self):
        threshold = 100 * KIP
        launched = self.launch('coupler_overload.launch', 'threshold:=100 kip', 'exit_when_done:=true')
        said, _ = launched.communicate(timeout=LIMIT)
        expected = {}
        for state in self.states:
            if not state['axial_force_N']:
                continue
            for direction in ('buff', 'draft'):
                force = float(state[direction + '_peak_N'])
                e = expected.setdefault((int(state['car']), direction), [None, 0, 0.0])
                e[2] = max(e[2], force)
                if force > threshold:
                    e[0] = float(state['time_s']) if e[0] is None else e[0]
                    e[1] += 1
        expected = {k: ('%.3f' % e[0], '%.3f' % (0.02 * e[1]), '%.0f' % (e[2] / 1000), '%.0f' % (e[2] / KIP))
                    for k, e in expected.items() if e[0] is not None}
        self.assertGreater(len(expected), 5)
        lines = re.findall(r'(?m)^ *(\d+)  (buff|draft) +(\S+) +(\S+) +(\S+) +(\S+) +(\S+)$', said)
        self.assertEqual({(int(n), direction): tuple(rest[:4]) for n, direction, *rest in lines}, expected, said)
        self.assertRegex(said, r'run 1, \S+ s: \d+ of 11 couplers above 445 kN \(100 kip\)')
        self.assertNotIn('never came', said)

    def test_bad_input_is_refused(self):
        monitor, extent = 'coupler_overload_monitor', 'pile_up_extent.py'
        table = self.path('refused.csv')
        cases = [
            # program, parameters, exit code, what must be said
            (monitor, {'threshold': -1.0}, 2, ['/refused_0', 'threshold', '-1', '1 to', 'N']),
            (monitor, {'threshold': '100 mph'}, 2, ['threshold', '100 mph', 'dimension', 'N']),
            (monitor, {'threshold': float('nan')}, 2, ['threshold', 'nan']),
            (monitor, {'thresold': 1000.0}, 2, ['thresold', 'unknown', 'threshold']),
            (monitor, {'simulator': 'a b'}, 2, ['simulator', 'a b']),
            (monitor, {'resume': 3}, 2, ['resume', '3', 'true, false']),
            (extent, {}, 2, ['/refused_6', 'file', 'not set']),
            (extent, {'file': 7}, 2, ['file', '7', 'text']),
            (extent, {'file': table, 'resume': 'maybe'}, 2, ['resume', 'maybe', 'true, false']),
            (extent, {'file': table, 'fiel': 'x'}, 2, ['fiel', 'unknown', 'simulator']),
            (extent, {'file': table, 'simulator': 'a b'}, 2, ['simulator', 'a b']),
            (extent, {'file': '/no/such/folder/x.csv'}, 1, ['/no/such/folder/x.csv', 'No such file']),
            (extent, {'file': self.folder.name}, 1, [self.folder.name, 'Is a directory']),
            (extent, {'file': '/dev/full'}, 1, ['/dev/full', 'No space left']),
        ]
        started = []
        for number, (name, parameters, code, said) in enumerate(cases):
            if parameters:
                rospy.set_param('/refused_%d' % number, parameters)
            process = subprocess.Popen([program(name), '__name:=refused_%d' % number], stdout=subprocess.PIPE,
                                       stderr=subprocess.STDOUT, text=True)
            self.addCleanup(end, process)
            started.append((process, code, said))
        for process, code, said in started:
            output, _ = process.communicate(timeout=LIMIT)
            self.assertEqual(process.returncode, code, output)
            self.assertNotIn('Traceback', output)
            for text in said:
                self.assertIn(text, output)
        self.assertFalse(os.path.exists(table))


if __name__ == '__main__':
    rospy.init_node('test_ros_examples')
    rostest.rosrun('train_derail', 'test_ros_examples', ExamplesTest, sys.argv)
