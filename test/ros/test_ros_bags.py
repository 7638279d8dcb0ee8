#!/usr/bin/python3
"""Bags: recorded by sim.launch, written by derail without a master, replayed; real rosbag tools on all of them."""

import base64
import fcntl
import io
import json
import math
import os
import re
import resource
import shutil
import signal
import struct
import subprocess
import sys
import tempfile
import unittest
import xmlrpc.client
import zlib

import rosbag
import roslib.packages
import rosgraph
import rospkg
import rospy
import rostest
from rosgraph_msgs.msg import Clock
from std_srvs.srv import Trigger
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import Marker, MarkerArray

import kill_bag
import waiting
from train_derail.msg import CarStates, CouplerForces, RunInfo
from train_derail.srv import Restart, Seek

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
        for topic in ('/tf', '/train_derail/couplers', '/train_derail/pile_up'):
            self.assertEqual(len(self.offline[topic]), ticks, topic)
            self.assertEqual([t for t, _ in self.offline[topic]], [t for t, _ in self.offline['/train_derail/cars']])
        self.assertLess(len(self.offline['/train_derail/markers']), ticks, 'only changes')
        for topic in ('/tf_static', '/train_derail/inputs', '/train_derail/impacts', '/train_derail/track_markers'):
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

    def accident(self, name):
        """The recording that derail makes of a preset with a short train; the path of the preset, the changes and the bag."""
        scenario = os.path.join(rospkg.RosPack().get_path('train_derail'), 'config', name + '.yaml')
        changes = ('consist[1].count=21', 'initial.cars_ahead=4', 'stop.time_max=15', 'output.interval=0.1')
        offline = self.path(name + '_offline.bag')
        subprocess.run([program('derail'), 'run', scenario, *('--set=' + c for c in changes), '--quiet', '--force', '--bag', offline],
                       check=True, timeout=LIMIT)
        return scenario, changes, offline

    def test_an_accident_recorded_and_written_offline_are_equal(self):
        for name in ('accident', 'accident3d'):
            with self.subTest(name):
                scenario, changes, offline = self.accident(name)
                self.assertEqual(self.record(name + '.bag', scenario, changes), contents(offline))
                self.check_impacts(offline)
        with rosbag.Bag(offline) as bag:
            last = [m for _, m, _ in bag.read_messages(['/train_derail/cars'])][-1]
        self.assertGreater(sum(car.tilt > math.pi / 4 for car in last.cars), 0, 'no car of the train in space is over')

    def check_impacts(self, offline):
        with rosbag.Bag(offline) as bag:
            impacts = [m for _, m, _ in bag.read_messages(['/train_derail/impacts'])]
        self.assertEqual((impacts[0].time, impacts[0].impacts), (0.0, []))
        self.assertGreater(len(impacts), 3)
        for before, after in zip(impacts, impacts[1:]):
            self.assertNotEqual(before.impacts, after.impacts, 'sent when it has changed')
            if after is not impacts[-1]:
                self.assertGreater(after.time - before.time, 0.99, 'at most once a second')

    def test_a_bag_of_rosbag_record_holds_the_same(self):
        topics = ['/tf', '/train_derail/cars', '/train_derail/couplers', '/train_derail/run_info', '/train_derail/markers']
        recorder = self.start(['rosbag', 'record', '-O', self.path('outside.bag'), '__name:=recorder', *topics])
        # Not faster: the recorder's own queue holds 100 messages.
        self.launch('sim.launch', 'config:=' + self.scenario, 'rate:=1', 'start_paused:=true')
        # Once connected the recorder has what is latched, and misses nothing of the run.
        self.assertTrue(wait_for(lambda: all(self.received('/recorder', t) > 0 for t in topics)))
        rospy.wait_for_service('/train_derail/resume', LIMIT)
        self.assertTrue(rospy.ServiceProxy('/train_derail/resume', Trigger)().success)
        streams = topics[:3]
        self.assertTrue(wait_for(lambda: all(self.received('/recorder', t) >= len(self.offline[t]) for t in streams)
                                 and self.received('/recorder', '/train_derail/run_info') >= 3))
        recorder.send_signal(signal.SIGINT)
        recorder.communicate(timeout=LIMIT)
        with rosbag.Bag(self.path('outside.bag')) as outside, rosbag.Bag(self.bag) as ours:
            for topic in streams:
                # roscpp may send the latched message twice to who connects while it is published.
                a = list(dict.fromkeys(self.plain(m) for _, m, _ in outside.read_messages([topic])))
                b = [self.plain(m) for _, m, _ in ours.read_messages([topic])]
                self.assertEqual(a[:len(b)], b, topic)
                # After the end tf goes on with the clock; that is none of the run's, and in no bag of ours.
                if topic != '/tf':
                    self.assertEqual(len(a), len(b), topic)
            # Of markers each has what it needs to show the same in the end.
            self.assertEqual(self.shown(outside), self.shown(ours))

    @staticmethod
    def shown(bag):
        """The markers that RViz would show after the last message."""
        all_markers = {}
        for _, message, _ in bag.read_messages(['/train_derail/markers']):
            for m in message.markers:
                if m.action == Marker.DELETEALL:
                    all_markers.clear()
                elif m.action == Marker.DELETE:
                    all_markers.pop((m.ns, m.id), None)
                else:
                    m.header.stamp, m.header.seq = rospy.Time(0), 0
                    all_markers[m.ns, m.id] = m
        return {key: str(m) for key, m in all_markers.items()}

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

    @staticmethod
    def runs_of(page):
        """What a page replays: of each run its description and its numbers."""
        with open(page, encoding='utf-8') as file:
            packed = re.findall(r'<script type="text/plain" class="run">([^<]*)</script>', file.read())
        runs = []
        for text in packed:
            raw = zlib.decompress(base64.b64decode(text))
            size = struct.unpack_from('<I', raw)[0]
            runs.append((json.loads(raw[4:4 + size]), raw[4 + size:]))
        return runs

    def replay(self, bag, page, *options):
        # Whoever makes a page of a bag needs no master.
        return subprocess.run([program('derail'), 'replay', bag, '--html', self.path(page), '--force', *options], text=True,
                              capture_output=True, timeout=LIMIT, check=False,
                              env=dict(os.environ, ROS_MASTER_URI='http://localhost:1'))

    def test_a_page_of_a_bag_is_that_of_the_run(self):
        for name in ('accident', 'accident3d'):
            with self.subTest(name):
                self.check_page_of_a_bag(name)

    def check_page_of_a_bag(self, preset):
        scenario, changes, bag = self.accident(preset)
        page, node = self.path('page.html'), preset + '_page_node.bag'
        subprocess.run([program('derail'), 'run', scenario, *('--set=' + c for c in changes), '--quiet', '--force', '--html', page],
                       check=True, timeout=LIMIT)
        self.record(node, scenario, changes)
        (run, numbers), = self.runs_of(page)
        self.assertGreater(len(run['events']), 10)
        known = [row for row in run['outcome'] if row['name'] != 'wall_time']  # ~outcome does not tell how long it took
        for name in (os.path.basename(bag), node):  # the node's own recording too
            said = self.replay(self.path(name), 'again.html')
            self.assertEqual(said.returncode, 0, said.stderr)
            (again, same), = self.runs_of(self.path('again.html'))
            self.assertEqual(same, numbers, 'places and forces, to the last bit of what a page holds')
            self.assertEqual(again.pop('caption'), 'run 1')
            self.assertEqual(again, {**{k: v for k, v in run.items() if k != 'caption'}, 'outcome': known})
            self.assertGreater(len(again['touches']), 3)

    def test_runs_of_a_bag_stand_side_by_side(self):
        """Two runs of one node and one of another, as `rosbag record` keeps them."""
        both, other = self.path('both.bag'), self.path('other_run.bag')
        subprocess.run([program('derail'), 'run', self.scenario, '--quiet', '--set', 'initial.speed=3', '--bag', other],
                       check=True, timeout=LIMIT)
        with rosbag.Bag(both, 'w') as out:
            for source, node, number in ((self.bag, '/train_derail', 1), (other, '/train_derail', 2), (other, '/second', 1)):
                with rosbag.Bag(source) as bag:
                    for topic, message, stamp in bag.read_messages():
                        if hasattr(message, 'run_id'):
                            message.run_id = number
                        out.write(topic.replace('/train_derail', node), message, stamp)
        said = self.replay(both, 'both.html')
        self.assertEqual(said.returncode, 0, said.stderr)
        runs = self.runs_of(self.path('both.html'))
        self.assertEqual([run['caption'] for run, _ in runs], ['/second, run 1', '/train_derail, run 1', '/train_derail, run 2'])
        self.assertEqual(runs[0][1], runs[2][1])
        self.assertNotEqual(runs[0][1], runs[1][1])
        self.assertEqual(self.replay(both, 'second.html', '--run', '2').returncode, 0)
        self.assertEqual([n for _, n in self.runs_of(self.path('second.html'))], [runs[2][1]])

    def test_a_page_says_what_is_wrong_with_a_bag(self):
        with open(self.bag, 'rb') as file:
            whole = file.read()
        files = {'no.bag': b'not a bag', 'cut.bag': whole[:len(whole) // 2], 'empty.bag': b''}
        for name, content in files.items():
            with open(self.path('wrong_' + name), 'wb') as file:
                file.write(content)
        with rosbag.Bag(self.path('wrong_other.bag'), 'w') as other:
            other.write('/clock', Clock(), rospy.Time(1))
        for name, left_out in (('wrong_inputs.bag', '/train_derail/inputs'), ('wrong_cars.bag', '/train_derail/cars')):
            with rosbag.Bag(self.path(name), 'w') as out, rosbag.Bag(self.bag) as bag:
                for topic, message, stamp in bag.read_messages():
                    if topic != left_out:
                        out.write(topic, message, stamp)
        for name, options, words in (('missing.bag', (), 'missing.bag'), ('wrong_no.bag', (), 'not a bag'),
                                     ('wrong_cut.bag', (), 'not a bag that can be read'),
                                     ('wrong_empty.bag', (), 'not a bag'), ('wrong_other.bag', (), 'holds no run of train_derail'),
                                     ('wrong_inputs.bag', (), 'no ~inputs'), ('wrong_cars.bag', (), '/train_derail/cars'),
                                     ('offline.bag', ('--run', '7'), 'no run 7; there are: 1'),
                                     ('offline.bag', ('--point', '1'), '--point')):
            said = self.replay(self.path(name), 'wrong.html', *options)
            self.assertEqual(said.returncode, 2, (name, said.stderr))
            self.assertIn(words, said.stderr, name)
            self.assertFalse(os.path.exists(self.path('wrong.html')), name)

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
            if topic != '/train_derail/markers':  # sent when they change
                self.assertGreater(len(cut[topic]), 5)
            self.assertLess(len(cut[topic]), 151)
            self.assertEqual(cut[topic], self.offline[topic][:len(cut[topic])], topic)

    def test_replay_of_a_train_in_space_has_its_states_and_frames(self):
        bag = self.accident('accident3d')[2]
        cars, frames = [], []
        self.launch('replay.launch', 'bag:=' + bag, 'pause:=true', 'rate:=0')
        subscribers = [rospy.Subscriber('/train_derail/cars', CarStates, cars.append),
                       rospy.Subscriber('/tf', TFMessage, frames.append)]
        self.assertTrue(wait_for(lambda: all(s.get_num_connections() > 0 for s in subscribers) and cars))
        rospy.wait_for_service('/train_derail/resume', LIMIT)
        self.assertTrue(rospy.ServiceProxy('/train_derail/resume', Trigger)().success)
        with rosbag.Bag(bag) as recorded:
            wanted = [m for _, m, _ in recorded.read_messages(['/train_derail/cars'])]
            wanted_frames = [m for _, m, _ in recorded.read_messages(['/tf'])]
        self.assertTrue(wait_for(lambda: cars[-1].time == wanted[-1].time and len(frames) >= len(wanted_frames)))
        for subscriber in subscribers:
            subscriber.unregister()
        self.assertEqual([self.plain(m) for m in cars], [self.plain(m) for m in wanted])
        seen = {self.plain(m) for m in frames}
        self.assertEqual([m for m in wanted_frames if self.plain(m) not in seen], [])

    def test_replay_equals_the_run(self):
        cars, couplers, clocks, infos = [], [], [], []
        self.launch('replay.launch', 'bag:=offline.bag', 'pause:=true', 'rate:=5')
        subscribers = [
            rospy.Subscriber('/train_derail/cars', CarStates, cars.append),
            rospy.Subscriber('/train_derail/couplers', CouplerForces, couplers.append),
            rospy.Subscriber('/train_derail/run_info', RunInfo, infos.append),
            rospy.Subscriber('/clock', Clock, lambda m: clocks.append(m.clock)),
        ]
        self.assertTrue(wait_for(lambda: all(s.get_num_connections() > 0 for s in subscribers) and infos and cars))
        self.assertTrue(infos[-1].replay)
        rospy.wait_for_service('/train_derail/resume', LIMIT)
        self.assertTrue(rospy.ServiceProxy('/train_derail/resume', Trigger)().success)
        self.assertTrue(wait_for(lambda: infos[-1].state == RunInfo.ENDED and cars[-1].time >= 3.0 and couplers[-1].time >= 3.0))
        with rosbag.Bag(self.bag) as bag:
            for topic, seen in (('/train_derail/cars', cars), ('/train_derail/couplers', couplers)):
                expected = [self.plain(m) for _, m, _ in bag.read_messages([topic])]
                self.assertEqual([self.plain(m) for m in seen], expected, topic)
        # Any moment can be shown, another run cannot be begun.
        self.assertEqual(infos[-1].kept_until, 3.0)
        shown = rospy.ServiceProxy('/train_derail/seek', Seek)(1.5)
        self.assertTrue(shown.success, shown.message)
        self.assertTrue(wait_for(lambda: cars[-1].time == 1.5 and couplers[-1].time == 1.5))
        self.assertEqual(self.plain_states(cars[-1]), self.plain_states(next(m for m in cars if m.time == 1.5)))
        refused = rospy.ServiceProxy('/train_derail/restart', Restart)()
        self.assertEqual((refused.success, 'recording' in refused.message), (False, True), refused.message)
        # It can be seen once more.
        self.assertTrue(rospy.ServiceProxy('/train_derail/resume', Trigger)().success)
        self.assertTrue(wait_for(lambda: infos[-1].run_id == 2 and infos[-1].state == RunInfo.ENDED))
        for subscriber in subscribers:
            subscriber.unregister()
        self.assertEqual(clocks, sorted(clocks))

    @staticmethod
    def plain_states(message):
        buffer = io.BytesIO()
        for car in message.cars:
            car.serialize(buffer)
        return buffer.getvalue()

    def test_replay_begins_where_it_is_told_to(self):
        self.launch('replay.launch', 'bag:=offline.bag', 'start:=2')
        self.assertGreaterEqual(rospy.wait_for_message('/train_derail/cars', CarStates, LIMIT).time, 2.0)

    def test_a_replay_says_what_is_wrong_with_a_bag(self):
        with open(self.path('no.bag'), 'w', encoding='utf-8') as file:
            file.write('not a bag')
        with rosbag.Bag(self.path('other.bag'), 'w') as other:
            other.write('/clock', Clock(), rospy.Time(1))
        for arguments, said in ((['bag:=missing.bag'], 'missing.bag'), (['bag:=no.bag'], 'not a bag'),
                                (['bag:=other.bag'], 'holds no run of train_derail'),
                                (['bag:=offline.bag', 'run:=7'], 'no run 7; there are: 1'),
                                (['bag:=offline.bag', 'start:=-1'], '--replay-start')):
            output, _ = self.launch('replay.launch', *arguments).communicate(timeout=LIMIT)
            self.assertIn(said, output, arguments)

    def test_rosbag_play_from_the_middle_shows_every_car(self):
        """A reader that has missed the beginning finds all markers within a few seconds of the bag."""
        shown, world = set(), set()

        def receive(message):
            shown.update((m.ns, m.id) for m in message.markers if m.action == Marker.ADD)

        subscribers = [rospy.Subscriber('/train_derail/markers', MarkerArray, receive),
                       rospy.Subscriber('/train_derail/track_markers', MarkerArray,
                                        lambda m: world.update(x.ns for x in m.markers))]
        long = self.path('long.bag')
        subprocess.run([program('derail'), 'run', self.scenario, '--quiet', '--set', 'stop.time_max=9', '--bag', long],
                       timeout=LIMIT, check=True)
        cars = len(next(rosbag.Bag(long).read_messages(['/train_derail/cars']))[1].cars)
        player = subprocess.Popen(['rosbag', 'play', '--clock', '--rate=10', '-s', '3', long], stdout=subprocess.DEVNULL)
        self.assertTrue(wait_for(lambda: all(s.get_num_connections() > 0 for s in subscribers) or player.poll() is not None))
        player.communicate(timeout=LIMIT)
        for kind in ('cars', 'car_parts'):
            self.assertEqual({i for ns, i in shown if ns == kind}, set(range(1, cars + 1)), kind)
        self.assertLessEqual({'ground', 'track', 'ruler'}, world)
        for subscriber in subscribers:
            subscriber.unregister()

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
