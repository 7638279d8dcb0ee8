#!/usr/bin/python3
"""sim.launch with RViz on a virtual display: the pictures are taken and show the train."""

import io
import os
import signal
import subprocess
import sys
import tempfile
import time
import unittest

from PIL import Image
import rospkg
import rospy
import rosservice
import rostest
import yaml

from train_derail.srv import Step

LIMIT = 150.0  # wall seconds for anything
SIZE = (1600, 900)
VIEW = (510, 80, 1580, 780)  # of the 3D view in the window: left, top, right, bottom


def is_on_track(r, g, b):
    return b > 90 and b > g + 15 and g > r + 10


def is_derailed(r, g, b):
    return r > 130 and r > b + 60 and g > b + 20  # orange or light yellow


class Picture:

    def __init__(self, display):
        png = subprocess.run(['import', '-display', display, '-window', 'root', 'png:-'], stdout=subprocess.PIPE,
                             timeout=LIMIT, check=True).stdout
        self.whole = Image.open(io.BytesIO(png)).convert('RGB')
        view = self.whole.crop(VIEW)
        self.colours = view.getcolors(view.size[0] * view.size[1])

    def distinct(self):
        return len(self.colours)

    def count(self, is_wanted):
        return sum(n for n, colour in self.colours if is_wanted(*colour))

    def __str__(self):
        return '%d colours, %d pixels of cars on the track, %d of derailed ones' % (
            self.distinct(), self.count(is_on_track), self.count(is_derailed))


class RvizTest(unittest.TestCase):

    @classmethod
    def setUpClass(cls):
        cls.processes = []
        # Without -noreset it starts over when its last client goes, and refuses the next one meanwhile.
        server = subprocess.Popen(['Xvfb', '-displayfd', '1', '-noreset', '-nolisten', 'tcp', '-screen', '0', '%dx%dx24' % SIZE],
                                  stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        cls.processes.append(server)
        cls.display = ':' + server.stdout.readline().strip()
        cls.environment = dict(os.environ, DISPLAY=cls.display, LIBGL_ALWAYS_SOFTWARE='1', QT_X11_NO_MITSHM='1')
        cls.results = os.path.join(rospkg.get_test_results_dir(), 'train_derail')
        os.makedirs(cls.results, exist_ok=True)

    @classmethod
    def tearDownClass(cls):
        for process in reversed(cls.processes):
            cls.end(process)

    @staticmethod
    def end(process):
        if process.poll() is None:
            process.send_signal(signal.SIGINT if 'roslaunch' in process.args[0] else signal.SIGTERM)
            process.wait(timeout=LIMIT)

    def start(self, *command):
        process = subprocess.Popen(command, env=self.environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        self.processes.append(process)
        return process

    def take_picture(self, name, is_good):
        """The first good one; fails with the last one if there is none in time."""
        deadline = time.monotonic() + LIMIT
        while True:
            picture = Picture(self.display)
            if is_good(picture) or time.monotonic() > deadline:
                picture.whole.save(os.path.join(self.results, name + '.png'))
                self.assertTrue(is_good(picture), '%s: %s' % (name, picture))
                return picture

    def test_pictures_show_the_train(self):
        launch = self.start('roslaunch', 'train_derail', 'sim.launch', 'start_paused:=true', 'rate:=0')
        rospy.wait_for_service('/train_derail/step', timeout=LIMIT)
        step = rospy.ServiceProxy('/train_derail/step', Step)

        # At the start only the first car counts as derailed; the legend has a patch of either colour all the time.
        start = self.take_picture('rviz_start', lambda p: p.count(is_on_track) > 2500 and p.distinct() > 30)

        self.assertTrue(step(seconds=6.0).success)
        whole = self.take_picture(
            'rviz_whole_train',
            lambda p: p.count(is_derailed) > start.count(is_derailed) + 100 and p.count(is_on_track) > 2500)

        rviz = [n for n in rosservice.get_service_list(include_nodes=False) if n.startswith('/rviz/')]
        self.assertTrue(rviz, 'sim.launch has started RViz as /rviz')
        subprocess.run(['rosnode', 'kill', '/rviz'], stdout=subprocess.DEVNULL, timeout=LIMIT, check=True)
        self.take_picture('rviz_gone', lambda p: p.distinct() == 1)
        self.assertIsNone(launch.poll(), 'closing RViz must not end the run')
        self.assertTrue(step(ticks=1).success)

        with open(os.path.join(rospkg.RosPack().get_path('train_derail'), 'rviz/train_derail.rviz'),
                  encoding='utf-8') as f:
            config = yaml.safe_load(f)
        views = config['Visualization Manager']['Views']
        views['Current'] = next(v for v in views['Saved'] if v['Name'] == 'pile-up')
        with tempfile.NamedTemporaryFile('w', suffix='.rviz', encoding='utf-8') as f:
            yaml.safe_dump(config, f)
            f.flush()
            close = self.start('rviz', '-d', f.name)
            # It joins a run that stands still: everything it shows is latched.
            self.take_picture('rviz_pile_up', lambda p: p.count(is_derailed) > 5 * whole.count(is_derailed))
            self.end(close)
        self.end(launch)


if __name__ == '__main__':
    rospy.init_node('test_ros_rviz')
    rostest.rosrun('train_derail', 'test_ros_rviz', RvizTest, sys.argv)
