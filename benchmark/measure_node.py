#!/usr/bin/python3
"""How fast the node goes at rate 0, and how soon a service answers meanwhile. Wants the node of sim.launch, paused:

  roslaunch train_derail sim.launch rviz:=false rate:=0 start_paused:=true set:="consist[0].count=100"
  rostopic hz /train_derail/cars /train_derail/couplers /train_derail/markers /tf > /dev/null &   # someone who listens
  benchmark/measure_node.py [RUNS]

Runs the scenario RUNS times (default 10) and asks ~get_inputs all along.
"""

import statistics
import sys
import threading
import time

import rospy
from train_derail.msg import RunInfo
from train_derail.srv import GetInputs, Restart


def main():
    runs = int(sys.argv[1]) if len(sys.argv) > 1 else 10
    rospy.init_node('measure_node', disable_rostime=True)
    changed, state = threading.Condition(), {}

    def on_info(info):
        with changed:
            state[info.run_id] = (info.state, info.time)
            changed.notify_all()

    rospy.Subscriber('/train_derail/run_info', RunInfo, on_info)
    restart = rospy.ServiceProxy('/train_derail/restart', Restart, persistent=True)
    inputs = rospy.ServiceProxy('/train_derail/get_inputs', GetInputs, persistent=True)
    restart.wait_for_service(30)

    done, delays = threading.Event(), []

    def ask():
        while not done.is_set():
            start = time.perf_counter()
            inputs()
            delays.append(time.perf_counter() - start)

    asking = threading.Thread(target=ask)
    asking.start()
    speeds = []
    for _ in range(runs):
        start = time.perf_counter()
        run = restart(start_paused=False).run_id
        with changed:
            if not changed.wait_for(lambda: state.get(run, (0, 0))[0] >= RunInfo.ENDED, 120):
                raise SystemExit('measure_node.py: no end of the run within 120 s')
        speeds.append(state[run][1] / (time.perf_counter() - start))
    done.set()
    asking.join()
    print(f'simulated over wall time: median {statistics.median(speeds):.1f} of {runs} runs')
    delays.sort()
    print(f'~get_inputs: median {1e3 * statistics.median(delays):.1f} ms, 99 % within {1e3 * delays[int(0.99 * len(delays))]:.1f} ms, '
          f'longest {1e3 * delays[-1]:.1f} ms of {len(delays)}')


if __name__ == '__main__':
    main()
