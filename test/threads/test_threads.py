#!/usr/bin/python3
"""The node, built with the thread sanitizer, under everything at once: services from many threads, subscribers, a bag,
an interrupt. Not one data race may be reported.

  test_threads.py path/to/train_derail_node
"""

import os
import random
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
import unittest

import rospy
from std_srvs.srv import Trigger

from train_derail.msg import CarStates, CouplerForces, Outcome, RunInfo
from train_derail.srv import GetInputs, Restart, SetRate, Step

NODE = os.path.abspath(sys.argv[1])
LIMIT = 120.0  # wall seconds for anything
HERE = os.path.dirname(os.path.abspath(__file__))


class ThreadsTest(unittest.TestCase):

    def setUp(self):
        with socket.socket() as s:
            s.bind(('localhost', 0))
            port = s.getsockname()[1]
        self.environment = dict(os.environ, ROS_MASTER_URI='http://localhost:%d' % port, ROS_HOSTNAME='localhost')
        os.environ.update(self.environment)
        # ROS itself comes without the sanitizer: what its modules lock is not looked at.
        self.environment['TSAN_OPTIONS'] = 'ignore_noninstrumented_modules=1'
        libraries = os.path.join(os.path.dirname(NODE), '..', '..', 'lib')
        self.environment['LD_LIBRARY_PATH'] = libraries + ':' + self.environment.get('LD_LIBRARY_PATH', '')
        self.master = self.start(['rosmaster', '--core', '-p', str(port)], stdout=subprocess.DEVNULL)
        self.load()

    def start(self, command, **options):
        process = subprocess.Popen(command, env=self.environment, **options)

        def end():
            if process.poll() is None:
                process.kill()
            process.wait()

        self.addCleanup(end)
        return process

    def load(self):
        deadline = time.monotonic() + LIMIT
        scenario = os.path.join(HERE, '..', 'ros', 'scenario.yaml')
        while subprocess.run(['rosparam', 'load', scenario, '/train_derail/scenario'], env=self.environment, check=False,
                             stderr=subprocess.DEVNULL).returncode != 0:
            self.assertLess(time.monotonic(), deadline, 'no master')

    def test_no_data_races(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        with tempfile.TemporaryFile('w+') as said:
            node = self.start([NODE, '_rate:=0', '_results_folder:=' + folder.name, '_bag:=a.bag', '_diagnostics_period:=0.05'],
                              stdout=subprocess.DEVNULL, stderr=said)
            rospy.init_node('test_threads', disable_signals=True)
            seen = {}
            for topic, kind in (('cars', CarStates), ('couplers', CouplerForces), ('outcome', Outcome), ('run_info', RunInfo)):
                rospy.Subscriber('/train_derail/' + topic, kind, lambda m, t=topic: seen.update({t: seen.get(t, 0) + 1}))
            rospy.wait_for_service('/train_derail/get_inputs', LIMIT)
            failures = []

            def hammer(seed):
                choose = random.Random(seed)
                calls = {
                    'pause': (Trigger, lambda: {}),
                    'resume': (Trigger, lambda: {}),
                    'step': (Step, lambda: {'ticks': choose.randint(1, 5)}),
                    'set_rate': (SetRate, lambda: {'rate': choose.choice([0.0, 0.5, 10.0])}),
                    'get_inputs': (GetInputs, lambda: {}),
                    'restart': (Restart, lambda: {'overrides': ['consist[0].count=%d' % choose.randint(1, 30)],
                                                  'start_paused': choose.random() < 0.3}),
                }
                proxies = {name: rospy.ServiceProxy('/train_derail/' + name, kind) for name, (kind, _) in calls.items()}
                for _ in range(60):
                    name = choose.choice(list(calls))
                    try:
                        proxies[name](**calls[name][1]())
                    except rospy.ServiceException as e:
                        failures.append('%s: %s' % (name, e))

            threads = [threading.Thread(target=hammer, args=(seed,)) for seed in range(4)]
            for thread in threads:
                thread.start()
            for thread in threads:
                thread.join(LIMIT)
                self.assertFalse(thread.is_alive(), 'a service does not answer')
            self.assertEqual(failures, [])
            self.assertIsNone(node.poll(), 'the node has died')
            node.send_signal(signal.SIGINT)
            code = node.wait(timeout=LIMIT)
            said.seek(0)
            errors = said.read()
            begin = errors.find('WARNING: ThreadSanitizer')
            self.assertEqual(begin, -1, errors[begin:begin + 5000])
            self.assertEqual(code, 0, errors[-2000:])
            self.assertGreater(min(seen.get(t, 0) for t in ('cars', 'couplers', 'outcome', 'run_info')), 10)


if __name__ == '__main__':
    unittest.main(argv=sys.argv[:1], verbosity=2)
