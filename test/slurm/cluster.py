"""A SLURM cluster on the loopback of this machine: munged, slurmctld and one slurmd a node, all in one folder."""

import ctypes
import os
import pwd
import re
import shutil
import signal
import socket
import subprocess
import sys
import time

PROGRAMS = ('munged', 'slurmctld', 'slurmd', 'sbatch', 'scontrol')
PR_SET_CHILD_SUBREAPER = 36


def descendants(ancestor):
    """Processes below one; those that have ended are left out."""
    children = {}
    for entry in os.listdir('/proc'):
        if not entry.isdigit():
            continue
        try:
            with open('/proc/%s/stat' % entry, encoding='utf-8', errors='replace') as f:
                state, parent = f.read().rpartition(')')[2].split()[:2]
        except OSError:
            continue
        children.setdefault(int(parent), []).append((int(entry), state))
    found, ancestors = [], [ancestor]
    while ancestors:
        for process, state in children.get(ancestors.pop(), []):
            ancestors.append(process)
            if state != 'Z':
                found.append(process)
    return found


def hold(command):
    """Starts a daemon and kills it and all that it has started, also what has left its session, when standard input ends."""
    ctypes.CDLL(None).prctl(PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with subprocess.Popen(command, stdin=subprocess.DEVNULL):
        sys.stdin.read()
        # Whoever loses its parent becomes a child of this process. So one ends after the other, and what they have started
        # meanwhile is seen at the next turn.
        try:
            while True:
                for process in descendants(os.getpid()):
                    try:
                        os.kill(process, signal.SIGKILL)
                    except ProcessLookupError:
                        pass
                os.wait()
        except ChildProcessError:
            pass


class Daemon:
    """Ends, at once and with all its children, with kill() or with the process that made it."""

    def __init__(self, command, log, environment):
        with open(log, 'ab') as output:
            self._holder = subprocess.Popen([sys.executable, __file__] + command, stdin=subprocess.PIPE, stdout=output,
                                            stderr=output, env=environment)

    def kill(self):
        if self._holder.poll() is None:
            self._holder.stdin.close()
            self._holder.wait()

    def processes(self):
        return descendants(self._holder.pid)


def free_ports(count):
    sockets = [socket.socket() for _ in range(count)]
    for s in sockets:
        s.bind(('127.0.0.1', 0))
    ports = [s.getsockname()[1] for s in sockets]
    for s in sockets:
        s.close()
    return ports


class Cluster:
    """Nodes n1, n2, ... of one processor each. A node that is lost is noticed within seconds.

    The folder has to be one that everyone may pass through (munged insists)."""

    def __init__(self, folder, nodes):
        self.folder = folder
        path = os.environ.get('PATH', '') + ':/usr/sbin:/sbin'
        missing = [p for p in PROGRAMS if shutil.which(p, path=path) is None]
        if missing:
            raise RuntimeError(', '.join(missing) + ': not installed (Debian: munge, slurm-wlm)')
        self.environment = {k: v for k, v in os.environ.items() if not k.startswith(('SLURM', 'SBATCH'))}
        self.environment.update(PATH=path, SLURM_CONF=os.path.join(folder, 'slurm.conf'))
        for name in ['state', 'log'] + ['spool/n%d' % (i + 1) for i in range(nodes)]:
            os.makedirs(os.path.join(folder, name))
        with open(os.open(os.path.join(folder, 'munge.key'), os.O_WRONLY | os.O_CREAT, 0o600), 'wb') as f:
            f.write(os.urandom(1024))
        self._write_configuration(nodes)

        self.daemons = {}
        try:
            self._start_all(nodes)
        except BaseException:
            self.close()
            raise

    def _start_all(self, nodes):
        folder = self.folder
        self._start('munged', ['munged', '--foreground'] +
                    ['--%s=%s/munge.%s' % (option, folder, name) for option, name in
                     (('key-file', 'key'), ('socket', 'socket'), ('pid-file', 'pid'), ('log-file', 'log'), ('seed-file', 'seed'))])
        self.wait_for(lambda: os.path.exists(os.path.join(folder, 'munge.socket')))
        self._start('slurmctld', ['slurmctld', '-D', '-c'])
        for i in range(nodes):
            self._start('n%d' % (i + 1), ['slurmd', '-D', '-N', 'n%d' % (i + 1)])
        self.wait_for(lambda: self._ask('sinfo', '-h', '-N', '-o', '%T').split() == ['idle'] * nodes)

    def _write_configuration(self, nodes):
        host = socket.gethostname().partition('.')[0]
        user = pwd.getpwuid(os.getuid()).pw_name
        ports = free_ports(nodes + 1)
        lines = [
            'ClusterName=loopback',
            'SlurmctldHost=%s(127.0.0.1)' % host,
            'SlurmctldPort=%d' % ports[0],
            'SlurmUser=' + user,
            'SlurmdUser=' + user,
            'AuthType=auth/munge',
            # A job that is queued again waits until its old credential has expired [s].
            'AuthInfo=socket=%s/munge.socket,cred_expire=5' % self.folder,
            'CredType=cred/munge',
            'StateSaveLocation=%s/state' % self.folder,
            'SlurmdSpoolDir=%s/spool/%%n' % self.folder,
            'SlurmctldPidFile=%s/slurmctld.pid' % self.folder,
            'SlurmdPidFile=%s/%%n.pid' % self.folder,
            'ProctrackType=proctrack/linuxproc',  # no control groups
            'TaskPlugin=task/none',
            'SwitchType=switch/none',
            'MpiDefault=none',
            'JobAcctGatherType=jobacct_gather/none',
            'AccountingStorageType=accounting_storage/none',
            'SelectType=select/cons_tres',
            'SelectTypeParameters=CR_CPU',
            'SchedulerType=sched/backfill',
            'SchedulerParameters=sched_interval=1,bf_interval=1',
            'SlurmdTimeout=4',  # s without an answer until a node is down
        ]
        lines += ['NodeName=n%d NodeHostname=%s NodeAddr=127.0.0.1 Port=%d CPUs=1' % (i + 1, host, ports[i + 1])
                  for i in range(nodes)]
        lines.append('PartitionName=all Nodes=ALL Default=YES State=UP')
        with open(os.path.join(self.folder, 'slurm.conf'), 'w', encoding='utf-8') as f:
            f.write('\n'.join(lines) + '\n')
        if self._version() >= 23:  # these want control groups mounted, unless they are told to do without; older ones know no such word
            with open(os.path.join(self.folder, 'cgroup.conf'), 'w', encoding='utf-8') as f:
                f.write('CgroupPlugin=disabled\n')

    def _version(self):
        """The first number of Slurm's own version: its year."""
        return int(re.search(r'(\d+)\.', self._ask('slurmd', '-V')).group(1))

    def _start(self, name, command):
        self.daemons[name] = Daemon(command, os.path.join(self.folder, 'log', name), self.environment)

    def _ask(self, *command):
        return subprocess.run(command, env=self.environment, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True,
                              timeout=20, check=False).stdout

    def wait_for(self, condition, limit=60.0):
        deadline = time.monotonic() + limit
        while not condition():
            if time.monotonic() > deadline:
                raise RuntimeError('waited %g s in vain; the cluster says:\n%s' % (limit, self.logs()))
            time.sleep(0.02)

    def logs(self):
        texts = [self._ask('sinfo', '-N', '-l'), self._ask('squeue', '-l')]
        for name in sorted(os.listdir(os.path.join(self.folder, 'log'))):
            with open(os.path.join(self.folder, 'log', name), encoding='utf-8', errors='replace') as f:
                texts.append('%s:\n%s' % (name, ''.join(f.readlines()[-30:])))
        return '\n'.join(texts)

    def job(self, job):
        """What scontrol says of a job, by name; of a task of an array as ID_TASK."""
        pairs = (p.partition('=') for p in self._ask('scontrol', 'show', 'job', '-o', job).split())
        return {name: value for name, _, value in pairs}

    def node_that_runs(self, argument):
        """Name of the node with a process that has this argument."""
        for name, daemon in self.daemons.items():
            for process in daemon.processes():
                try:
                    with open('/proc/%d/cmdline' % process, 'rb') as f:
                        if argument.encode() in f.read().split(b'\0'):
                            return name
                except OSError:
                    pass  # it has just ended
        raise RuntimeError('no node runs %s:\n%s' % (argument, self.logs()))

    def kill_node(self, name):
        """As if its power were cut: the daemon, its steps and what they run."""
        self.daemons[name].kill()

    def close(self):
        for name in reversed(list(self.daemons)):
            self.daemons[name].kill()


if __name__ == '__main__':
    hold(sys.argv[1:])
