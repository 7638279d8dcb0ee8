#!/usr/bin/python3
"""The module for Python computes what derail computes, to the last bit. Usage: test_module.py DERAIL; the module on PYTHONPATH."""

import csv
import json
import math
import os
import signal
import subprocess
import sys
import tempfile
import threading
import unittest

import numpy as np
import pandas

import train_derail

DERAIL = ''
BASELINE = 'config/baseline.yaml'
# All parts of the extended model, and incidents of each kind, in a second or so.
ACCIDENT = 'config/accident.yaml'
# A train in three dimensions of which cars come to lie on their sides.
SPACE = 'config/accident3d.yaml'
FEW = {'consist[1].count': 20, 'initial.cars_ahead': 3, 'output.interval': '0.1 s'}
SHORT = {'stop.time_max': '8 s', 'initial.speed': '60 mph'}
LONG = {**SHORT, 'consist[1].count': 900, 'stop.time_max': '30 s'}  # some seconds of computing
PERTURBED = {'initial.perturbation.spacing': '1 cm', 'consist[0].count': 12}

STUDY = '''
title: "Speeds"
scenario: {base}
factors: [{{key: initial.speed, label: speed, values: [20 mph, 30 mph]}}, {{key: ground.on_track_law, label: law, values: [guided]}}]
replicates: 3
perturbation: {{spacing: 1 cm}}
seed: 7
'''


class Case(unittest.TestCase):

    def setUp(self):
        holder = tempfile.TemporaryDirectory(prefix='derail module ')
        self.addCleanup(holder.cleanup)
        self.folder = holder.name

    def path(self, name):
        return os.path.join(self.folder, name)

    def derail(self, *arguments, changes=None):
        """Calls derail from another folder, with presets by their full path."""
        arguments = [train_derail.load(a).source if a in (BASELINE, ACCIDENT, SPACE) else a for a in arguments]
        sets = [word for key, value in (changes or {}).items() for word in ('--set', f'{key}={value}')]
        result = subprocess.run([DERAIL, *arguments, '--quiet', *sets], cwd=self.folder, capture_output=True, text=True, timeout=300, check=False)
        self.assertEqual(result.returncode, 0, result.stderr)
        return result.stdout

    def outcome_of_derail(self, *arguments, **options):
        outcome = json.loads(self.derail('run', *arguments, '--json', '-', **options))
        self.assertGreater(outcome.pop('wall_time'), 0.0)
        return outcome

    def rows(self, name):
        with open(self.path(name), newline='', encoding='utf-8') as file:
            return list(csv.reader(file))

    def assert_table(self, columns, rows):
        """The columns are those of the CSV, value by value; empty is NaN."""
        names, *rows = rows
        self.assertGreater(len(rows), 0)
        self.assertEqual(list(columns), names)
        for name, texts in zip(names, zip(*rows)):
            values = np.asarray(columns[name])
            if values.dtype == object or values.dtype.kind == 'U':
                self.assertEqual([str(v) for v in values], list(texts), name)
            else:
                np.testing.assert_array_equal(values.astype(float), [float(t or 'nan') for t in texts], err_msg=name)


def without_wall_time(outcome):
    return {name: value for name, value in outcome.items() if name != 'wall_time'}


def by_steps(simulation):
    while simulation.step():
        pass
    return without_wall_time(simulation.outcome)


