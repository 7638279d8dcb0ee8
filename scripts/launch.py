#!/usr/bin/python3
"""roslaunch with an exit code: that of the first required node that has ended; of the first node if none is required.

  rosrun train_derail launch.py sim.launch exit_when_done:=true rate:=0 rviz:=false

roslaunch itself ends with 0 whatever its nodes end with. Arguments as for roslaunch, without the
package: a launch file of train_derail, or the path of any other.
Exit codes: those of train_derail_node (0 done, 1 an output could not be written, 2 an input is wrong,
3 the integration failed); 2 if the launch file cannot be read; 128 + n if a signal has ended the node.
"""

import os
import sys

import rosgraph.names
import roslaunch
import roslaunch.config
import roslaunch.parent
import roslaunch.rlutil


class Ends(roslaunch.pmon.ProcessListener):
    """Remembers how each process has ended, in order. The end of a required node ends the launch, as roslaunch does it,
    but without its alarm: a run that is over is no accident. What ends with an error is still told in red."""

    def __init__(self, config):
        self.seen = []
        self.parent = None
        required = [n for n in config.nodes if n.required]
        self.required = {self.name(n) for n in required}
        self.asked = self.required or {self.name(n) for n in config.nodes}
        for node in required:
            node.required = False

    @staticmethod
    def name(node):
        return rosgraph.names.ns_join(node.namespace, node.name).lstrip('/')

    def process_died(self, process_name, exit_code):
        node = process_name.rsplit('-', 1)[0]
        self.seen.append((node, exit_code))
        if node in self.required:
            self.parent.pm.is_shutdown = True

    def exit_code(self):
        code = next((code for node, code in self.seen if node in self.asked), 0) or 0
        return code if code >= 0 else 128 - code


def main(arguments):
    if not arguments or arguments[0] in ('-h', '--help'):
        print(__doc__.strip(), file=sys.stdout if arguments else sys.stderr)
        return 0 if arguments else 2
    name, *rest = arguments
    try:
        file = name if os.path.exists(name) else roslaunch.rlutil.resolve_launch_arguments(['train_derail', name])[0]
        uuid = roslaunch.rlutil.get_or_generate_uuid(None, False)
        roslaunch.configure_logging(uuid)
        config = roslaunch.config.load_config_default([(file, rest)], None)
        ends = Ends(config)
        parent = roslaunch.parent.ROSLaunchParent(uuid, [(file, rest)], process_listeners=[ends])
        parent.config = config
        ends.parent = parent
        parent.start()
        parent.spin()
    except (roslaunch.RLException, roslaunch.xmlloader.XmlParseException) as e:
        print(f'launch.py: {e}', file=sys.stderr)
        return 2
    return ends.exit_code()


if __name__ == '__main__':
    sys.exit(main(sys.argv[1:]))
