#!/usr/bin/python3
"""After sourcing the workspace the messages and the module are one package. Usage: test_workspace.py DEVEL"""

import os
import subprocess
import sys
import tempfile
import unittest

DEVEL = ''


class WorkspaceTest(unittest.TestCase):

    def python(self, code):
        """As a user has it who has sourced the set-up file and nothing else, somewhere else."""
        with tempfile.TemporaryDirectory(prefix='derail workspace ') as folder:
            result = subprocess.run(['bash', '-c', '. "$1/setup.bash"; exec /usr/bin/python3 -c "$2"', 'bash', DEVEL, code], cwd=folder, text=True, timeout=100,
                                    stdout=subprocess.PIPE, stderr=subprocess.STDOUT, check=False, env={'PATH': '/usr/bin:/bin', 'HOME': folder})
        self.assertEqual(result.returncode, 0, result.stdout)
        return result.stdout

    def test_messages_and_module_in_either_order(self):
        messages = 'from train_derail.msg import CarStates, Outcome; from train_derail.srv import Restart; Outcome(cars_off_track=3); '
        module = 'import train_derail; print(train_derail.run("config/baseline.yaml", speed="55 mph").outcome["cars_off_track"] > 20)'
        self.assertEqual(self.python(messages + module), 'True\n')
        self.assertEqual(self.python(module + '; ' + messages), 'True\n')

    def test_messages_alone_do_not_load_the_simulator(self):
        self.assertEqual(self.python('import sys, train_derail.msg; print("train_derail._core" in sys.modules)'), 'False\n')

    def test_each_value_of_the_outcome_has_its_field_in_the_message(self):
        # wall_time is left out of messages; others are of other types in them.
        code = 'import train_derail, train_derail.msg as m; print(set(train_derail.outcome_fields) - set(m.Outcome.__slots__))'
        self.assertEqual(self.python(code), "{'wall_time'}\n")


if __name__ == '__main__':
    DEVEL = os.path.abspath(sys.argv.pop(1))
    unittest.main()
