"""What the tests of the plotting scripts share."""

import contextlib
import io
import os
import shutil
import subprocess
import sys
import tempfile
import unittest

import numpy as np
from PIL import Image

SCRIPTS = os.path.join(os.path.dirname(os.path.abspath(__file__)), '..', '..', 'scripts')
sys.dont_write_bytecode = True
sys.path.insert(0, SCRIPTS)

from derail_plots import style  # noqa: E402

MPH, KIP, FOOT = 0.44704, 4448.2216152605, 0.3048
SCENARIO = """
consist:
  - {count: 4, length: 61.1 ft, width: 9 ft, weight: 150 kip}
initial: {speed: 20 mph, yaw_rate: 0.2}
stop: {time_max: 3 s}
"""
RAILS = """
consist:
  - {name: hopper, count: 1, length: 55 ft, weight: 286 kip}
ground: {on_track_law: rails, off_track_law: by_slip}
initial: {speed: 1, yaw_rate: 0.1}
stop: {time_max: 1.5}
solver: {method: semi_implicit, fixed_step: 0.002}
"""
VALIDATION = """
title: short
scenario: rails.yaml
plan: latin_hypercube
samples: 3
factors:
  - {key: rails.derail_ratio, low: 0.8, high: 1.1}
perturbation: {kick: 1 ft/s}
"""
ACCIDENT = 'speed_mph,n_cars,tons_per_car,cars_derailed'


def script(name, *arguments, **options):
    """A script as a process of its own."""
    return subprocess.run(
        [sys.executable, os.path.join(SCRIPTS, name), *arguments],
        capture_output=True,
        text=True,
        check=False,
        **options,
    )


def refusal(main, *arguments):
    """Exit code and error text of a script's main."""
    with contextlib.redirect_stderr(io.StringIO()) as said:
        return main(arguments), said.getvalue()


class PlotTest(unittest.TestCase):
    """Has a folder with a scenario, and the program."""

    program = None

    @classmethod
    def setUpClass(cls):
        style.apply()
        cls.folder = tempfile.mkdtemp(prefix='derail_plots_')
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        cls.path('scenario.yaml', SCENARIO)

    @classmethod
    def path(cls, name, text=None):
        """A place in the folder; with a text, a file there."""
        path = os.path.join(cls.folder, name)
        if text is not None:
            with open(path, 'w', encoding='utf-8') as file:
                file.write(text)
        return path

    @classmethod
    def accidents(cls, rows):
        """A table of accidents, each derailed at its first car, and a study for `derail validate`; `rows` in the order of ACCIDENT."""
        lines = [f'{ACCIDENT},head_end_locos,mid_locos,rear_locos,first_car_position,cars_from_pod_to_rear']
        lines += [','.join(str(x) for x in (*row, 0, 0, 0, 1, row[1])) for row in rows]
        cls.path('rails.yaml', RAILS)
        return cls.path('table.csv', '\n'.join(lines) + '\n'), cls.path('study.yaml', VALIDATION)

    @classmethod
    def derail(cls, *arguments):
        subprocess.run([cls.program, *arguments, '--quiet'], check=True, stderr=subprocess.DEVNULL)

    def check_picture(self, path):
        with Image.open(path) as picture:
            grey = np.asarray(picture.convert('L'))
        self.assertIn(
            grey.shape[1], (round(300 * style.ONE_COLUMN), round(300 * style.TWO_COLUMNS)), path
        )
        dark, white = np.mean(grey < 128), np.mean(grey > 250)
        self.assertTrue(0.003 < dark < 0.3, f'{path}: {dark:.4f} of it is dark')
        self.assertTrue(0.3 < white < 0.97, f'{path}: {white:.4f} of it is white')
        edge = np.concatenate(
            [grey[:2].ravel(), grey[-2:].ravel(), grey[:, :2].ravel(), grey[:, -2:].ravel()]
        )
        self.assertTrue(np.all(edge == 255), f'{path}: something is cut off at its edge')


def run_tests():
    """The program is the first argument."""
    PlotTest.program = os.path.abspath(sys.argv.pop(1))
    unittest.main()
