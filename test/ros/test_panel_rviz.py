#!/usr/bin/python3
"""RViz as it ships, on a virtual display: its panel, driven by the keyboard alone, starts another run."""

import os
import signal
import subprocess
import sys
import threading
import unittest

import roslib.packages
import rosparam
import rospkg
import rospy
import rostest

from train_derail.msg import CarStates, Inputs, RunInfo

LIMIT = 150.0  # wall seconds for anything
TRIES = 10
SIZE = '1600x900x24'
MPH = 0.44704
SPEED, PAUSE, RESTART = 'alt+s', 'alt+u', 'alt+e'  # as underlined in the panel


class PanelRvizTest(unittest.TestCase):

    @classmethod
    def setUpClass(cls):
        cls.processes = []
        server = subprocess.Popen(['Xvfb', '-displayfd', '1', '-noreset', '-nolisten', 'tcp', '-screen', '0', SIZE],
                                  stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        cls.processes.append(server)
        cls.environment = dict(os.environ, DISPLAY=':' + server.stdout.readline().strip(), LIBGL_ALWAYS_SOFTWARE='1',
                               QT_X11_NO_MITSHM='1')
        cls.results = os.path.join(rospkg.get_test_results_dir(), 'train_derail')
        os.makedirs(cls.results, exist_ok=True)
        cls.package = rospkg.RosPack().get_path('train_derail')
        cls.node = roslib.packages.find_node('train_derail', 'train_derail_node')[0]
        # Topics are heard in other threads, which say so.
        cls.heard = threading.Condition()
        cls.messages = {'inputs': [], 'cars': [], 'run_info': []}
        for topic, kind in (('inputs', Inputs), ('cars', CarStates), ('run_info', RunInfo)):
            rospy.Subscriber('/train_derail/' + topic, kind, cls.hear, topic)

    @classmethod
    def tearDownClass(cls):
        for process in reversed(cls.processes):
            if process.poll() is None:
                process.kill()
                process.wait(timeout=LIMIT)

    @classmethod
    def hear(cls, message, topic):
        with cls.heard:
            cls.messages[topic].append(message)
            cls.heard.notify_all()

    def last(self, topic):
        return self.messages[topic][-1]

    def wait_for(self, condition, limit=LIMIT):
        with self.heard:
            return self.heard.wait_for(condition, timeout=limit)

    def start(self, *command):
        process = subprocess.Popen(command, env=self.environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        self.processes.append(process)
        return process

    def start_node(self):
        with self.heard:
            for messages in self.messages.values():
                messages.clear()
        node = self.start(self.node, '__name:=train_derail')
        self.assertTrue(self.wait_for(lambda: all(self.messages.values())), 'the node says nothing')
        return node

    def tool(self, *command):
        return subprocess.run(command, env=self.environment, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
                              timeout=LIMIT, check=False).stdout

    def press(self, *keys):
        windows = self.tool('xdotool', 'search', '--onlyvisible', '--name', 'RViz').decode().split()
        if windows:
            self.tool('xdotool', 'windowfocus', '--sync', windows[-1])
            for key in keys:
                self.tool('xdotool', *key.split(' ', 1))

    def press_until(self, condition, *keys):
        """A window that is not up yet hears nothing: as a person would, again."""
        for _ in range(TRIES):
            self.press(*keys)
            if self.wait_for(condition, LIMIT / TRIES):
                return
        self.fail('%s: no effect' % (keys,))

    def take_picture(self, name):
        self.tool('import', '-window', 'root', os.path.join(self.results, name + '.png'))

    def restart_with(self, mph):
        self.press_until(lambda: abs(self.last('inputs').speed - mph * MPH) < 1e-9,
                         'key ' + SPEED, 'key ctrl+a', 'type %g mph' % mph, 'key ' + RESTART)
        run_id = self.last('inputs').run_id
        first = lambda: [m for m in self.messages['cars'] if m.run_id == run_id and m.time == 0.0]
        self.assertTrue(self.wait_for(first), 'no state of run %d at time 0' % run_id)
        for car in first()[0].cars:
            self.assertAlmostEqual(car.twist.linear.x, mph * MPH, places=9)

    def test_keyboard_restarts_with_another_speed(self):
        rospy.set_param('/use_sim_time', True)
        for tree, namespace in rosparam.load_file(os.path.join(self.package, 'config/baseline.yaml'),
                                                  '/train_derail/scenario'):
            rosparam.upload_params(namespace, tree)
        node = self.start_node()
        self.assertAlmostEqual(self.last('inputs').speed, 37 * MPH)
        rviz = self.start('rviz', '-d', os.path.join(self.package, 'rviz/train_derail.rviz'))

        self.restart_with(50)
        self.press_until(lambda: self.last('run_info').state == RunInfo.PAUSED, 'key ' + PAUSE)
        self.take_picture('panel_driven')

        # Another node by the same name, while RViz goes on.
        node.kill()
        node.wait(timeout=LIMIT)
        self.start_node()
        self.assertAlmostEqual(self.last('inputs').speed, 37 * MPH)
        self.restart_with(44)
        self.take_picture('panel_recovered')

        rviz.send_signal(signal.SIGINT)
        rviz.wait(timeout=LIMIT)  # that it ends; its exit code is RViz's own affair


if __name__ == '__main__':
    rospy.init_node('test_panel_rviz')
    rostest.rosrun('train_derail', 'test_panel_rviz', PanelRvizTest, sys.argv)
