#!/usr/bin/python3
"""sim.launch with RViz on a virtual display of a common notebook: where on the picture the wreck is, and how large."""

import io
import os
import signal
import subprocess
import sys
import tempfile
import time
import unittest

import numpy
from PIL import Image
import rospkg
import rospy
import rosservice
import rostest
import yaml

from train_derail.srv import Step

LIMIT = 150.0  # wall seconds for anything
SIZE = (1366, 768)
# Parts of the 3D view that the overlay may take: src/rviz/framing.hpp
TOP, BOTTOM = 0.14, 0.20
CAR = 0.04  # of the width: half a car's length, about, where a heap fills the view
FRAME = 7  # pixels; more than a line of the scene is wide


def extent(flags):
    """The first and the last true one, or (0, 0)."""
    places = numpy.flatnonzero(flags)
    return (places[0], places[-1]) if len(places) else (0, 0)


class Picture:
    """A screenshot. Shares are of the 3D view's width and height, from its left and its top."""

    def __init__(self, display):
        png = subprocess.run(['import', '-display', display, '-window', 'root', 'png:-'], stdout=subprocess.PIPE,
                             timeout=LIMIT, check=True).stdout
        self.whole = Image.open(io.BytesIO(png)).convert('RGB')
        left, top, right, bottom = self.find_view(numpy.asarray(self.whole).astype(int))
        self.view = numpy.asarray(self.whole)[top:bottom, left:right].astype(int)
        self.height, self.width = self.view.shape[:2]

    @staticmethod
    def find_view(pixels):
        """What has no frame, upright or level, of the light grey of windows, around a place that is in the 3D view."""
        height, width = pixels.shape[:2]
        grey = (pixels.min(axis=2) > 180) & (pixels.max(axis=2) - pixels.min(axis=2) < 8)
        x, y = int(0.75 * width), height // 2

        def frames(shares):
            """Places in the middle of several lines of frames: what is thinner belongs to the scene."""
            return numpy.flatnonzero(numpy.convolve(shares > 0.9, numpy.ones(FRAME), 'same') > FRAME - 0.5)

        columns = frames(grey[height // 4:3 * height // 4].mean(axis=0))
        left = max(columns[columns < x], default=-1) + FRAME
        right = min(columns[columns > x], default=width) - FRAME
        rows = frames(grey[:, left:right].mean(axis=1))
        return left, max(rows[rows < y], default=-1) + FRAME, right, min(rows[rows > y], default=height) - FRAME

    def of_hue(self, *names):
        """Where cars of these colours are in the part of the view that is free of overlays, in light or in shade."""
        r, g, b = (self.view[..., i] for i in range(3))
        hues = {'blue': (b > 60) & (b > 1.25 * g) & (g > 1.6 * r),
                'orange': (r > 80) & (g < 0.62 * r) & (g > 0.28 * r) & (b < 0.25 * r),
                'yellow': (r > 80) & (g > 0.8 * r) & (g < 1.1 * r) & (b < 0.5 * r),
                'purple': (r > 80) & (g < 0.75 * r) & (b > 1.15 * g) & (b < 0.95 * r)}
        wanted = numpy.logical_or.reduce([hues[name] for name in names])
        wanted[:int(TOP * self.height)] = False
        wanted[int((1.0 - BOTTOM) * self.height):] = False
        return wanted

    def box(self, *names):
        """left, right, top, bottom of where cars of these colours are, as shares. Where the band that they take is much lower than
        elsewhere, as that of cars one behind the other beside a heap, they do not count; all are 0 if there are none. The band is
        as high as what lies within half a car: of cars in a zigzag no column is."""
        found = self.of_hue(*names)
        if not found.any():
            return 0.0, 0.0, 0.0, 0.0
        rows = numpy.arange(self.height)[:, None]
        beside = int(CAR * self.width)

        def around(columns, fill):
            """Of each column the values of those within half a car's length."""
            return numpy.lib.stride_tricks.sliding_window_view(numpy.pad(columns, beside, constant_values=fill), 2 * beside + 1)

        lowest = around(numpy.where(found, rows, 0).max(axis=0), 0).max(axis=1)
        highest = around(numpy.where(found, rows, self.height).min(axis=0), self.height).min(axis=1)
        high = numpy.where(found.any(axis=0), lowest - highest + 1, 0)
        counted = high > 0.55 * numpy.percentile(high[high > 0], 95)
        left, right = extent(counted)
        top, bottom = extent((found & counted).any(axis=1))
        return left / self.width, right / self.width, top / self.height, bottom / self.height

    def strip_is_there(self):
        """White text on a dark plate, at the top of the view."""
        strip = self.view[:int(TOP * self.height)]
        return strip.size > 0 and (strip.max(axis=2) < 70).mean() > 0.3 and (strip.min(axis=2) > 200).sum() > 300


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
        cls.package = rospkg.RosPack().get_path('train_derail')
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

    def launch(self, config):
        """sim.launch of a scenario, paused at its start."""
        launch = self.start('roslaunch', 'train_derail', 'sim.launch', 'start_paused:=true', 'rate:=0',
                            'config:=' + os.path.join(self.package, 'config', config))
        self.addCleanup(self.end, launch)
        rospy.wait_for_service('/train_derail/step', timeout=LIMIT)
        return launch, rospy.ServiceProxy('/train_derail/step', Step)

    def take_picture(self, name, complaint):
        """The first one about which there is no complaint; fails with the last one's if there is none in time."""
        begin = time.monotonic()
        deadline = begin + LIMIT
        again = False
        while True:
            picture = Picture(self.display)
            said = complaint(picture)
            # RViz under software OpenGL now and then ends by a signal as it starts. Once that is forgiven.
            if said and not again and time.monotonic() > begin + 0.25 * LIMIT and len(picture.whole.getcolors(1 << 20) or []) == 1:
                again = True
                deadline = time.monotonic() + LIMIT
                print(name + ': there is no RViz; it is started once more')
                self.addCleanup(self.end, self.start('rviz', '-d', os.path.join(self.package, 'rviz/train_derail.rviz')))
            if not said or time.monotonic() > deadline:
                picture.whole.save(os.path.join(self.results, name + '.png'))
                self.assertFalse(said, '%s: %s' % (name, said))
                return picture

    @staticmethod
    def of_heap(*names):
        """What is wrong with a picture of a heap of cars of these colours; nothing if nothing is."""

        def complaint(picture):
            left, right, top, bottom = picture.box(*names)
            at = 'the heap is at %.2f to %.2f of the width, %.2f to %.2f of the height' % (left, right, top, bottom)
            if right - left < 0.5:
                return at + ': less than half of the width'
            if left < 0.03 or right > 0.97:
                return at + ': cut by an edge'
            if not 1.0 / 3.0 < 0.5 * (left + right) < 2.0 / 3.0:
                return at + ': not in the middle'
            if top < TOP + 0.01 or bottom > 1.0 - BOTTOM - 0.01:
                return at + ': below the overlay'
            if not picture.strip_is_there():
                return 'no text on a plate'
            return None

        return complaint

    def test_a_straight_run(self):
        launch, step = self.launch('mixed_train.yaml')
        self.assertTrue(step(seconds=0.5).success)

        def first_car(picture):
            left, right, _, _ = picture.box('orange')
            if not 0.08 < right - left < 0.5:
                return 'the first car that has derailed is %.2f of the width' % (right - left)
            if not 1.0 / 3.0 < 0.5 * (left + right) < 2.0 / 3.0:
                return 'it is at %.2f to %.2f of the width' % (left, right)
            return None if picture.strip_is_there() else 'no text on a plate'

        self.take_picture('rviz_first_second', first_car)
        while step(seconds=60.0).success:
            pass  # to the end
        self.take_picture('rviz_end', self.of_heap('orange'))

        rviz = [n for n in rosservice.get_service_list(include_nodes=False) if n.startswith('/rviz/')]
        self.assertTrue(rviz, 'sim.launch has started RViz as /rviz')
        subprocess.run(['rosnode', 'kill', '/rviz'], stdout=subprocess.DEVNULL, timeout=LIMIT, check=True)
        self.take_picture('rviz_gone', lambda p: 'something' if len(p.whole.getcolors(1 << 20)) > 1 else None)
        self.assertIsNone(launch.poll(), 'closing RViz must not end the run')

        with open(os.path.join(self.package, 'rviz/train_derail.rviz'), encoding='utf-8') as f:
            config = yaml.safe_load(f)
        views = config['Visualization Manager']['Views']
        views['Current'] = next(v for v in views['Saved'] if v['Name'] == 'pile-up from above')
        with tempfile.NamedTemporaryFile('w', suffix='.rviz', encoding='utf-8') as f:
            yaml.safe_dump(config, f)
            f.flush()
            above = self.start('rviz', '-d', f.name)
            # It joins a run that stands still: everything it shows is latched.
            self.take_picture('rviz_above', self.of_heap('orange'))
            self.end(above)

    def test_a_heap_in_a_curve(self):
        _, step = self.launch('accidents/lac_megantic_2013.yaml')

        def first_cars(picture):
            share = picture.of_hue('blue').sum() / SIZE[0] / SIZE[1]
            return None if share > 0.008 else 'the first cars are %.4f of the picture' % share

        self.take_picture('rviz_curve_start', first_cars)
        while step(seconds=60.0).success:
            pass  # to the end
        self.take_picture('rviz_curve', self.of_heap('orange', 'yellow', 'purple'))


if __name__ == '__main__':
    rospy.init_node('test_ros_rviz')
    rostest.rosrun('train_derail', 'test_ros_rviz', RvizTest, sys.argv)
