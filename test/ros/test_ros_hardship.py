#!/usr/bin/python3
"""What a simulator that people leave running has to stand: restart storms, subscribers that stop reading, a dead master."""

import os
import random
import re
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

import waiting
from train_derail.msg import CarStates, Outcome, RunInfo
from train_derail.srv import Restart

LIMIT = 150.0  # wall seconds for anything


def wait_for(condition, limit=LIMIT):
    return waiting.wait_for(condition, limit)


def free_port():
    with socket.socket() as s:
        s.bind(('localhost', 0))
        return s.getsockname()[1]


def status(process, field):
    """Of /proc: VmRSS in kB, Threads."""
    with open('/proc/%d/status' % process.pid, encoding='ascii') as f:
        return next(int(line.split()[1]) for line in f if line.startswith(field + ':'))


class Texts:
    """Scenarios and overrides that somebody might send: good, nearly good, and hostile ones."""

    def __init__(self, good, rng):
        self.good, self.rng = good, rng
        derail = roslib.packages.find_node('train_derail', 'derail')[0]
        keys = subprocess.run([derail, 'keys'], capture_output=True, text=True, check=True).stdout
        self.keys = [k.replace('[i]', '[0]') for k in re.findall(r'^([a-z_]\S*)$', keys, re.MULTILINE)]
        self.kinds = [self.as_it_is, self.changed, self.extreme, self.noise, self.deep, self.aliases, self.huge,
                      self.many_overrides, self.control]
        self.weights = [4, 4, 6, 4, 2, 2, 1, 1, 2]

    def draw(self):
        kind = self.rng.choices(self.kinds, self.weights)[0]
        return (kind.__name__, *kind())

    def value(self):
        return self.rng.choice(['0', '-1', '1', '1e-300', '1e300', '.inf', '.nan', '1e9', '2147483648', 'true', '~', '[]', '{}',
                                '3 kg', '5 mph', '1e-9', '0.5', 'x' * self.rng.randrange(1, 2000), repr(self.rng.uniform(-100, 100))])

    def as_it_is(self):
        return '', ['consist[0].count=%d' % self.rng.randrange(1, 40)]

    def changed(self):
        text = list(self.good)
        for _ in range(self.rng.randrange(1, 6)):
            text[self.rng.randrange(len(text))] = chr(self.rng.randrange(32, 127))
        return ''.join(text), []

    def extreme(self):
        return self.good, ['%s=%s' % (self.rng.choice(self.keys), self.value()) for _ in range(self.rng.randrange(1, 4))]

    def noise(self):
        letters = ''.join(chr(i) for i in range(1, 128)) + '\n' * 20 + ': ' * 10 + '\xe4\u20ac'
        return ''.join(self.rng.choices(letters, k=self.rng.randrange(1, 3000))), []

    def deep(self):
        depth = self.rng.choice([10, 1000, 100000, 400000])
        return self.rng.choice(['[', '{a: ', '- ', '? ', '!!a ', '"', '&a *a ', '- - [']) * depth, []

    def aliases(self):
        """Each line ten of the line before: a billion of the first."""
        lines = ['a0: &a0 [x, x, x]']
        for i in range(1, self.rng.choice([3, 12, 3000])):
            lines.append('a%d: &a%d [%s]' % (i, i, ', '.join(['*a%d' % (i - 1)] * self.rng.choice([1, 10]))))
        return '\n'.join(lines), []

    def huge(self):
        size = self.rng.choice([1 << 20, 11 << 20])
        part = self.rng.choice(['a', '- x\n', 'k: {a: 1}\n', '[', '\n', self.good])
        return part * (size // len(part)), []

    def many_overrides(self):
        return '', ['consist[0].count=5'] * self.rng.choice([100, 20000, 200000])

    def control(self):
        return 'title: "\x1b[2J\x07 \x00"\n\x1b]0;owned\x07: 1\n', ['title="\x1b[31m"', '\x1b[2J=\x1b[2J']


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
        # The heap of a process breathes by a megabyte; 1000 runs that are kept, of 20 kB or more each, are 20 of them.
        self.assertLess(status(node, 'VmRSS') - memory, 4096, 'kB more after 1000 restarts')

    def test_restarts_with_whatever_text_leave_the_node_alive_and_lean(self):
        """RESTARTS=10000 in the environment for as many."""
        count = int(os.environ.get('RESTARTS', '300'))
        node = self.start_node('battered', {'rate': 0, 'start_paused': True})
        rospy.wait_for_service('/battered/restart', LIMIT)
        restart = rospy.ServiceProxy('/battered/restart', Restart, persistent=True)
        with open(rospy.get_param('~scenario_file'), encoding='utf-8') as f:
            texts = Texts(f.read(), random.Random(1))
        self.assertTrue(restart(start_paused=True).success)
        begin, worst, slowest, taken = status(node, 'VmRSS'), 0, 0.0, 0
        for i in range(count):
            kind, scenario, overrides = texts.draw()
            asked = time.monotonic()
            answer = restart(scenario=scenario, overrides=overrides, start_paused=True)
            seconds = time.monotonic() - asked
            taken += answer.success
            self.assertIsNone(node.poll(), kind)
            self.assertLess(len(answer.message), 5000, kind)
            self.assertNotRegex(answer.message, '[\x00-\x08\x0b-\x1f]', kind)
            # What aliases blow up would take minutes; a busy machine takes seconds.
            self.assertLess(seconds, 30.0, '%s, restart %d: %s' % (kind, i, answer.message[:200]))
            slowest = max(slowest, seconds)
            worst = max(worst, status(node, 'VmRSS') - begin)
            self.assertLess(worst, 64 * 1024, '%s, restart %d: kB more than at the start' % (kind, i))
        print('%d restarts, %d of them taken: slowest answer %.3f s, at most %d kB more than at the start, %d kB at the end'
              % (count, taken, slowest, worst, status(node, 'VmRSS') - begin), file=sys.stderr)
        self.assertGreater(taken, count // 20)
        self.assertGreater(count - taken, count // 3)
        node.send_signal(signal.SIGTERM)
        self.assertEqual(node.wait(2.0), 0)

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