class RunTest(Case):

    def test_two_lines_give_a_number(self):
        run = train_derail.run("config/baseline.yaml", speed="55 mph")
        number = run.outcome["cars_off_track"]
        self.assertIs(type(number), int)
        self.assertEqual(number, self.outcome_of_derail(BASELINE, changes={'initial.speed': '55 mph'})['cars_off_track'])

    def test_outcome_is_that_of_derail(self):
        for name, changes in ((BASELINE, {}), (BASELINE, {'solver.method': 'bdf'}), (ACCIDENT, SHORT), (SPACE, FEW)):
            with self.subTest(name, changes=changes):
                outcome = train_derail.run(name, changes).outcome
                wanted = self.outcome_of_derail(name, changes=changes)
                self.assertEqual(without_wall_time(outcome), wanted)
                self.assertEqual([type(v) for v in without_wall_time(outcome).values()], [type(v) for v in wanted.values()])
                self.assertEqual(list(outcome), list(train_derail.outcome_fields))

    def test_states_and_incidents_are_those_of_derail(self):
        for name, changes in ((ACCIDENT, SHORT), (SPACE, FEW)):
            with self.subTest(name):
                self.check_states_and_incidents(name, changes)

    def test_cars_of_a_train_in_space_roll(self):
        run = train_derail.run(SPACE, FEW, states=True)
        tilt = run.cars['tilt'][-1]
        self.assertEqual(run.outcome['cars_over'], np.count_nonzero(tilt >= np.radians(45.0)))
        self.assertGreater(run.outcome['cars_over'], 0)
        q = {n: run.cars[n][-1] for n in ('qx', 'qy', 'qz', 'qw')}
        np.testing.assert_allclose(np.cos(tilt), 1.0 - 2.0 * (q['qx']**2 + q['qy']**2), atol=1e-9, err_msg='of the upward axis')
        self.assertLess(run.cars['z'][-1].min(), 0.0, 'down the bank')

    def check_states_and_incidents(self, name, changes):
        self.derail('run', name, '--csv', self.path('states.csv'), '--incidents', self.path('incidents.csv'), '--force', changes=changes)
        run = train_derail.run(name, changes, states=True)
        self.assertIsInstance(run.table, pandas.DataFrame)
        self.assert_table(run.table, self.rows('states.csv'))
        self.assert_table(run.incidents, self.rows('incidents.csv'))
        self.assertEqual(set(run.incidents['what']), {'derailed', 'coupler_broken', 'impact'})
        n = run.outcome['cars']
        for name, values in {**run.cars, **run.couplers}.items():
            field = train_derail.car_fields.get(name) or train_derail.coupler_fields[name]
            self.assertEqual(values.shape, (len(run.time), n if name in train_derail.car_fields else n - 1))
            self.assertEqual(values.dtype.kind, {float: 'f', int: 'i', bool: 'b', str: 'U'}[field.type], name)
        self.assertEqual(list(run.cars), list(train_derail.car_fields))
        self.assertEqual(list(run.couplers), list(train_derail.coupler_fields))

    def test_a_run_without_incidents_has_empty_columns(self):
        incidents = train_derail.run(BASELINE, PERTURBED).incidents
        self.assertIn('time_s', incidents)
        self.assertEqual({len(column) for column in incidents.values()}, {0})

    def test_states_that_were_not_kept_are_computed_when_asked_for(self):
        later, at_once = train_derail.run(BASELINE), train_derail.run(BASELINE, states=True)
        self.assertIsNone(later._recorded)
        np.testing.assert_array_equal(later.time, at_once.time)
        for name, values in at_once.cars.items():
            np.testing.assert_array_equal(later.cars[name], values)
        self.assertEqual(without_wall_time(later.outcome), without_wall_time(at_once.outcome))

    def test_step_by_step_is_the_same_run(self):
        for name, changes in ((BASELINE, {}), (ACCIDENT, SHORT)):
            with self.subTest(name):
                run = train_derail.run(name, changes, states=True)
                simulation = train_derail.Simulation(name, changes)
                k = 0
                while True:
                    self.assertEqual(simulation.time, run.time[k])
                    for values, now in ((run.cars, simulation.cars), (run.couplers, simulation.couplers)):
                        for field in now:
                            np.testing.assert_array_equal(now[field], values[field][k])
                    if not simulation.step():
                        break
                    k += 1
                self.assertEqual(k, len(run.time) - 1)
                self.assertTrue(simulation.ended)
                self.assertEqual(without_wall_time(simulation.outcome), without_wall_time(run.outcome))

    def test_times_before_the_run_are_refused(self):
        simulation = train_derail.Simulation(BASELINE)
        for t in (-1, float('nan'), -math.inf):
            with self.assertRaises(train_derail.InputError) as caught:
                simulation.advance(t)
            self.assertEqual((caught.exception.key, caught.exception.value), ('t', str(float(t))))
        simulation.advance(0.0)
        self.assertEqual(simulation.time, 0.0)
        simulation.advance(1.0)
        simulation.advance(0.5)  # is over
        self.assertEqual(simulation.time, 1.0)

    def test_a_failed_integration_is_an_error(self):
        with self.assertRaises(train_derail.IntegrationError) as caught:
            train_derail.run(BASELINE, {'solver.steps_max': 50})
        self.assertEqual(caught.exception.outcome['ended'], 'integration_failed')
        self.assertIn('50', str(caught.exception))


