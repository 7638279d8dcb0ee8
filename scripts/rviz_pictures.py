#!/usr/bin/python3
"""Makes the pictures of RViz in docs/pictures anew, on a virtual display (Xvfb, ImageMagick): rviz_pictures.py [FOLDER]

To be run after sourcing the package's environment. Starts a master of its own, for each picture the node with a run that it
advances to a moment, and RViz as it ships with one of its saved views.
"""

import os
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time

import rospkg
import yaml

# file, scenario, simulated time [s], saved view, cut to the scene alone, what the colours of cars say
PICTURES = [
    ('wreck.png', 'config/mixed_train.yaml', 12.0, 'wreck', False, 'cause'),
    ('accident.png', 'config/accident.yaml', 25.0, 'wreck', True, 'cause'),
    ('pile_up_above.png', 'config/accident.yaml', 25.0, 'pile-up from above', True, 'cause'),
    ('dads20.png', 'config/dads20.yaml', 16.0, 'wreck', True, 'cause'),
    ('accident3d.png', 'config/accident3d.yaml', 39.0, 'wreck', True, 'cause'),
    ('posture.png', 'config/accident3d.yaml', 39.0, 'wreck', True, 'posture'),
    ('along.png', 'config/accident3d.yaml', 39.0, 'along the track', True, 'posture'),
    ('panel.png', 'config/mixed_train.yaml', 8.5, 'whole train', False, 'cause'),
]
SIZE = (1366, 768)
SCENE = '1334x676+16+62'  # of a window of that size without its panel
LIMIT = 120.0  # wall seconds for anything


def wait(condition, what):
    end = time.monotonic() + LIMIT
    while not condition():
        if time.monotonic() > end:
            sys.exit(f'rviz_pictures.py: waited {LIMIT:.0f} s for {what}')
        time.sleep(0.2)


class Desk:
    """A display and a master, and whatever is started there; ended together."""

    def __init__(self):
        self.started = []
        server = self.start('Xvfb', '-displayfd', '1', '-nolisten', 'tcp', '-screen', '0', '%dx%dx24' % SIZE,
                            stdout=subprocess.PIPE, text=True)
        self.environment = dict(os.environ, DISPLAY=':' + server.stdout.readline().strip(), LIBGL_ALWAYS_SOFTWARE='1',
                                QT_X11_NO_MITSHM='1')
        with socket.socket() as free:
            free.bind(('', 0))
            port = free.getsockname()[1]
        self.environment['ROS_MASTER_URI'] = f'http://localhost:{port}'
        self.start('rosmaster', '--core', '-p', str(port))
        wait(lambda: self.run('rosparam', 'list').returncode == 0, 'the master')

    def start(self, *command, **options):
        options.setdefault('stdout', subprocess.DEVNULL)
        process = subprocess.Popen(command, env=getattr(self, 'environment', None), stderr=subprocess.DEVNULL, **options)
        self.started.append(process)
        return process

    def run(self, *command):
        return subprocess.run(command, env=self.environment, capture_output=True, text=True, timeout=LIMIT, check=False)

    def end(self, process):
        process.send_signal(signal.SIGINT)
        try:
            process.wait(timeout=10)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        self.started.remove(process)


def with_view(package, name, folder, scene_alone):
    """The configuration of RViz that ships, with one of its saved views as the current one, with or without the panel."""
    with open(os.path.join(package, 'rviz', 'train_derail.rviz'), encoding='utf-8') as file:
        config = yaml.safe_load(file)
    views = config['Visualization Manager']['Views']
    views['Current'] = dict(next(v for v in views['Saved'] if v['Name'] == name), Name='Current View')
    if scene_alone:
        config['Panels'] = []
        config['Window Geometry'] = {'Width': SIZE[0], 'Height': SIZE[1], 'X': 0, 'Y': 0}
    path = os.path.join(folder, 'view.rviz')
    with open(path, 'w', encoding='utf-8') as file:
        yaml.safe_dump(config, file)
    return path


def make(desk, package, folder, picture, into):
    name, scenario, seconds, view, scene_alone, colours = picture
    path = os.path.join(package, scenario)
    desk.run('rosparam', 'load', path, '/train_derail/scenario')
    desk.run('rosparam', 'set', '/train_derail/scenario_file', path)
    desk.run('rosparam', 'set', '/train_derail/start_paused', 'true')
    desk.run('rosparam', 'set', '/train_derail/publish/colours', colours)
    desk.run('rosparam', 'set', '/use_sim_time', 'true')
    node = desk.start('rosrun', 'train_derail', 'train_derail_node', '__name:=train_derail')
    services = ['rosservice', 'list', '/train_derail']
    wait(lambda: '/train_derail/step' in desk.run(*services).stdout, 'the node')
    rviz = desk.start('rviz', '-d', with_view(package, view, folder, scene_alone))
    wait(lambda: '/rviz' in desk.run('rosnode', 'list').stdout, 'RViz')
    wait(lambda: 'rviz' in desk.run('rostopic', 'info', '/train_derail/markers').stdout, 'RViz to listen')
    # In two steps: the charts of the panel then have a past.
    for step in (0.5 * seconds, 0.5 * seconds):
        answer = desk.run('rosservice', 'call', '/train_derail/step', f'{{ticks: 0, seconds: {step}}}').stdout
        if 'success: True' not in answer:
            sys.exit(f'rviz_pictures.py: {name}: {answer}')
    shot = os.path.join(folder, name)
    last = b''

    def settled():
        nonlocal last
        before, last = last, subprocess.run(['import', '-window', 'root', 'png:-'], env=desk.environment,
                                            stdout=subprocess.PIPE, timeout=LIMIT, check=True).stdout
        with open(shot, 'wb') as file:
            file.write(last)
        different = desk.run('compare', '-metric', 'AE', '-fuzz', '5%', shot, shot + '.before', 'null:').stderr
        shutil.copy(shot, shot + '.before')
        return bool(before) and different.split('.')[0].isdigit() and int(float(different)) < 3000

    time.sleep(3.0)  # to load and draw; then until nothing but clocks changes
    wait(settled, 'a still picture')
    crop = ['-crop', SCENE, '+repage'] if scene_alone else []
    desk.run('convert', shot, *crop, '-strip', os.path.join(into, name))
    desk.end(rviz)
    desk.end(node)
    desk.run('rosparam', 'delete', '/train_derail')
    print(os.path.join(into, name), flush=True)


def main():
    package = rospkg.RosPack().get_path('train_derail')
    into = sys.argv[1] if len(sys.argv) > 1 else os.path.join(package, 'docs', 'pictures')
    desk = Desk()
    with tempfile.TemporaryDirectory() as folder:
        try:
            for picture in PICTURES:
                make(desk, package, folder, picture, into)
        finally:
            for process in reversed(desk.started):
                process.kill()
                process.wait()


if __name__ == '__main__':
    main()
