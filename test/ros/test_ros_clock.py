#!/usr/bin/python3
"""/clock: two that publish it are found out, and it does not stand still when a run is over."""

import signal
import subprocess
import sys
import time
import unittest

import roslib.packages
import rospy
import rostest
import yaml
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rosgraph_msgs.msg import Clock, Log
from std_srvs.srv import Trigger
from tf2_msgs.msg import TFMessage

import waiting
from train_derail.msg import RunInfo
from train_derail.srv import Restart

LIMIT = 150.0  # wall seconds for anything


def wait_for(condition, limit=LIMIT):
    return waiting.wait_for(condition, limit)


class ClockTest(unittest.TestCase):

    def start(self, name, **parameters):
        with open(rospy.get_param('~scenario_file'), encoding='utf-8') as f:
            rospy.set_param('/' + name, dict(parameters, diagnostics_period=0.1, scenario=yaml.safe_load(f)))
        program = roslib.packages.find_node('train_derail', 'train_derail_node')[0]
        process = subprocess.Popen([program, '__name:=' + name], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)

        def end():
            if process.poll() is None:
                process.kill()
            process.wait()

        self.addCleanup(end)
        rospy.wait_for_service('/' + name + '/restart', LIMIT)
        return process

    def subscribe(self, topic, kind):
        """A list that all messages of a topic are added to."""
        seen = []
        subscriber = rospy.Subscriber(topic, kind, seen.append, queue_size=None)
        self.addCleanup(subscriber.unregister)
        return seen

    def test_two_publishers_are_found_out_and_so_is_the_end_of_it(self):
        info = self.subscribe('/first/run_info', RunInfo)
        diagnostics = self.subscribe('/diagnostics', DiagnosticArray)
        log = self.subscribe('/rosout', Log)

        def health():
            mine = [s for a in diagnostics for s in a.status if s.name == '/first: simulation']
            return (mine[-1].level, mine[-1].message) if mine else (None, '')

        def said(text):
            return any(m.name == '/first' and text in m.msg for m in log)

        # Paused and silent, it is a second publisher all the same.
        first = self.start('first', start_paused=True)
        self.assertTrue(wait_for(lambda: info and health()[0] == DiagnosticStatus.OK))
        self.assertEqual(info[-1].clock_publishers, [])
        for how in (signal.SIGINT, signal.SIGKILL):  # one that is killed stays known to the master
            name = 'second_%d' % how
            second = self.start(name, start_paused=True)
            self.assertTrue(wait_for(lambda n=name: info[-1].clock_publishers == ['/first', '/' + n]), info[-1])
            self.assertTrue(wait_for(lambda n=name: health()[0] == DiagnosticStatus.ERROR and '/' + n in health()[1]), health())
            self.assertIn('time jumps', health()[1])
            self.assertTrue(wait_for(lambda n=name: said('/clock is published by /first and /' + n)))
            second.send_signal(how)
            second.wait(LIMIT)
            self.assertTrue(wait_for(lambda: info[-1].clock_publishers == [] and health()[0] == DiagnosticStatus.OK), how)
            self.assertTrue(wait_for(lambda: said('by one node again')))
            log.clear()
        self.assertIsNone(first.poll())

    def test_a_second_one_that_publishes_none_is_no_rival(self):
        info = self.subscribe('/only/run_info', RunInfo)
        quiet = self.subscribe('/quiet/run_info', RunInfo)
        self.start('only', start_paused=True)
        self.start('quiet', start_paused=True, publish={'clock': False})
        third = self.start('third', start_paused=True)
        self.assertTrue(wait_for(lambda: info and info[-1].clock_publishers == ['/only', '/third']))
        self.assertTrue(wait_for(lambda: quiet and quiet[-1].clock_publishers == ['/only', '/third']), 'it is led astray as well')
        third.terminate()
        self.assertTrue(wait_for(lambda: info[-1].clock_publishers == quiet[-1].clock_publishers == []))

    def test_time_goes_on_after_the_end_and_stands_in_a_pause(self):
        clocks = self.subscribe('/clock', Clock)
        frames = self.subscribe('/tf', TFMessage)
        info = self.subscribe('/ended/run_info', RunInfo)
        self.start('ended', rate=0, start_paused=True)

        def now():
            return clocks[-1].clock.to_sec()

        self.assertTrue(wait_for(lambda: clocks and info))
        count = len(clocks)
        answer = rospy.ServiceProxy('/ended/pause', Trigger)()
        self.assertTrue(answer.success)
        self.assertTrue(rospy.ServiceProxy('/ended/resume', Trigger)().success)
        self.assertTrue(wait_for(lambda: info[-1].state == RunInfo.ENDED))
        end = info[-1].start.to_sec() + info[-1].time
        self.assertGreater(len(clocks), count)
        begin = time.monotonic()
        self.assertTrue(wait_for(lambda: now() > end + 2.0))
        self.assertGreater(time.monotonic() - begin, 1.0, 'paced by the wall')
        last = frames[-1].transforms
        self.assertTrue(wait_for(lambda: frames[-1].transforms[0].header.stamp.to_sec() > end + 2.0), 'who asks tf for now gets it')
        self.assertEqual([t.transform for t in last], [t.transform for t in frames[-1].transforms])
        self.assertEqual(info[-1].state, RunInfo.ENDED)
        self.assertEqual(info[-1].time, 3.0)

        # The next run begins later than all that; paused, time stands.
        restart = rospy.ServiceProxy('/ended/restart', Restart)
        self.assertTrue(restart(start_paused=True).success)
        self.assertTrue(wait_for(lambda: info[-1].run_id == 2))
        self.assertTrue(wait_for(lambda: clocks[-1].clock == info[-1].start))
        stands = len(clocks)
        self.assertFalse(wait_for(lambda: len(clocks) > stands, 1.0))
        stamps = [c.clock for c in clocks]
        self.assertEqual(stamps, sorted(set(stamps)), 'never back')


if __name__ == '__main__':
    rospy.init_node('test_ros_clock')
    rostest.rosrun('train_derail', 'test_ros_clock', ClockTest, sys.argv)
