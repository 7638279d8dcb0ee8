#!/usr/bin/python3
"""What is installed is whole, goes where it was asked to go, and serves programs that are compiled with other flags.
Usage: test_install.py BUILD_FOLDER [--ros] [--python FOLDER_OF_PACKAGES]"""

import glob
import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import unittest

SOURCE = os.path.join(os.path.dirname(os.path.abspath(__file__)), '..', '..')
CONSUMER = os.path.join(os.path.dirname(os.path.abspath(__file__)), 'consumer')
BUILD = ''
ROS = False
PYTHON = ''


def run(*command, **options):
    return subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False, timeout=600, **options)


def files_below(folder):
    return {os.path.relpath(os.path.join(at, name), folder) for at, _, names in os.walk(folder) for name in names}


def plain_environment(**more):
    """As a user has it who has sourced nothing."""
    return {'PATH': '/usr/bin:/bin', 'HOME': os.environ.get('HOME', '/'), **more}


class InstallTest(unittest.TestCase):

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.mkdtemp(prefix='derail install ')
        cls.prefix = os.path.join(cls.folder, 'a place')
        cls.installed = run('cmake', '--install', BUILD, '--prefix', cls.prefix)

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.folder)

    def setUp(self):
        self.assertEqual(self.installed.returncode, 0, self.installed.stdout)

    def run_well(self, *command, **options):
        result = run(*command, **options)
        self.assertEqual(result.returncode, 0, ' '.join(command) + '\n' + result.stdout)
        return result.stdout

    def find(self, name):
        found = glob.glob(os.path.join(glob.escape(self.prefix), '**', name), recursive=True)
        self.assertEqual(len(found), 1, found)
        return found[0]

    def scenarios(self):
        return [self.find(os.path.join('config', name)) for name in ('baseline.yaml', 'accident.yaml')]

    def test_all_of_it_lies_below_the_prefix_and_the_root(self):
        root = os.path.join(self.folder, 'root')
        self.run_well('cmake', '--install', BUILD, '--prefix', '/opt/a place', env={**os.environ, 'DESTDIR': root})
        files = files_below(root)
        self.assertEqual({f for f in files if not f.startswith('opt/a place/')}, set())
        self.assertEqual({f[len('opt/a place/'):] for f in files}, files_below(self.prefix))

    def test_what_is_installed_are_files_not_links_to_where_they_were(self):
        # A library is called by its versions: links to names in the same folder.
        links = [name for name in files_below(self.prefix) if os.path.islink(os.path.join(self.prefix, name))
                 and not re.fullmatch(r'lib\w+\.so[.\d]*', os.readlink(os.path.join(self.prefix, name)))]
        self.assertEqual(links, [])
        self.find(os.path.join('train_derail', 'README.md'))
        if ROS:
            found = self.run_well('sh', '-c', '. "%s/setup.sh" && rospack find train_derail' % self.prefix, env=plain_environment())
            self.assertEqual(found.strip(), os.path.join(self.prefix, 'share', 'train_derail'))

    def test_no_file_names_another_place(self):
        for name in files_below(self.prefix):
            with open(os.path.join(self.prefix, name), 'rb') as f:
                content = f.read()
            self.assertNotIn(b'prefix_of_train_derail', content, name)
            if not content.startswith(b'\x7fELF') and not name.endswith('.pyc'):
                self.assertNotIn(os.path.realpath(BUILD).encode() + b'/', content, name)

    def test_programs_run_where_nothing_is_sourced(self):
        table = self.run_well(self.find('derail'), 'run', self.scenarios()[0], env=plain_environment())
        self.assertIn('off the track', table)
        self.run_well(self.find('plot_run.py'), '--help', env=plain_environment())
        self.run_well(self.find('slurm_study.sh'), '--help', env=plain_environment())
        if ROS:
            bag = os.path.join(self.folder, 'a bag.bag')
            self.run_well(self.find('derail'), 'run', self.scenarios()[0], '--quiet', '--bag', bag, env=plain_environment())
            self.assertTrue(os.path.getsize(bag) > 10000)

    def test_files_that_messages_name_are_installed(self):
        named = {}
        for tree in ('src', 'include', 'scripts', 'config') + (('examples', 'launch', 'msg', 'srv', 'action') if ROS else ()):
            for at, _, names in os.walk(os.path.join(SOURCE, tree)):
                for name in names:
                    path = os.path.join(at, name)
                    with open(path, encoding='utf-8', errors='replace') as f:
                        text = f.read()
                    for word in re.findall(r'(?<![\w./-])(?:docs|config|scripts|examples)/[\w./-]*\w|(?<![\w./-])\w+\.(?:py|sh|md)\b', text):
                        named.setdefault(word, path)
        self.assertIn('docs/validation.md', named)
        self.assertIn('plot_study.py', named)
        # scripts/ is the name of their folder in the repository; installed they lie with the programs.
        installed = ''.join('/%s/\n' % f for f in files_below(self.prefix))
        missing = {word: where for word, where in named.items() if '/%s' % re.sub('^scripts/', '', word) not in installed}
        self.assertEqual(missing, {})

    def test_each_file_is_in_one_package_of_debian(self):
        if not ROS:
            self.skipTest('the packages have all of it')
        packages = dict.fromkeys(files_below(self.prefix), ())
        for listed in glob.glob(os.path.join(SOURCE, 'debian', '*.install')):
            with open(listed, encoding='utf-8') as f:
                patterns = [line.split()[0].replace('usr/lib/*/', 'usr/lib/') for line in f]
            for pattern in patterns:
                for found in glob.glob(os.path.join(glob.escape(self.prefix), pattern.removeprefix('usr/'))):
                    for name in files_below(found) if os.path.isdir(found) else ['']:
                        packages[os.path.relpath(os.path.join(found, name), self.prefix).removesuffix('/.')] += (os.path.basename(listed),)
        # What debian/rules takes away, and what sets up a folder that is no system's.
        away = re.compile(r'share/(common-lisp|gennodejs|roseus)/|.*/__pycache__/|(\.catkin|\.rosinstall|(env|_setup_util|(local_)?setup)\.\w+)$')
        self.assertEqual({name: of for name, of in packages.items() if len(of) != 1 and not away.match(name)}, {})

    def consume(self, name, flags, catkin=False):
        build = os.path.join(self.folder, name)
        environment = plain_environment()
        setup = ''
        if catkin:
            setup = '. "%s/setup.sh" && ' % self.prefix
        self.run_well('sh', '-c', setup + 'exec "$@"', 'sh', 'cmake', '-S', CONSUMER, '-B', build, '-DCMAKE_PREFIX_PATH=' + self.prefix if not catkin
                      else '-DWITH_CATKIN=ON', '-DCMAKE_CXX_FLAGS=-O1 ' + flags, '-DPYTHON_EXECUTABLE=/usr/bin/python3', env=environment)
        self.run_well('cmake', '--build', build, env=environment)
        return self.run_well('sh', '-c', setup + 'exec "$@"', 'sh', os.path.join(build, 'consumer'), *self.scenarios(), env=environment)

    def test_the_library_computes_the_same_whatever_a_program_is_compiled_for(self):
        plain = self.consume('plain', '')
        self.assertIn('moved', plain)
        self.assertEqual(self.consume('native', '-march=native'), plain)
        with open('/proc/cpuinfo', encoding='utf-8') as f:
            if re.search(r'\bavx2\b', f.read()):
                self.assertEqual(self.consume('avx2', '-mavx2 -mfma'), plain)
        self.assertEqual(self.consume('sanitized', '-fsanitize=address -DEIGEN_MAX_STATIC_ALIGN_BYTES=0'), plain)
        if ROS:
            self.assertEqual(self.consume('catkin', '-march=native', catkin=True), plain)
            self.listen(os.path.join(self.folder, 'catkin', 'listener'), int(re.search(r'off track (\d+)', plain).group(1)))

    def listen(self, listener, off_track):
        """The installed node and somebody else's, which hears what the library has computed."""
        with socket.socket() as free:
            free.bind(('localhost', 0))
            port = str(free.getsockname()[1])
        environment = plain_environment(ROS_MASTER_URI='http://localhost:' + port, ROS_HOSTNAME='localhost')
        sourced = ['sh', '-c', '. "%s/setup.sh" && export ROS_MASTER_URI=http://localhost:%s && exec "$@"' % (self.prefix, port), 'sh']
        launched = subprocess.Popen([*sourced, 'roslaunch', 'train_derail', 'sim.launch', 'rviz:=false', 'rate:=0', 'start_paused:=true',
                                     'config:=' + self.scenarios()[0]], stdout=subprocess.DEVNULL, stderr=subprocess.STDOUT, env=environment)
        try:
            self.assertIn('%d off track' % off_track, self.run_well(*sourced, listener, env=environment))
        finally:
            launched.send_signal(signal.SIGINT)
            launched.wait(timeout=120)

    def test_pkg_config(self):
        # catkin has a file of the package's own name, for programs within its environment.
        package = 'train_derail-core' if ROS else 'train_derail'
        pkg_config = {'PKG_CONFIG_PATH': os.path.dirname(self.find(package + '.pc'))}
        options = self.run_well('sh', '-c', 'eval "printf \'%%s\\n\' $(pkg-config --cflags --libs %s)"' % package, env=plain_environment(**pkg_config)).splitlines()
        program = os.path.join(self.folder, 'by_pkg_config')
        self.run_well('c++', '-std=c++17', os.path.join(CONSUMER, 'consumer.cpp'), '-o', program, *options)
        library = os.path.dirname(self.find('libtrain_derail.so'))
        self.assertIn('off track', self.run_well(program, self.scenarios()[0], env=plain_environment(LD_LIBRARY_PATH=library)))

    def test_the_module_for_python(self):
        if not PYTHON:
            self.skipTest('built without it')
        code = 'import train_derail as t; run = t.run("config/baseline.yaml"); print(run.outcome["ended"], run.scenario.source)'
        package = os.path.dirname(self.find('_api.py'))
        written = self.run_well('/usr/bin/python3', '-B', '-c', code, cwd=self.folder, env=plain_environment(PYTHONPATH=os.path.dirname(package)))
        self.assertEqual(written.split(maxsplit=1), ['at_rest', self.scenarios()[0] + '\n'])
        self.assertEqual(os.path.relpath(package, self.prefix), os.path.join(PYTHON, 'train_derail'))
        if ROS:
            code = 'import train_derail.msg as m, train_derail as t; print(m.Outcome().cars, t.load("config/baseline.yaml")["consist[0].count"])'
            written = self.run_well('sh', '-c', '. "%s/setup.sh" && exec /usr/bin/python3 -B -c "$1"' % self.prefix, 'sh', code.replace('"', "'"),
                                    cwd=self.folder, env=plain_environment())
            self.assertEqual(written, '0 60\n')

    def test_a_program_with_other_containers_is_not_linked(self):
        build = os.path.join(self.folder, 'debug')
        self.run_well('cmake', '-S', CONSUMER, '-B', build, '-DCMAKE_PREFIX_PATH=' + self.prefix, '-DCMAKE_CXX_FLAGS=-D_GLIBCXX_DEBUG',
                      env=plain_environment())
        refused = run('cmake', '--build', build, env=plain_environment())
        self.assertNotEqual(refused.returncode, 0)
        self.assertIn('compiled_with_GLIBCXX_DEBUG', refused.stdout)


if __name__ == '__main__':
    ROS = '--ros' in sys.argv
    if ROS:
        sys.argv.remove('--ros')
    if '--python' in sys.argv:
        PYTHON = sys.argv.pop(sys.argv.index('--python') + 1)
        sys.argv.remove('--python')
    BUILD = os.path.abspath(sys.argv.pop(1))
    unittest.main()
