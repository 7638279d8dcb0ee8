#!/usr/bin/python3
"""Bags: recorded by sim.launch, written by derail without a master, replayed; real rosbag tools on all of them."""

import fcntl
import io
import os
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import unittest
import xmlrpc.client

import rosbag
import roslib.packages
import rosgraph
import rospkg
import rospy
import rostest
from rosgraph_msgs.msg import Clock
from std_srvs.srv import SetBool, Trigger
from visualization_msgs.msg import MarkerArray

import kill_bag
import waiting
from train_derail.msg import CarStates, CouplerForces

LIMIT = 150.0  # wall seconds for anything


def wait_for(condition, limit=LIMIT):
    return waiting.wait_for(condition, limit)


def program(name):
    return roslib.packages.find_node('train_derail', name)[0]


def contents(path):
    """Every topic's messages as they were serialised, with their times of reception."""
    topics = {}
    with rosbag.Bag(path) as bag:
        for topic, message, stamp in bag.read_messages(raw=True):
            topics.setdefault(topic, []).append((stamp.to_nsec(), message[1]))
    return topics


class BagTest(unittest.TestCase):

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.mkdtemp(prefix='train_derail_bags_')
        cls.scenario = rospy.get_param('~scenario_file')
        cls.bag = os.path.join(cls.folder, 'offline.bag')
        environment = dict(os.environ, ROS_MASTER_URI='http://localhost:1')  # nobody there
        subprocess.run([program('derail'), 'run', cls.scenario, '--quiet', '--bag', cls.bag], check=True,
                       env=environment, timeout=LIMIT)
        cls.offline = contents(cls.bag)

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.folder)

    def path(self, name):
        return os.path.join(self.folder, name)

    def start(self, command, **options):
        process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, **options)

        def end():
            if process.poll() is None:
                process.send_signal(signal.SIGINT)
                try:
                    process.communicate(timeout=15.0)
                except subprocess.TimeoutExpired:
                    process.kill()
                    process.communicate()
            process.stdout.close()

        self.addCleanup(end)
        return process

    def launch(self, file, *arguments):
        if file == 'sim.launch':
            arguments = ('results_folder:=' + self.folder, *arguments)
        return self.start(['roslaunch', 'train_derail', file, 'rviz:=false', *arguments], cwd=self.folder,
                          env=dict(os.environ, PWD=self.folder))

    def record(self, name, scenario=None, changes=()):
        process = self.launch('sim.launch', 'config:=' + (scenario or self.scenario), 'set:=' + ';'.join(changes), 'rate:=0',
                              'exit_when_done:=true', 'record:=true', 'bag:=' + name)
        output, _ = process.communicate(timeout=LIMIT)
        self.assertEqual(process.returncode, 0, output)
        return contents(self.path(name))

    def test_the_offline_bag_is_complete_and_reads_well(self):
        ticks = len(self.offline['/train_derail/cars'])
        self.assertEqual(ticks, 151)  # 3 s at 50 Hz, both ends
        for topic in ('/tf', '/train_derail/couplers', '/train_derail/markers'):
            self.assertEqual(len(self.offline[topic]), ticks, topic)
            self.assertEqual([t for t, _ in self.offline[topic]], [t for t, _ in self.offline['/train_derail/cars']])
        for topic in ('/tf_static', '/train_derail/inputs', '/train_derail/impacts'):
            self.assertEqual(len(self.offline[topic]), 1, topic)
        self.assertEqual(len(self.offline['/train_derail/run_info']), 2)
        self.assertIn('/train_derail/events', self.offline)
        self.assertNotIn('/clock', self.offline)
        info = subprocess.run(['rosbag', 'info', self.bag], capture_output=True, text=True, check=True, timeout=LIMIT)
        self.assertIn('train_derail/CarStates', info.stdout)
        with rosbag.Bag(self.bag) as bag:
            self.assertAlmostEqual(bag.get_end_time() - bag.get_start_time(), 3.0)
            latched = {c.topic: c.header['latching'] for c in bag._get_connections()}
        self.assertEqual(latched['/train_derail/inputs'], b'1')
        self.assertEqual(latched['/train_derail/events'], b'0')

    def test_recorded_twice_and_written_offline_are_equal(self):
        first, second = self.record('first.bag'), self.record('second.bag')
        self.assertEqual(first, second)
        self.assertEqual(first, self.offline)

    def test_an_accident_recorded_and_written_offline_are_equal(self):
        scenario = os.path.join(rospkg.RosPack().get_path('train_derail'), 'config/accident.yaml')
        changes = ('consist[1].count=21', 'initial.cars_ahead=4', 'stop.time_max=15', 'output.interval=0.1')
        offline = self.path('accident_offline.bag')
        subprocess.run([program('derail'), 'run', scenario, *('--set=' + c for c in changes), '--quiet', '--bag', offline],
                       check=True, timeout=LIMIT)
        self.assertEqual(self.record('accident.bag', scenario, changes), contents(offline))
        with rosbag.Bag(offline) as bag:
            impacts = [m for _, m, _ in bag.read_messages(['/train_derail/impacts'])]
        self.assertEqual((impacts[0].time, impacts[0].impacts), (0.0, []))
        self.assertGreater(len(impacts), 3)
        for before, after in zip(impacts, impacts[1:]):
            self.assertNotEqual(before.impacts, after.impacts, 'sent when it has changed')
            if after is not impacts[-1]:
                self.assertGreater(after.time - before.time, 0.99, 'at most once a second')

    def test_a_bag_of_rosbag_record_holds_the_same(self):
        topics = ['/tf', '/train_derail/cars', '/train_derail/couplers', '/train_derail/markers']
        recorder = self.start(['rosbag', 'record', '-O', self.path('outside.bag'), '__name:=recorder', *topics])
        # Not faster: the recorder's own queue holds 100 messages.
        self.launch('sim.launch', 'config:=' + self.scenario, 'rate:=1', 'start_paused:=true')
        # Once connected the recorder has what is latched, and misses nothing of the run.
        self.assertTrue(wait_for(lambda: all(self.received('/recorder', t) > 0 for t in topics)))
        rospy.wait_for_service('/train_derail/resume', LIMIT)
        self.assertTrue(rospy.ServiceProxy('/train_derail/resume', Trigger)().success)
        self.assertTrue(wait_for(lambda: all(self.received('/recorder', t) >= len(self.offline[t]) for t in topics)))
        recorder.send_signal(signal.SIGINT)
        recorder.communicate(timeout=LIMIT)
        with rosbag.Bag(self.path('outside.bag')) as outside, rosbag.Bag(self.bag) as ours:
            for topic in topics:
                # roscpp may send the latched message twice to who connects while it is published.
                a = list(dict.fromkeys(self.plain(m) for _, m, _ in outside.read_messages([topic])))
                b = [self.plain(m) for _, m, _ in ours.read_messages([topic])]
                self.assertEqual(a[:len(b)], b, topic)
                # After the end tf goes on with the clock; that is none of the run's, and in no bag of ours.
                if topic != '/tf':
                    self.assertEqual(len(a), len(b), topic)

    @staticmethod
    def received(node, topic):
        """How many messages of a topic a node has had, as it says itself; 0 if it is not there."""
        try:
            uri = rosgraph.Master('/test').lookupNode(node)
            _, subscriptions = xmlrpc.client.ServerProxy(uri).getBusStats('/test')
        except (OSError, rosgraph.MasterError):
            return 0
        return sum(c[2] for name, connections in subscriptions if name == topic for c in connections)

    @staticmethod
    def plain(message):
        """As bytes, but for the number that roscpp gives to what it publishes."""
        if hasattr(message, 'header'):
            message.header.seq = 0
        buffer = io.BytesIO()
        message.serialize(buffer)
        return buffer.getvalue()

    def test_an_interrupt_closes_the_bag_whole(self):
        process = self.launch('sim.launch', 'config:=' + self.scenario, 'rate:=0.2', 'record:=true', 'bag:=cut.bag')
        seen = []
        subscriber = rospy.Subscriber('/train_derail/cars', CarStates, lambda m: seen.append(m.time))
        self.assertTrue(wait_for(lambda: seen and seen[-1] > 0.1))
        subscriber.unregister()
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=LIMIT)
        self.assertFalse(os.path.exists(self.path('cut.bag.active')))
        cut = contents(self.path('cut.bag'))
        for topic in ('/tf', '/train_derail/cars', '/train_derail/couplers', '/train_derail/markers'):
            self.assertGreater(len(cut[topic]), 5)
            self.assertLess(len(cut[topic]), 151)
            self.assertEqual(cut[topic], self.offline[topic][:len(cut[topic])], topic)

    def test_replay_equals_the_run(self):
        cars, couplers, markers, clocks = [], [], [], []
        self.launch('replay.launch', 'bag:=offline.bag', 'pause:=true', 'rate:=5')
        subscribers = [
            rospy.Subscriber('/train_derail/cars', CarStates, cars.append),
            rospy.Subscriber('/train_derail/couplers', CouplerForces, couplers.append),
            rospy.Subscriber('/train_derail/markers', MarkerArray, markers.append),
            rospy.Subscriber('/clock', Clock, lambda m: clocks.append(m.clock)),
        ]
        self.assertTrue(wait_for(lambda: all(s.get_num_connections() > 0 for s in subscribers)))
        rospy.wait_for_service('/player/pause_playback', LIMIT)
        self.assertTrue(rospy.ServiceProxy('/player/pause_playback', SetBool)(False).success)
        last = len(self.offline['/train_derail/markers'])
        self.assertTrue(wait_for(lambda: cars and couplers and cars[-1].time >= 3.0 and couplers[-1].time >= 3.0
                                 and len(markers) >= last - 1))
        publishers = {t: nodes for t, nodes in rosgraph.Master('/test').getSystemState()[0]}
        self.assertEqual(publishers['/clock'], ['/player'])
        self.assertNotIn('/train_derail/pause', dict(rosgraph.Master('/test').getSystemState()[2]))
        for subscriber in subscribers:
            subscriber.unregister()
        self.assertEqual(clocks, sorted(clocks))
        with rosbag.Bag(self.bag) as bag:
            for topic, seen in (('/train_derail/cars', cars), ('/train_derail/couplers', couplers),
                                ('/train_derail/markers', markers)):
                expected = [self.plain(m) for _, m, _ in bag.read_messages([topic])]
                self.assertEqual([self.plain(m) for m in seen], expected[-len(seen):], topic)
                self.assertGreaterEqual(len(seen), len(expected) - 1)

    def test_replay_begins_where_it_is_told_to(self):
        self.launch('replay.launch', 'bag:=offline.bag', 'start:=2')
        self.assertGreaterEqual(rospy.wait_for_message('/train_derail/cars', CarStates, LIMIT).time, 2.0)

    def test_no_bag_is_written_over(self):
        bag, active = self.path('once.bag'), self.path('once.bag.active')

        def run(*arguments):
            return subprocess.run([program('derail'), 'run', self.scenario, '--quiet', '--set', 'stop.time_max=0.5', *arguments],
                                  capture_output=True, text=True, timeout=LIMIT, check=False)

        self.assertEqual(run('--bag', bag).returncode, 0)
        with open(bag, 'rb') as file:
            before = file.read()
        again = run('--bag', bag)
        self.assertEqual((again.returncode, again.stderr.count('exists already')), (1, 1), again.stderr)
        with open(bag, 'rb') as file:
            self.assertEqual(file.read(), before)
        self.assertEqual(run('--force', '--bag', bag).returncode, 0)

        # What a kill of the node leaves can be made whole; derail leaves it alone.
        os.rename(bag, active)
        self.assertEqual(run('--bag', bag).returncode, 0)
        os.remove(bag)
        arguments = ('config:=' + self.scenario, 'rate:=0', 'exit_when_done:=true', 'record:=true', 'bag:=once.bag')
        left = self.launch('sim.launch', *arguments).communicate(timeout=LIMIT)[0]
        self.assertIn('rosbag reindex', left)
        self.assertEqual((os.path.exists(active), os.path.exists(bag)), (True, False))
        with open(active, 'rb') as file:
            self.assertEqual(file.read(), before)
            fcntl.flock(file, fcntl.LOCK_EX)
            self.assertIn('another process', self.launch('sim.launch', *arguments).communicate(timeout=LIMIT)[0])
        null = run('--bag', '/dev/null')
        self.assertEqual((null.returncode, null.stderr.count('is not a file')), (1, 1), null.stderr)
        self.assertEqual(run('--bag', '-').returncode, 2)

    def test_after_a_kill_the_same_command_gives_the_same_bag(self):
        kill_bag.kill_at_moments([program('derail'), 'run', self.scenario], 10)

    def test_an_interrupted_bag_is_whole(self):
        bag = self.path('interrupted.bag')
        scenario = os.path.join(rospkg.RosPack().get_path('train_derail'), 'config/accidents/lac_megantic_2013.yaml')
        process = subprocess.Popen([program('derail'), 'run', scenario, '--quiet', '--bag', bag], stderr=subprocess.PIPE, text=True)
        self.assertTrue(wait_for(lambda: self.writes_below(process.pid, self.folder) or process.poll() is not None))
        process.send_signal(signal.SIGINT)
        said = process.communicate(timeout=LIMIT)[1]
        self.assertEqual(process.returncode, 130, said)
        self.assertIn(bag, said)
        self.assertIn('/train_derail/outcome', contents(bag))

    @staticmethod
    def writes_below(pid, folder):
        """Whether a process has a file open there, with a name or without, that is no longer empty."""
        descriptors = f'/proc/{pid}/fd'
        try:
            links = [os.path.join(descriptors, d) for d in os.listdir(descriptors)]
            return any(os.readlink(d).startswith(folder + '/') and os.stat(d).st_size > 0 for d in links)
        except OSError:  # closed meanwhile
            return False

    def test_what_cannot_be_written_is_said(self):
        process = self.launch('sim.launch', 'config:=' + self.scenario, 'rate:=0', 'exit_when_done:=true', 'record:=true',
                              'bag:=/nowhere/a.bag')
        output, _ = process.communicate(timeout=LIMIT)
        self.assertIn('/nowhere/a.bag', output)
        self.assertIn('exit code 2', output)
        derail = [program('derail'), 'run', self.scenario, '--quiet', '--bag']
        done = subprocess.run(derail + ['/nowhere/a.bag'], capture_output=True, text=True, timeout=LIMIT)
        self.assertEqual(done.returncode, 1)
        self.assertIn('/nowhere/a.bag', done.stderr)

        def small_disk():
            signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
            resource.setrlimit(resource.RLIMIT_FSIZE, (200000, 200000))

        full = self.path('full.bag')
        done = subprocess.run(derail + [full], capture_output=True, text=True, timeout=LIMIT, preexec_fn=small_disk)
        self.assertEqual(done.returncode, 1, done.stderr)
        self.assertIn(full, done.stderr)
        self.assertFalse(os.path.exists(full))


if __name__ == '__main__':
    rospy.init_node('test_ros_bags')
    rostest.rosrun('train_derail', 'test_ros_bags', BagTest, sys.argv)
