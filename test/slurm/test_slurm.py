#!/usr/bin/python3
"""A study on a SLURM cluster of two nodes, one of which is lost on the way. Usage: test_slurm.py DERAIL"""

import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

from cluster import Cluster

SCRIPT = os.path.join(os.path.dirname(os.path.abspath(__file__)), '../../scripts/slurm_study.sh')
DERAIL = ''
SHARDS = 4
RUNS = 6 * 120
OUT = 'out put 50%, %a'  # sbatch has patterns of its own in the names of logs

SCENARIO = """
consist:
  - {count: 40, length: 61.1 ft, weight: 150 kip}
initial: {speed: 30 mph, yaw_rate: 0.2}
stop: {time_max: 4 s}
"""
STUDY = """
title: on a cluster
scenario: a scenario.yaml
plan: grid
factors:
  - {key: initial.speed, values: [20 mph, 30 mph, 40 mph]}
  - {key: coupler.slack, values: [0.5 in, 1 in]}
replicates: 120
perturbation: {spacing: 3 mm, yaw_rate: 0.01}
"""


class SlurmTest(unittest.TestCase):

    def setUp(self):
        self.folder = tempfile.mkdtemp(prefix='derail_slurm_')
        self.addCleanup(shutil.rmtree, self.folder)
        os.chmod(self.folder, 0o711)
        for name, text in (('a scenario.yaml', SCENARIO), ('a study.yaml', STUDY)):
            with open(self.path(name), 'w', encoding='utf-8') as f:
                f.write(text)

    def path(self, *names):
        return os.path.join(self.folder, *names)

    def read(self, *names):
        with open(self.path(*names), 'rb') as f:
            return f.read()

    def submit(self, *arguments, environment=None):
        return subprocess.run([SCRIPT, *arguments], env={**(environment or os.environ), 'DERAIL': DERAIL}, text=True,
                              stdout=subprocess.PIPE, stderr=subprocess.PIPE, check=False, timeout=60)

    def test_table_is_that_of_one_machine_though_a_node_is_lost(self):
        study = self.path('a study.yaml')
        subprocess.run([DERAIL, 'study', study, '--out', self.path('alone'), '--quiet'], check=True)

        cluster_folder = self.path('cluster')
        os.mkdir(cluster_folder)
        cluster = Cluster(cluster_folder, nodes=2)
        self.addCleanup(cluster.close)
        submitted = self.submit(study, '--out', self.path(OUT), '--shards', str(SHARDS), environment=cluster.environment)
        self.assertEqual(submitted.returncode, 0, submitted.stderr)
        array, merge = re.match(r'shards: job (\d+); merge: job (\d+);', submitted.stdout).groups()

        # The first shard that has computed something, but not all, loses its node.
        def rows(shard):
            try:
                return self.read(OUT, 'journal.%d-of-%d.csv' % (shard, SHARDS)).count(b'\n') - 1
            except FileNotFoundError:
                return 0

        begun = []
        cluster.wait_for(lambda: begun or begun.extend(s for s in range(1, SHARDS + 1) if 1 < rows(s) < RUNS / SHARDS / 2))
        shard = begun[0]
        lost = cluster.node_that_runs('%d/%d' % (shard, SHARDS))
        cluster.kill_node(lost)
        saved = self.read(OUT, 'journal.%d-of-%d.csv' % (shard, SHARDS))
        self.assertLess(saved.count(b'\n') - 1, RUNS / SHARDS)

        cluster.wait_for(lambda: cluster.job(merge).get('JobState') in ('COMPLETED', 'FAILED', 'CANCELLED'), limit=150.0)
        log = self.read(OUT, 'slurm', 'shard-%d.log' % shard).decode()
        self.assertEqual(cluster.job(merge)['JobState'], 'COMPLETED', log + cluster.logs())
        task = cluster.job('%s_%d' % (array, shard))
        self.assertEqual((task['JobState'], task['Restarts']), ('COMPLETED', '1'), task)
        self.assertNotEqual(task['NodeList'], lost)

        # What was on disk has not been computed again, but for a line that was torn.
        whole = saved[:saved.rindex(b'\n') + 1]
        self.assertTrue(self.read(OUT, 'journal.%d-of-%d.csv' % (shard, SHARDS)).startswith(whole))
        for name in ('runs.csv', 'summary.csv'):
            self.assertEqual(self.read(OUT, name), self.read('alone', name), name)
        self.assertIn(b'%d of %d runs' % (RUNS, RUNS), self.read(OUT, 'slurm', 'merge.log'))

    def test_nothing_is_submitted_that_cannot_work(self):
        study = self.path('a study.yaml')
        for arguments, said in (
                (['missing.yaml', '--out', 'x', '--shards', '2'], 'missing.yaml: cannot be read'),
                ([study, '--out', 'x', '--shards', '0'], '--shards = 0: out of range'),
                ([study, '--out', 'x', '--shards', 'two'], '--shards = two: out of range'),
                ([study, '--out', 'x', '--shards'], '--shards: missing value'),
                ([study, '--out', 'x', '--shards', '2', 'other.yaml'], 'other.yaml: a second study file'),
                ([study, '--out', 'a\\b', '--shards', '2'], 'a backslash'),
                ([study, '--shards', '2'], 'usage: slurm_study.sh')):
            refused = self.submit(*arguments)
            self.assertEqual(refused.returncode, 2, refused.stderr)
            self.assertIn(said, refused.stderr)


if __name__ == '__main__':
    DERAIL = os.path.abspath(sys.argv.pop(1))
    unittest.main()