class ManyRunsTest(Case):

    def test_an_ensemble_is_that_of_derail_at_any_number_of_threads(self):
        self.derail('run', BASELINE, '--seeds', '9', '--jobs', '1', '--csv', self.path('runs.csv'), '--json', self.path('summary.json'), changes=PERTURBED)
        with open(self.path('summary.json'), encoding='utf-8') as file:
            summary = json.load(file)
        said = []
        for jobs in (0, 1, 2, 5):
            many = train_derail.ensemble(BASELINE, 9, PERTURBED, jobs=jobs, progress=lambda *counts: said.append(counts))
            self.assertEqual(many.summary, summary)
            self.assert_table(many.table, self.rows('runs.csv'))
            np.testing.assert_array_equal(many['cars_off_track'], many.table['cars_off_track'])
            self.assertEqual(len(many), 9)
            self.assertEqual(said[-1], (9, 9))
        self.assertGreater(len(set(many['stop_time'])), 1)
        self.assertIs(many.table['stop_time'].dtype.type, np.float64)
        self.assertIs(many.table['cars_off_track'].dtype.type, np.int64)

    def test_a_study_is_that_of_derail_at_any_number_of_threads(self):
        with open(self.path('study.yaml'), 'w', encoding='utf-8') as file:
            file.write(STUDY.format(base=train_derail.load(BASELINE).source))
        self.derail('study', self.path('study.yaml'), '--jobs', '1', '--out', self.path('derail'), changes={'consist[0].count': 12})

        def content(folder, name):
            with open(os.path.join(self.path(folder), name), 'rb') as file:
                return file.read()

        for jobs in (1, 3):
            results = train_derail.study(self.path('study.yaml'), {'consist[0].count': 12}, jobs=jobs, out=self.path(f'jobs{jobs}'))
            for name in ('runs.csv', 'summary.csv', 'study.json'):
                self.assertEqual(content(f'jobs{jobs}', name), content('derail', name))
            self.assert_table(results.table, self.rows('derail/runs.csv'))
            self.assert_table(results.summary, self.rows('derail/summary.csv'))
        in_memory = train_derail.study(self.path('study.yaml'), {'consist[0].count': 12})
        pandas.testing.assert_frame_equal(in_memory.table, results.table)
        self.assertEqual(len(in_memory.table), 12)  # base and three values, three runs each
        self.assertIsNone(in_memory.sobol)
        self.assertEqual(in_memory.about['runs'], 12)
        with self.assertRaisesRegex(RuntimeError, 'holds 12 finished runs'):
            train_derail.study(self.path('study.yaml'), {'consist[0].count': 12}, out=self.path('derail'))
        train_derail.study(self.path('study.yaml'), {'consist[0].count': 12}, out=self.path('derail'), resume=True)

    def test_an_interrupted_study_goes_on_where_it_was(self):
        with open(self.path('study.yaml'), 'w', encoding='utf-8') as file:
            file.write(STUDY.format(base=train_derail.load(BASELINE).source).replace('replicates: 3', 'replicates: 100'))

        def interrupt(done, total):
            os.kill(os.getpid(), signal.SIGINT)
        with self.assertRaises(KeyboardInterrupt):
            train_derail.study(self.path('study.yaml'), {'consist[0].count': 12}, out=self.path('interrupted'), progress=interrupt)
        with open(self.path('interrupted/journal.csv'), encoding='utf-8') as file:
            kept = len(file.readlines()) - 1
        self.assertGreater(kept, 0)
        self.assertLess(kept, 400)
        said = []
        resumed = train_derail.study(self.path('study.yaml'), {'consist[0].count': 12}, out=self.path('interrupted'), resume=True,
                                     progress=lambda *counts: said.append(counts))
        self.assertEqual(said[-1], (400, 400))
        pandas.testing.assert_frame_equal(resumed.table, train_derail.study(self.path('study.yaml'), {'consist[0].count': 12}).table)

    def test_without_pandas_tables_are_dicts_of_arrays(self):
        code = 'import sys; sys.modules["pandas"] = None; import train_derail; ' \
               f'table = train_derail.ensemble("{BASELINE}", 2, {PERTURBED}).table; print(type(table).__name__, table["run"].tolist())'
        self.assertEqual(subprocess.check_output([sys.executable, '-c', code], text=True, cwd=self.folder), 'dict [0, 1]\n')

    def test_numbers_are_refused_as_on_the_command_line(self):
        """In its words, with its bounds, before anything is computed."""
        base = train_derail.load(BASELINE).source
        with open(self.path('study.yaml'), 'w', encoding='utf-8') as file:
            file.write(STUDY.format(base=base))

        def said_by_derail(*arguments):
            result = subprocess.run([DERAIL, *arguments], cwd=self.folder, capture_output=True, text=True, timeout=60, check=False)
            self.assertEqual(result.returncode, 2, result.stderr)
            return result.stderr.strip()

        jobs_of_python = 'from 0 to'  # 0: one a core
        for function, command in ((lambda **counts: train_derail.ensemble(BASELINE, **{'seeds': 3, **counts}), ('run', base, '--seeds')),
                                  (lambda **counts: train_derail.study(self.path('study.yaml'), **counts), ('study', 'study.yaml', '--replicates'))):
            name = command[-1][2:]
            for key, value in ((name, 0), (name, -1), (name, 2.5), (name, 10**12), (name, 10**30), (name, True), (name, '3'), ('jobs', -1), ('jobs', 4097), ('jobs', 1.0)):
                with self.subTest(key=key, value=value):
                    with self.assertRaises(train_derail.InputError) as caught:
                        function(**{key: value})
                    e = caught.exception
                    self.assertEqual((e.where, e.key, e.value), ('argument', key, repr(value)))
                    if value == '3':
                        self.assertEqual(e.problem, 'not a whole number')
                        continue
                    said = said_by_derail(*command[:2], f'--{key}={value}')
                    self.assertIn(f"command line: --{key} = '{value}': {e.problem}; allowed: ", said)
                    self.assertTrue(said.endswith(e.range.replace(jobs_of_python, 'from 1 to')), (said, e.range))
        with self.assertRaises(train_derail.InputError):
            train_derail.ensemble(BASELINE, 1, PERTURBED)
        self.assertEqual(len(train_derail.ensemble(BASELINE, np.int64(2), PERTURBED, jobs=np.int64(1))), 2)
        self.assertEqual(len(train_derail.study(self.path('study.yaml'), {'consist[0].count': 12}, replicates=2).table), 8)

    def test_warnings_of_the_runs_are_there(self):
        many = train_derail.ensemble(BASELINE, 2, {**PERTURBED, 'coupler.slack': '4 ft'})
        self.assertTrue(many.summary['warnings'])
        for warning in many.summary['warnings']:
            self.assertEqual(many.warnings.count(warning), 1, many.warnings)

    def test_what_progress_raises_ends_it(self):
        def refuse(done, total):
            raise LookupError(f'{done} of {total}')
        with self.assertRaisesRegex(LookupError, 'of 4'):
            train_derail.ensemble(BASELINE, 4, PERTURBED, progress=refuse)


