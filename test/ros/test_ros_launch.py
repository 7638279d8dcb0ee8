#!/usr/bin/python3
"""The launch files as people start them: exit codes, and paths with all that a path may have."""

import os
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
import unittest

import rosbag
import rospkg
import rospy
import rostest

from train_derail.msg import CarStates

LIMIT = 150.0  # wall seconds for anything
AWKWARD = "it's a \"fine\" folder; $HOME & more"


class LaunchTest(unittest.TestCase):

    @classmethod
    def setUpClass(cls):
        cls.top = tempfile.mkdtemp(prefix='train_derail_launch_')
        cls.folder = os.path.join(cls.top, AWKWARD)
        os.mkdir(cls.folder)
        cls.scenario = os.path.join(cls.folder, 'my scenario.yaml')
        shutil.copy(rospy.get_param('~scenario_file'), cls.scenario)

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.top)

    def start(self, *command):
        process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, cwd=self.folder,
                                   env=dict(os.environ, PWD=self.folder))

        def end():
            if process.poll() is None:
                process.send_signal(signal.SIGINT)
                process.communicate(timeout=LIMIT)
            process.stdout.close()

        self.addCleanup(end)
        return process

    def done(self, *command):
        """Exit code and all that was said."""
        process = self.start(*command)
        said, _ = process.communicate(timeout=LIMIT)
        return process.returncode, said

    def sim(self, *arguments, program=('roslaunch', 'train_derail')):
        return self.done(*program, 'sim.launch', 'rviz:=false', 'rate:=0', 'exit_when_done:=true', *arguments)

    def test_a_scenario_that_is_wrong_is_no_success(self):
        for number, (change, said) in enumerate([('initial.sped=1', 'initial.sped'), ('consist[0].count=0', 'consist[0].count')]):
            code, text = self.sim('config:=' + self.scenario, 'set:=' + change)
            self.assertNotEqual(code, 0, text)
            self.assertIn(said, text)
            self.assertNotIn('process[train_derail', text, 'nothing is started')
            bad = os.path.join(self.folder, 'bad %d.yaml' % number)
            with open(bad, 'w', encoding='utf-8') as f:
                key, value = change.split('=')
                f.write('consist: [{count: %s, length: 61.1 ft, weight: 150 kip}]\n' % (value if 'count' in key else 5))
                f.write('initial: {speed: 1, yaw_rate: 0%s}\n' % (', sped: 1' if 'sped' in key else ''))
            code, text = self.sim('config:=' + bad)
            self.assertNotEqual(code, 0, text)
            self.assertIn(said, text)
        code, text = self.sim('config:=' + self.scenario, 'speed:=fast')
        self.assertNotEqual(code, 0, text)
        self.assertIn('initial.speed', text)
        code, text = self.sim('config:=' + os.path.join(self.folder, 'none.yaml'))
        self.assertNotEqual(code, 0, text)

    def test_a_base_is_found_from_the_file_that_names_it(self):
        with open(os.path.join(self.folder, 'short.yaml'), 'w', encoding='utf-8') as f:
            f.write("base: 'my scenario.yaml'\nstop: {time_max: 0.5}\n")
        for config in ('short.yaml', './short.yaml', os.path.join(self.folder, 'short.yaml')):
            code, text = self.sim('config:=' + config, program=('rosrun', 'train_derail', 'launch.py'))
            self.assertEqual(code, 0, text)
            self.assertIn('time limit reached', text)
            for alarm in ('REQUIRED', 'has died'):
                self.assertNotIn(alarm, text, 'a run that has ended as it should')

    def test_launch_py_hands_on_the_code_of_the_node(self):
        program = ('rosrun', 'train_derail', 'launch.py')
        config = 'config:=' + self.scenario
        for arguments, wanted in [((), 0), (('set:=solver.steps_max=10',), 3), (('record:=true', 'bag:=/nowhere/a.bag'), 2)]:
            code, text = self.sim(config, *arguments, program=program)
            self.assertEqual(code, wanted, text)
        code, text = self.sim(config, 'set:=initial.sped=1', program=program)
        self.assertEqual(code, 2, text)
        self.assertIn('initial.sped', text)
        code, text = self.done(*program, 'nothing.launch')
        self.assertEqual(code, 2, text)

    def test_every_path_may_hold_whatever_a_path_may_hold(self):
        results = os.path.join(self.folder, 'my results')
        code, text = self.sim('config:=' + self.scenario, 'set:=title="a; b" ; consist[0].count=5', 'results_folder:=' + results,
                              'record:=true', 'bag:=my bag.bag')
        self.assertNotEqual(code, 0, 'a text with a semicolon is two inputs: ' + text)
        code, text = self.sim('config:=' + self.scenario, 'set:=title="a b" ; consist[0].count=5', 'results_folder:=' + results,
                              'record:=true', 'bag:=my bag.bag')
        self.assertEqual(code, 0, text)
        bag = os.path.join(results, 'my bag.bag')
        with rosbag.Bag(bag) as file:
            self.assertEqual({len(m.cars) for _, m, _ in file.read_messages(['/train_derail/cars'])}, {5})
        for given in (bag, 'my results/my bag.bag'):  # from where roslaunch was called
            seen = threading.Event()
            subscriber = rospy.Subscriber('/train_derail/cars', CarStates, lambda m, s=seen: s.set())
            player = self.start('roslaunch', 'train_derail', 'replay.launch', 'rviz:=false', 'rate:=100', 'bag:=' + given)
            deadline = time.monotonic() + LIMIT
            while not seen.wait(0.1) and player.poll() is None and time.monotonic() < deadline:
                pass
            self.assertTrue(seen.is_set(), given)
            subscriber.unregister()
            player.send_signal(signal.SIGINT)
            player.communicate(timeout=LIMIT)

    def test_the_package_may_lie_anywhere(self):
        checkout = os.path.join(self.top, 'a check out', 'train_derail')
        os.makedirs(os.path.dirname(checkout))
        os.symlink(rospkg.RosPack().get_path('train_derail'), checkout)
        environment = dict(os.environ, ROS_PACKAGE_PATH=os.path.dirname(checkout) + ':/usr/share')
        for file, more in (('sim.launch', []), ('replay.launch', ['bag:=x.bag'])):
            path = os.path.join(checkout, 'launch', file)
            # What `roslaunch --args` prints, before it is joined.
            code = 'import roslaunch.node_args as a, sys; print(*a.get_node_args("rviz", [(sys.argv[1], sys.argv[2:])]), sep="\\n")'
            done = subprocess.run([sys.executable, '-c', code, path, *more], capture_output=True, text=True, check=False,
                                  timeout=LIMIT, env=environment)
            self.assertEqual(done.returncode, 0, done.stderr)
            words = done.stdout.splitlines()
            self.assertIn(os.path.join(checkout, 'rviz', 'train_derail.rviz'), words)


if __name__ == '__main__':
    rospy.init_node('test_ros_launch')
    rostest.rosrun('train_derail', 'test_ros_launch', LaunchTest, sys.argv)
