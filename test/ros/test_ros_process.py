#!/usr/bin/python3
"""The node as a process: refusals before anything is started, exit codes, signals."""

import os
import re
import signal
import subprocess
import sys
import threading
import unittest

import roslib.packages
import rospy
import rosgraph
import rostest
import yaml

from std_srvs.srv import Trigger

import waiting
from train_derail.msg import CarStates

LIMIT = 150.0  # wall seconds for anything


def end(node):
    if node.poll() is None:
        node.kill()
        node.wait()
    node.stdout.close()
    node.stderr.close()


def start_node(test, name, parameters, scenario):
    rospy.set_param('/' + name, parameters)
    if scenario is not None:
        rospy.set_param('/' + name + '/scenario', scenario)
    program = roslib.packages.find_node('train_derail', 'train_derail_node')[0]
    node = subprocess.Popen([program, '__name:=' + name], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    test.addCleanup(end, node)
    return node


def changed(scenario, path, value):
    """A copy of the scenario with one input changed."""
    copy = yaml.safe_load(yaml.safe_dump(scenario))
    place = copy
    for key in path[:-1]:
        place = place[key]
    place[path[-1]] = value
    return copy


class ProcessTest(unittest.TestCase):

    @classmethod
    def setUpClass(cls):
        with open(rospy.get_param('~scenario_file'), encoding='utf-8') as f:
            cls.scenario = yaml.safe_load(f)

    def test_bad_input_is_refused_before_anything_is_started(self):
        good = self.scenario
        cases = [
            # parameters, scenario, what must be said
            ({'rate': -1.0}, good, ['/bad_input_0', 'rate', '-1', '0.001 to 1000']),
            ({'rate': float('nan')}, good, ['rate', 'nan', '0.001 to 1000']),
            ({'rate': 'fast'}, good, ['rate', 'fast']),
            ({'raet': 1.0}, good, ['raet', 'unknown', 'rate']),
            ({'start_paused': 2}, good, ['start_paused', '2', 'true, false']),
            ({'frame_prefix': '/a'}, good, ['frame_prefix', '/a']),
            ({'overload_threshold': 7}, good, ['overload_threshold', '7', '0.01 to 1']),
            ({'speed': 'fast'}, good, ['initial.speed', 'fast']),
            ({'set': 'coupler.slack'}, good, ['coupler.slack']),
            ({'set': 'coupler.slak=1'}, good, ['coupler.slak', 'slack']),
            ({'rate': 1.0}, None, ['/bad_input_10/scenario', 'not set']),
            ({'rate': 1.0}, changed(good, ['consist', 0, 'count'], 0), ['consist[0].count', '0']),
            ({'rate': 1.0}, changed(good, ['initial', 'speed'], '37 kg'), ['initial.speed', '37 kg']),
            ({'rate': 1.0}, changed(good, ['initial', 'speed'], float('nan')), ['initial.speed', 'nan']),
            ({'rate': 1.0}, changed(good, ['initial', 'sped'], 1), ['initial.sped']),
        ]
        nodes = []
        for number, (parameters, scenario, said) in enumerate(cases):
            nodes.append((start_node(self, 'bad_input_%d' % number, parameters, scenario), said))
        for node, said in nodes:
            _, errors = node.communicate(timeout=LIMIT)
            self.assertEqual(node.returncode, 2, errors)
            for text in said:
                self.assertIn(text, errors)
        published = rosgraph.Master('/test').getSystemState()[0]
        self.assertEqual([t for t, _ in published if 'bad_input' in t], [])

    def test_number_as_text_is_a_number(self):
        scenario = changed(self.scenario, ['solver'], {'rtol': '1e-5', 'atol': 1.0e-6})
        node = start_node(self, 'as_text', {'rate': '0', 'exit_when_done': True}, scenario)
        _, errors = node.communicate(timeout=LIMIT)
        self.assertEqual(node.returncode, 0, errors)

    def test_exits_when_done_with_the_outcome(self):
        node = start_node(self, 'done', {'rate': 0, 'exit_when_done': True}, self.scenario)
        output, errors = node.communicate(timeout=LIMIT)
        self.assertEqual(node.returncode, 0, errors)
        self.assertRegex(output, r'(?m)^cars +12$')
        self.assertIn('past the point of derailment', output)

    def test_failed_integration_has_an_exit_code_of_its_own(self):
        node = start_node(self, 'failing', {'rate': 0, 'exit_when_done': True, 'set': 'solver.steps_max=10'}, self.scenario)
        _, errors = node.communicate(timeout=LIMIT)
        self.assertEqual(node.returncode, 3, errors)
        self.assertTrue(re.search('integration failed', errors), errors)

    def test_help_needs_no_master(self):
        program = roslib.packages.find_node('train_derail', 'train_derail_node')[0]
        nowhere = dict(os.environ, ROS_MASTER_URI='http://127.0.0.1:1')
        done = subprocess.run([program, '--help'], env=nowhere, capture_output=True, text=True, timeout=LIMIT)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(done.stderr, '')
        for option in ('--replay ', '--replay-run', '--replay-start', 'docs/node.md'):
            self.assertIn(option, done.stdout)
        done = subprocess.run([program, '--repaly', 'x'], env=nowhere, capture_output=True, text=True, timeout=LIMIT)
        self.assertEqual(done.returncode, 2, done.stderr)
        self.assertIn('--repaly', done.stdout + done.stderr)

    def test_the_end_waits_until_the_messages_are_sent(self):
        # More than sockets hold, so that most of it is still in the node when the run is over.
        scenario = changed(self.scenario, ['consist', 0, 'count'], 600)
        taken = []
        over = threading.Event()

        def take(message):
            if taken:
                over.wait(LIMIT)
            taken.append(message.time)

        parameters = {'rate': 0, 'exit_when_done': True, 'start_paused': True, 'publish': {'markers_every': 0}}
        node = start_node(self, 'slow_listener', parameters, scenario)
        subscriber = rospy.Subscriber('/slow_listener/cars', CarStates, take)
        self.addCleanup(subscriber.unregister)
        self.assertTrue(waiting.wait_for(lambda: taken, LIMIT))
        rospy.ServiceProxy('/slow_listener/resume', Trigger)()
        self.assertTrue(any(re.match(r'cars +600$', line) for line in node.stdout))  # the outcome: the run is over
        over.set()
        _, errors = node.communicate(timeout=LIMIT)
        self.assertEqual(node.returncode, 0, errors)
        self.assertTrue(waiting.wait_for(lambda: taken[-1] == 3.0, LIMIT), taken[-1])
        self.assertEqual(len(taken), 151)

    def test_interrupt_and_termination_end_it_cleanly(self):
        for number, signal_sent in enumerate([signal.SIGINT, signal.SIGTERM]):
            name = 'interrupted_%d' % number
            node = start_node(self, name, {'rate': 0.1}, self.scenario)
            message = rospy.wait_for_message('/%s/cars' % name, CarStates, timeout=LIMIT)
            self.assertLess(message.time, 3.0)
            node.send_signal(signal_sent)
            _, errors = node.communicate(timeout=5.0)
            self.assertEqual(node.returncode, 0, errors)


if __name__ == '__main__':
    rospy.init_node('test_ros_process')
    rostest.rosrun('train_derail', 'test_ros_process', ProcessTest, sys.argv)