class ThreadsTest(Case):

    def test_the_interpreter_is_free_while_a_run_computes(self):
        simulation, seen, over = train_derail.Simulation(ACCIDENT, SHORT), [], threading.Event()

        def look():
            while not over.is_set():
                try:
                    simulation.time
                except RuntimeError as e:  # from within the run
                    seen.append(str(e))
        other = threading.Thread(target=look)
        other.start()
        try:
            simulation.run()
        finally:
            over.set()
            other.join()
        self.assertGreater(len(seen), 100)
        self.assertIn('give each thread its own', seen[0])

    def test_the_interpreter_is_free_while_an_ensemble_computes(self):
        counted, over = [0], threading.Event()
        states = []

        def count():
            while not over.is_set():
                counted[0] += 1
        other = threading.Thread(target=count)
        other.start()
        try:
            train_derail.ensemble(BASELINE, 12, {'initial.perturbation.spacing': '1 cm', 'consist[0].count': 900}, jobs=1,
                                  progress=lambda *_: states.append(counted[0]))
        finally:
            over.set()
            other.join()
        # From one word of progress to the next this thread only computes.
        self.assertGreater(len(states), 2)
        self.assertEqual(states, sorted(set(states)))

    def test_two_threads_with_two_runs(self):
        speeds = ('30 mph', '45 mph')
        alone = [without_wall_time(train_derail.run(BASELINE, speed=speed).outcome) for speed in speeds]
        together = [None, None]

        def compute(i):
            together[i] = without_wall_time(train_derail.run(BASELINE, speed=speeds[i]).outcome)
        threads = [threading.Thread(target=compute, args=(i,)) for i in (0, 1)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(together, alone)
        self.assertNotEqual(alone[0], alone[1])

    def test_ctrl_c_interrupts_a_run_that_can_be_gone_on_with(self):
        simulation, over = train_derail.Simulation(ACCIDENT, LONG), threading.Event()

        def interrupt():
            while not over.is_set():
                try:
                    simulation.time
                except RuntimeError:  # it computes
                    os.kill(os.getpid(), signal.SIGINT)
                    return
        other = threading.Thread(target=interrupt)
        other.start()
        try:
            with self.assertRaises(KeyboardInterrupt):
                simulation.run()
        finally:
            over.set()
            other.join()
        self.assertFalse(simulation.ended)
        simulation.run()
        self.assertEqual(without_wall_time(simulation.outcome), without_wall_time(train_derail.run(ACCIDENT, LONG).outcome))

    def test_ctrl_c_interrupts_an_ensemble_soon(self):
        """Long before its end: of many runs some hundred at most are over."""
        said = []

        def interrupt(done, total):
            said.append(done)
            if len(said) == 1:
                os.kill(os.getpid(), signal.SIGINT)
        with self.assertRaises(KeyboardInterrupt):
            train_derail.ensemble(ACCIDENT, 100000, {'stop.time_max': '5 s'}, jobs=1, progress=interrupt)
        self.assertLess(said[-1], 50000)

    def test_a_saved_run_goes_on_bit_for_bit(self):
        simulation = train_derail.Simulation(ACCIDENT, SHORT)
        simulation.advance(3.0)
        simulation.save(self.path('saved'))
        with self.assertRaises(FileExistsError):
            simulation.save(self.path('saved'))
        restored = train_derail.Simulation.restored(self.path('saved'))
        self.assertEqual(restored.time, 3.0)
        other = train_derail.Simulation.restored(self.path('saved'), {'stop.time_max': '4 s'})
        for run in (simulation, restored, other):
            run.run()
        self.assertEqual(without_wall_time(restored.outcome), without_wall_time(simulation.outcome))
        for name, values in simulation.cars.items():
            np.testing.assert_array_equal(restored.cars[name], values, name)
        self.assertEqual(other.time, 4.0)
        self.assertEqual(simulation.scenario.to_yaml(), restored.scenario.to_yaml())
        with self.assertRaises(train_derail.InputError) as refused:
            train_derail.Simulation(BASELINE).save(self.path('not_saved'))
        self.assertEqual(refused.exception.key, 'solver.method')
        with self.assertRaises(train_derail.InputError):
            train_derail.Simulation.restored(BASELINE)


class ScenarioTest(Case):

    def test_values_are_read_changed_and_written(self):
        scenario = train_derail.load(BASELINE)
        self.assertEqual(scenario['consist[0].count'], 60)
        self.assertEqual(scenario['solver.method'], 'dormand_prince')
        self.assertEqual(train_derail.load(ACCIDENT)['coupler.break_moment'], math.inf)
        changed = scenario.changed({'consist[0].weight': '286 kip'}, speed='50 mph')
        self.assertAlmostEqual(changed['consist[0].weight'], 286 * 4448.2216, 0)
        self.assertEqual(changed['initial.speed'], 50 * 0.44704)
        self.assertNotEqual(scenario['initial.speed'], changed['initial.speed'])
        again = changed.changed(speed=10)
        self.assertEqual((again['initial.speed'], again['consist[0].weight']), (10.0, changed['consist[0].weight']))
        changed.write(self.path('mine.yaml'))
        self.assertEqual(dict(train_derail.load(self.path('mine.yaml')).items()), dict(changed.items()))
        with self.assertRaises(FileExistsError):
            scenario.write(self.path('mine.yaml'))
        scenario.write(self.path('mine.yaml'), replace=True)
        self.assertEqual(train_derail.load(self.path('mine.yaml'))['initial.speed'], scenario['initial.speed'])
        self.assertEqual(train_derail.loads(scenario.to_yaml()).to_yaml(), scenario.to_yaml())

    def test_numbers_lists_and_groups_are_written_as_in_a_file(self):
        scenario = train_derail.load(BASELINE).changed({'initial.speed': np.float64(12.5), 'consist[0].count': np.int64(7), 'coupler.break_draft': math.inf})
        self.assertEqual((scenario['initial.speed'], scenario['consist[0].count']), (12.5, 7))
        self.assertEqual(scenario['coupler.break_draft'], math.inf)
        block = {key.split('.')[1]: value for key, value in train_derail.load(BASELINE).items() if key.startswith('consist[0].')}
        two = scenario.changed({'consist': [block, {**block, 'count': 3}]})
        self.assertEqual((two['consist[0].count'], two['consist[1].count']), (60, 3))
        with self.assertRaises(TypeError):
            scenario.changed(speed=None)

    def test_short_names(self):
        scenario = train_derail.load(BASELINE, speed='20 mph', method='bdf', coupler__slack='1 cm', title='mine')
        self.assertEqual([scenario[key] for key in ('initial.speed', 'solver.method', 'coupler.slack', 'title')], [20 * 0.44704, 'bdf', 0.01, 'mine'])
        with self.assertRaises(train_derail.InputError) as caught:
            train_derail.load(BASELINE, law='air')
        self.assertEqual((caught.exception.key, caught.exception.problem), ('law', 'may mean several keys'))
        self.assertIn('brakes.law', caught.exception.range)
        with self.assertRaises(train_derail.InputError):
            train_derail.load(BASELINE, weight='286 kip')  # of which block?
        with self.assertRaises(train_derail.InputError) as caught:
            train_derail.load(BASELINE, sped='20 mph')
        self.assertIn('sped', str(caught.exception))

    def test_errors_name_key_value_and_range(self):
        with self.assertRaises(train_derail.InputError) as caught:
            train_derail.run(BASELINE, speed='-5 mph')
        e = caught.exception
        self.assertIsInstance(e, ValueError)
        self.assertEqual((e.key, e.value), ('initial.speed', '-5 mph'))
        self.assertIn('m/s', e.range)
        for part in (e.where, e.key, e.value, e.problem, e.range):
            self.assertTrue(part)
            self.assertIn(part, str(e))
        with open(self.path('wrong.yaml'), 'w', encoding='utf-8') as file:
            file.write('base: %s\n\ninitial: {speed: fast}\n' % train_derail.load(BASELINE).source)
        with self.assertRaises(train_derail.InputError) as caught:
            train_derail.load(self.path('wrong.yaml'))
        self.assertEqual((caught.exception.where, caught.exception.key), (self.path('wrong.yaml') + ':3', 'initial.speed'))
        with open(self.path('study.yaml'), 'w', encoding='utf-8') as file:
            file.write(STUDY.format(base=train_derail.load(BASELINE).source))
        with self.assertRaises(train_derail.InputError) as caught:
            train_derail.run(self.path('study.yaml'))
        self.assertEqual((caught.exception.where, caught.exception.problem), (self.path('study.yaml'), 'is a study (derail study takes it)'))
        with self.assertRaises(train_derail.InputError) as caught:
            train_derail.study(SPACE)
        self.assertEqual(caught.exception.problem, 'is a scenario (derail run takes it)')
        with self.assertRaises(train_derail.InputError) as caught:
            train_derail.run('nowhere/there.yaml')
        self.assertEqual(caught.exception.where, 'nowhere/there.yaml')
        with self.assertRaises(train_derail.InputError) as caught:
            train_derail.ensemble(BASELINE, 3, {'initial.perturbation.spacing': 0, 'initial.perturbation.yaw_rate': 0})
        self.assertTrue(caught.exception.problem)

    def test_warnings_are_those_of_a_scenario(self):
        self.assertEqual([w for w in train_derail.load(BASELINE, coupler__slack='4 ft').warnings if 'coupler.slack' in w][:1],
                         [w for w in train_derail.run(BASELINE, coupler__slack='4 ft').outcome['warnings'] if 'coupler.slack' in w][:1])
        self.assertTrue(any('coupler.slack' in w for w in train_derail.load(BASELINE, coupler__slack='4 ft').warnings))

    def test_what_is_assumed_of_a_train_list_is_a_warning(self):
        train = os.path.join(os.path.dirname(os.path.abspath(__file__)), '..', '..', 'examples', 'train.csv')
        text = 'initial: {speed: 20 mph, yaw_rate: 0.1}\nstop: {time_max: 1 s}\nconsist: {file: %s}\n' % json.dumps(os.path.abspath(train))
        scenario = train_derail.loads(text)
        assumed = [w for w in scenario.warnings if 'a train list; assumed: tons: short tons' in w]
        self.assertEqual(len(assumed), 1, scenario.warnings)
        self.assertIn(assumed[0], train_derail.run(scenario).outcome['warnings'])

    def test_every_key_is_listed(self):
        for key in train_derail.load(ACCIDENT).keys():
            head, bracket, rest = key.partition('[')
            self.assertIn(head + '[i]' + rest.partition(']')[2] if bracket else key, train_derail.keys())


class PackageTest(Case):

    def test_messages_do_not_load_the_simulator(self):
        code = 'import sys, train_derail; print("numpy" in sys.modules, "train_derail._core" in sys.modules); train_derail.run; print("numpy" in sys.modules)'
        self.assertEqual(subprocess.check_output([sys.executable, '-c', code], text=True, cwd=self.folder), 'False False\nTrue\n')

    def test_all_names_are_there(self):
        self.assertEqual(sorted(set(train_derail.__all__) & set(dir(train_derail))), sorted(train_derail.__all__))
        for name in train_derail.__all__:
            self.assertIsNotNone(getattr(train_derail, name))
        with self.assertRaises(AttributeError):
            train_derail.nothing
        self.assertEqual('train_derail ' + train_derail.__version__, subprocess.check_output([DERAIL, '--version'], text=True).strip())

    def test_presets_are_found_from_elsewhere_and_a_file_here_comes_first(self):
        code = 'import train_derail; print(train_derail.load("config/baseline.yaml", title="here" if False else "there").source)'
        found = subprocess.check_output([sys.executable, '-c', code], text=True, cwd=self.folder).strip()
        self.assertTrue(os.path.isabs(found) and os.path.isfile(found), found)
        os.makedirs(self.path('config'))
        with open(self.path('config/baseline.yaml'), 'w', encoding='utf-8') as file:
            file.write(f'base: {found}\n')
        self.assertEqual(subprocess.check_output([sys.executable, '-c', code], text=True, cwd=self.folder).strip(), 'config/baseline.yaml')


if __name__ == '__main__':
    DERAIL = os.path.abspath(sys.argv.pop(1))
    unittest.main()
