#!/usr/bin/python3
"""What a simulator that people leave running has to stand: restart storms, subscribers that stop reading, a dead master."""

import os
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
import unittest

import roslib.packages
import rospy
import rostest
import yaml
from std_srvs.srv import Trigger

from train_derail.msg import CarStates, Outcome, RunInfo
from train_derail.srv import Restart

LIMIT = 20.0  # wall seconds for anything


def wait_for(condition, limit=LIMIT):
    """Whether the condition came true in time; asked over and over."""
    deadline = time.monotonic() + limit
    pause = threading.Event()
    while not condition():
        if time.monotonic() > deadline:
            return False
        pause.wait(0.02)
    return True


def free_port():
    with socket.socket() as s:
        s.bind(('localhost', 0))
        return s.getsockname()[1]


def status(process, field):
    """Of /proc: VmRSS in kB, Threads."""
    with open('/proc/%d/status' % process.pid, encoding='ascii') as f:
        return next(int(line.split()[1]) for line in f if line.startswith(field + ':'))


class HardshipTest(unittest.TestCase):

    def start(self, command, **options):
        process = subprocess.Popen(command, text=True, **options)

        def end():
            process.send_signal(signal.SIGCONT)
            if process.poll() is None:
                process.kill()
            process.wait()
            if process.stdout:
                process.stdout.close()

        self.addCleanup(end)
        return process

    def start_node(self, name, parameters, **options):
        with open(rospy.get_param('~scenario_file'), encoding='utf-8') as f:
            rospy.set_param('/' + name, dict(parameters, scenario=yaml.safe_load(f)))
        program = roslib.packages.find_node('train_derail', 'train_derail_node')[0]
        return self.start([program, '__name:=' + name], **options)

    @staticmethod
    def says(process, text):
        """Whether a line with `text` comes in time."""
        found = threading.Event()
        threading.Thread(target=lambda: any(text in line for line in process.stdout) and found.set(), daemon=True).start()
        return found.wait(LIMIT)

    def test_a_thousand_restarts_leave_nothing_behind(self):
        node = self.start_node('restarted', {'rate': 0, 'start_paused': True})
        rospy.wait_for_service('/restarted/restart', LIMIT)
        restart = rospy.ServiceProxy('/restarted/restart', Restart, persistent=True)
        last = {}
        rospy.Subscriber('/restarted/run_info', RunInfo, lambda m: last.update(run_id=m.run_id))

        def storm(count):
            for i in range(count):
                # Some wait, some run, some are cut short by the next; lengths differ.
                answer = restart(overrides=['consist[0].count=%d' % (5 + i % 20)], start_paused=i % 3 == 0)
                self.assertTrue(answer.success, answer.message)
            self.assertTrue(wait_for(lambda: last.get('run_id') == answer.run_id))

        storm(200)
        memory, threads = status(node, 'VmRSS'), status(node, 'Threads')
        storm(1000)
        self.assertEqual(last['run_id'], 1201)
        self.assertEqual(status(node, 'Threads'), threads)
        self.assertLess(status(node, 'VmRSS') - memory, 1024, 'kB more after 1000 restarts')

    def test_it_ends_within_two_seconds_whatever_it_is_doing(self):
        long_step = 'consist[0].count=300; output.interval=10; stop.time_max=10; solver.method=semi_implicit; solver.fixed_step=1e-5'
        for name, parameters, request in [
                ('in_a_step', {'rate': 0, 'set': long_step}, None),
                ('restarting', {'rate': 1}, {'scenario': 'a: [' + 'x, ' * 300000 + ']'}),
                ('stepping', {'rate': 0.001}, {'overrides': long_step.split('; ')}),
        ]:
            for which in (signal.SIGTERM, signal.SIGINT):
                node = self.start_node('%s_%d' % (name, which), parameters)
                service = '/%s_%d/restart' % (name, which)
                rospy.wait_for_service(service, LIMIT)
                if request:
                    threading.Thread(target=self.ask, args=(service, request), daemon=True).start()
                node.send_signal(which)
                self.assertEqual(node.wait(2.0), 0, name)

    @staticmethod
    def ask(service, request):
        try:
            rospy.ServiceProxy(service, Restart)(**request)
        except rospy.ServiceException:
            pass  # it ends meanwhile

    def test_a_long_step_does_not_keep_anybody_waiting(self):
        self.start_node('long', {'rate': 0, 'set': 'consist[0].count=300; output.interval=10; stop.time_max=10; solver.method=semi_implicit; solver.fixed_step=1e-5'})
        rospy.wait_for_service('/long/pause', LIMIT)
        for service in ('/long/pause', '/long/resume', '/long/pause'):
            asked = time.monotonic()
            answer = rospy.ServiceProxy(service, Trigger)()
            self.assertTrue(answer.success, answer.message)
            self.assertLess(time.monotonic() - asked, 1.0)

    def test_a_subscriber_that_stops_reading_holds_nobody_up(self):
        node = self.start_node('unheard', {'rate': 0, 'start_paused': True, 'set': 'consist[0].count=100; stop.time_max=30'})
        rospy.wait_for_service('/unheard/resume', LIMIT)
        deaf = self.start(['rostopic', 'echo', '-p', '/unheard/couplers'], stdout=subprocess.PIPE)
        self.assertIn('time', deaf.stdout.readline())
        self.assertTrue(deaf.stdout.readline())  # connected: it has had the latched message
        deaf.send_signal(signal.SIGSTOP)
        seen, done = [], []
        rospy.Subscriber('/unheard/cars', CarStates, lambda m: seen.append(m.time), queue_size=None)
        rospy.Subscriber('/unheard/outcome', Outcome, done.append)
        self.assertTrue(wait_for(lambda: seen and done))
        self.assertTrue(rospy.ServiceProxy('/unheard/resume', Trigger)().success)
        self.assertTrue(wait_for(lambda: done[-1].ended != Outcome.RUNNING))
        self.assertTrue(wait_for(lambda: seen[-1] == done[-1].stop_time))
        self.assertEqual(seen, sorted(seen))
        # Its queue is bounded: 1000 messages of 100 couplers are some 10 MB.
        self.assertLess(status(node, 'VmHWM'), 150000)
        deaf.send_signal(signal.SIGCONT)
        last = repr(seen[-1])
        self.assertTrue(self.says(deaf, last), 'the last message still comes')

    def test_the_run_outlives_its_master(self):
        port = free_port()
        environment = dict(os.environ, ROS_MASTER_URI='http://localhost:%d' % port)
        silent = {'stdout': subprocess.DEVNULL, 'stderr': subprocess.DEVNULL}
        master_command = ['rosmaster', '--core', '-p', str(port)]
        master = self.start(master_command, env=environment, **silent)
        here = rospy.get_param('~scenario_file')
        self.assertTrue(wait_for(lambda: subprocess.run(
            ['rosparam', 'load', here, '/kept/scenario'], env=environment, check=False, **silent).returncode == 0))
        with tempfile.TemporaryFile('w+') as errors:
            program = roslib.packages.find_node('train_derail', 'train_derail_node')[0]
            node = self.start([program, '__name:=kept', '_rate:=0.05'], env=environment, stdout=subprocess.DEVNULL,
                              stderr=errors)
            listener = self.start(['rostopic', 'echo', '-p', '/kept/cars/time'], env=environment, stdout=subprocess.PIPE)

            def next_time():
                return float(listener.stdout.readline().split(',')[-1])

            self.assertIn('field', listener.stdout.readline())
            before = next_time()
            master.kill()
            master.wait()
            self.assertGreater(next_time(), before)
            self.start(master_command, env=environment, **silent)
            self.assertTrue(wait_for(lambda: subprocess.run(
                ['rosparam', 'list'], env=environment, check=False, **silent).returncode == 0))
            before = next_time()
            self.assertGreater(next_time(), before)
            self.assertIsNone(node.poll())
            node.send_signal(signal.SIGINT)
            self.assertEqual(node.wait(timeout=LIMIT), 0)


if __name__ == '__main__':
    rospy.init_node('test_ros_hardship')
    rostest.rosrun('train_derail', 'test_ros_hardship', HardshipTest, sys.argv)
