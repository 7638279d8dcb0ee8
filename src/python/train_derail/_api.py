"""The names of the package train_derail."""

import functools
import json
import math
import os
import tempfile
from collections import abc
from dataclasses import dataclass
from typing import Any, Callable, Dict, List, Optional, Tuple, Union

import numpy as np

from train_derail import _core
from train_derail._core import InputError as InputError
from train_derail._core import __version__ as __version__
from train_derail._place import DATA
from train_derail._tables import Arrays, arrays, frame

Value = Union[str, float, int, bool, List[Any], Dict[str, Any]]
Changes = Optional[abc.Mapping[str, Value]]
Progress = Optional[Callable[[int, int], None]]
PathLike = Union[str, 'os.PathLike[str]']


class IntegrationError(RuntimeError):
    """The integration of a run failed; ``outcome`` is what there was of it."""

    def __init__(self, outcome: Dict[str, Any]) -> None:
        super().__init__(f"integration failed: {outcome['message']}")
        self.outcome = outcome


@dataclass(frozen=True)
class Field:
    """What is known of a value that comes out.

    >>> outcome_fields["lateral_reach"].unit
    'm'
    """

    name: str
    type: type  #: of the value
    unit: str  #: SI unit; '1' for pure numbers and counts, '' for flags and texts
    shown_unit: str  #: unit that people read; '' if it is the SI unit
    per_shown: float  #: SI value of one shown unit
    title: str  #: title in tables
    meaning: str  #: in one sentence
    choices: Tuple[str, ...]  #: values that a choice may have
    column: str  #: name of the column of CSV


def _fields(descriptions: abc.Iterable[Tuple[Any, ...]]) -> Dict[str, Field]:
    return {d[0]: Field(*d) for d in descriptions}


outcome_fields: Dict[str, Field] = _fields(_core.outcome_fields())
car_fields: Dict[str, Field] = _fields(_core.car_fields())
coupler_fields: Dict[str, Field] = _fields(_core.coupler_fields())


def _found(path: PathLike) -> str:
    """The path, or what is installed there: "config/baseline.yaml" is found from everywhere."""
    path = os.fspath(path)
    installed = os.path.join(os.path.dirname(os.path.abspath(__file__)), DATA, path)
    if not os.path.exists(path) and not os.path.isabs(path) and os.path.exists(installed):
        return os.path.normpath(installed)
    return path


@functools.lru_cache(maxsize=None)
def keys() -> Tuple[str, ...]:
    """Every key of a scenario, ``consist[i]`` standing for each block of cars; ``derail keys`` explains them.

    >>> "initial.speed" in keys()
    True
    """
    return tuple(line for line in _core.describe_keys().splitlines() if not line.startswith(' '))


@functools.lru_cache(maxsize=None)
def _key(name: str) -> str:
    """The key that a keyword argument means."""
    if name in keys():
        return name
    if '__' in name:
        return name.replace('__', '.')
    initial = f'initial.{name}'
    if initial in keys():
        return initial
    ends = [key for key in keys() if key.split('.')[-1] == name]
    if len(ends) == 1 and '[' not in ends[0]:
        return ends[0]
    error = InputError(f"keyword argument: {name}: {'may mean several keys' if ends else 'no such key'}"
                       + (f"; allowed, as in {{'{ends[0]}': ...}}: {', '.join(ends)}" if ends else ': derail keys'))
    error.where, error.key, error.value = 'keyword argument', name, ''
    error.problem, error.range = 'may mean several keys' if ends else 'no such key', ', '.join(ends)
    raise error


def _written(value: Any) -> str:
    """A value as it would be written in a scenario file."""
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, str):
        return value
    if isinstance(value, float) and math.isinf(value):
        return '.inf' if value > 0 else '-.inf'
    if isinstance(value, (bool, int, float, list, tuple, dict)):
        return json.dumps(value)  # which is YAML
    raise TypeError(f'a {type(value).__name__} cannot be the value of an input: {value!r}')


def _changes(changes: Changes, short: abc.Mapping[str, Value]) -> List[Tuple[str, str]]:
    pairs = [(key, _written(value)) for key, value in (changes or {}).items()]
    return pairs + [(_key(name), _written(value)) for name, value in short.items()]


def _number(text: str, whole: bool) -> Union[int, float]:
    return math.inf if text == '.inf' else int(text) if whole else float(text)


class Scenario:
    """All inputs of a run. It does not change: ``changed`` returns another one.

    >>> scenario = load("config/baseline.yaml", speed="50 mph")
    >>> scenario["initial.speed"]
    22.352
    >>> scenario.changed({"consist[0].count": 80})["consist[0].count"]
    80
    """

    def __init__(self, core: _core.Scenario) -> None:
        self._core = core
        self._read: Dict[str, Union[str, float, int]] = {}  # when first asked for

    def changed(self, changes: Changes = None, **short: Value) -> 'Scenario':
        """Returns the scenario with inputs changed, as ``derail run --set`` does; see ``load``."""
        return Scenario(self._core.changed(_changes(changes, short)))

    def __getitem__(self, key: str) -> Union[str, float, int]:
        """The value of an input, numbers in SI units."""
        return self._values[key]

    def keys(self) -> List[str]:
        """The keys that have a value, in the order of a scenario file."""
        return list(self._values)

    def items(self) -> List[Tuple[str, Union[str, float, int]]]:
        """Keys and values."""
        return list(self._values.items())

    @property
    def _values(self) -> Dict[str, Union[str, float, int]]:
        if not self._read:
            self._read = {key: _number(value, whole) if unit else value
                          for key, value, unit, _, whole, _ in self._core.key_values()}
        return self._read

    @property
    def title(self) -> str:
        """Title, as tables and pictures show it."""
        return self._core.title

    @property
    def source(self) -> str:
        """Path of its file."""
        return self._core.source

    @property
    def warnings(self) -> List[str]:
        """What is allowed, but unusual or without effect; to be looked at before the results are believed."""
        return self._core.warnings()

    def to_yaml(self) -> str:
        """The whole scenario in SI units, all defaults filled in, as ``derail check`` prints it."""
        return self._core.to_yaml()

    def write(self, path: PathLike, replace: bool = False) -> None:
        """Writes it as a scenario file, whole or not at all. FileExistsError: there is one, and ``replace`` is false."""
        _core.write_file(os.fspath(path), self.to_yaml(), replace)

    def __repr__(self) -> str:
        return f'<train_derail.Scenario {self.title or self.source!r}>'


def load(path: PathLike, changes: Changes = None, **short: Value) -> Scenario:
    """Reads a scenario file.

    A path that does not exist from here is looked for in what is installed: ``config/baseline.yaml`` is always found.
    ``changes`` are keys and values as in a scenario file: ``{"consist[0].weight": "286 kip"}``; a bare number is SI.
    A keyword argument is a key (``model``), a key of ``initial`` (``speed``), a key with ``__`` for the point
    (``coupler__slack``), or the end of the only key that ends so.

    Raises InputError.
    """
    return Scenario(_core.read_scenario_file(_found(path), _changes(changes, short)))


def loads(yaml: str, changes: Changes = None, source: str = 'text', **short: Value) -> Scenario:
    """Reads a scenario from the text of a file; ``source`` is its name in errors."""
    return Scenario(_core.read_scenario_text(yaml, source, _changes(changes, short)))


def _scenario(what: Union[Scenario, PathLike], changes: Changes, short: abc.Mapping[str, Value]) -> Scenario:
    if not isinstance(what, Scenario):
        return load(what, changes, **short)
    return what.changed(changes, **short) if changes or short else what


def _incidents(text: str) -> Arrays:
    return arrays(text, {})


class Simulation:
    """A run that is stepped. The result does not depend on the steps, bit for bit.

    While a method computes, other threads of Python go on; threads that compute at a time need a simulation each.
    Ctrl-C interrupts it; it can be gone on with.

    >>> simulation = Simulation("config/baseline.yaml")
    >>> simulation.advance(2.0)
    >>> simulation.time, simulation.cars["x"].shape
    (2.0, (60,))
    """

    def __init__(self, scenario: Union[Scenario, PathLike], changes: Changes = None, **short: Value) -> None:
        self.scenario: Scenario = _scenario(scenario, changes, short)  #: its inputs
        self._core = _core.Simulation(self.scenario._core)

    @classmethod
    def restored(cls, path: PathLike, changes: Changes = None, **short: Value) -> 'Simulation':
        """Goes on from a file of ``save``, or of ``derail run --checkpoint``: bit for bit the same run, or with inputs
        that are changed from there on, as by ``load``. Raises InputError."""
        made = cls.__new__(cls)
        made.scenario = Scenario(_core.saved_scenario(os.fspath(path)))
        if changes or short:
            made.scenario = made.scenario.changed(changes, **short)
        made._core = _core.Simulation(made.scenario._core, os.fspath(path))
        return made

    def save(self, path: PathLike, replace: bool = False) -> None:
        """Saves the run as it stands, whole or not at all, as ``derail run --checkpoint``. InputError unless
        ``solver.method`` is ``semi_implicit``; FileExistsError: there is a file, and ``replace`` is false."""
        self._core.save(os.fspath(path), replace)

    def advance(self, t: float) -> None:
        """Runs on to simulated time ``t`` [s], or to the end of the run if that comes first. A time that is over does
        nothing; InputError: one before the run begins."""
        self._core.advance(t)

    def step(self) -> bool:
        """Runs on to the next point of the output grid; false: it had ended before."""
        if self.ended:
            return False
        self._core.step()
        return True

    def run(self) -> None:
        """Runs to the end."""
        self._core.run()

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return self._core.time

    @property
    def ended(self) -> bool:
        """Nothing moves any more, the time limit is reached, or the integration has failed: ``outcome["ended"]``."""
        return self._core.ended

    @property
    def cars(self) -> Arrays:
        """The cars now: an array of one value a car for each of ``car_fields``."""
        return self._core.cars()

    @property
    def couplers(self) -> Arrays:
        """The couplers now, by ``coupler_fields``; coupler i joins cars i and i + 1 of the arrays."""
        return self._core.couplers()

    @property
    def outcome(self) -> Dict[str, Any]:
        """The outcome so far, by ``outcome_fields``: what ``derail run --json`` writes. Cars count from 1 in it."""
        return self._core.outcome()

    @property
    def incidents(self) -> Arrays:
        """The incidents so far, the columns of ``derail run --incidents``; NaN or '' where one does not apply."""
        return _incidents(self._core.incidents())


class Run:
    """A run that is over: made by ``run``."""

    def __init__(self, simulation: Simulation, states: Optional[Dict[str, Any]]) -> None:
        self.scenario: Scenario = simulation.scenario  #: its inputs
        self.outcome: Dict[str, Any] = simulation.outcome  #: by ``outcome_fields``, as ``derail run --json`` writes it
        self.incidents: Arrays = simulation.incidents  #: the columns of ``derail run --incidents``
        self._recorded = states

    @property
    def _states(self) -> Dict[str, Any]:
        # The same run again, bit for bit: who only wants the outcome does not pay for states.
        if self._recorded is None:
            self._recorded = Simulation(self.scenario)._core.record()
        return self._recorded

    @property
    def time(self) -> 'np.ndarray[Any, Any]':
        """Times of the states [s]: the output grid. Unless ``run`` was called with ``states=True``, the first use of
        time, cars, couplers or table computes the run once more."""
        times: 'np.ndarray[Any, Any]' = self._states['time']
        return times

    @property
    def cars(self) -> Arrays:
        """The cars over time: for each of ``car_fields`` an array of times by cars."""
        cars: Arrays = self._states['cars']
        return cars

    @property
    def couplers(self) -> Arrays:
        """The couplers over time: for each of ``coupler_fields`` an array of times by couplers."""
        couplers: Arrays = self._states['couplers']
        return couplers

    @property
    def table(self) -> Any:
        """The table of ``derail run --csv``: one row a time and car, with the coupler behind it (NaN for the last
        car). A pandas.DataFrame, or a dict of arrays without pandas."""
        times, n = self.cars['x'].shape
        columns = {'time_s': np.repeat(self.time, n), 'car': np.tile(np.arange(1, n + 1), times)}
        for name, values in self.cars.items():
            columns[car_fields[name].column] = values.ravel()
        for name, values in self.couplers.items():
            padded = np.full((times, n), np.nan)
            padded[:, :-1] = values
            columns[coupler_fields[name].column] = padded.ravel()
        return frame(columns)

    def __repr__(self) -> str:
        return f"<train_derail.Run {self.scenario.title!r}: {self.outcome['cars_off_track']} cars off the track>"


def run(scenario: Union[Scenario, PathLike], changes: Changes = None, *, states: bool = False, **short: Value) -> Run:
    """Runs a scenario, or a scenario file, to its end; inputs are changed as by ``load``.

    ``states``: keep the states on the output grid at once; see ``Run.time``. Raises InputError, and IntegrationError
    if the integration failed.

    >>> run("config/baseline.yaml").outcome["ended"]
    'at_rest'
    """
    simulation = Simulation(scenario, changes, **short)
    recorded = None
    if states:
        recorded = simulation._core.record()
    else:
        simulation.run()
    result = Run(simulation, recorded)
    if result.outcome['ended'] == 'integration_failed':
        raise IntegrationError(result.outcome)
    return result


#: Types of the columns of runs.csv; of the others the content tells.
_RUN_KINDS: Dict[str, type] = {**{name: field.type for name, field in outcome_fields.items()}, 'warnings': str}


class Ensemble:
    """Many runs of one scenario that differ by their perturbation: made by ``ensemble``."""

    def __init__(self, scenario: Scenario, outcomes: List[Dict[str, Any]], runs: str, summary: str,
                 warnings: List[str]) -> None:
        self.scenario: Scenario = scenario  #: its inputs
        self.outcomes: List[Dict[str, Any]] = outcomes  #: one dict a run, as ``Run.outcome``
        self.summary: Dict[str, Any] = json.loads(summary)  #: medians and ranges, as ``derail run --seeds --json``
        #: What to look at before the numbers are believed.
        self.warnings: List[str] = [*warnings, *self.summary['warnings']]
        self._runs = arrays(runs, _RUN_KINDS)

    def __getitem__(self, name: str) -> 'np.ndarray[Any, Any]':
        """One value of all runs, by the names of ``outcome_fields``."""
        return np.array([outcome[name] for outcome in self.outcomes])

    def __len__(self) -> int:
        return len(self.outcomes)

    @property
    def table(self) -> Any:
        """The table of ``derail run --seeds --csv``: one row a run. A pandas.DataFrame, or a dict of arrays."""
        return frame(self._runs)


def ensemble(scenario: Union[Scenario, PathLike], seeds: int, changes: Changes = None, *, jobs: int = 0,
             progress: Progress = None, **short: Value) -> Ensemble:
    """Runs a scenario ``seeds`` times, each with its own perturbation, as ``derail run --seeds``.

    ``seeds``: 2 or more. ``jobs``: threads; 0: one a core. They do not hold the interpreter. The results do not depend
    on their number.
    ``progress(done, total)`` is called now and then. Raises InputError, also if the runs could not differ. A run whose
    integration failed stays in the results: ``outcome["ended"]``.

    >>> many = ensemble("config/baseline.yaml", 4, {"initial.perturbation.spacing": 0.01})
    >>> many["cars_off_track"].shape
    (4,)
    """
    made = _scenario(scenario, changes, short)
    return Ensemble(made, *_core.ensemble(made._core, seeds, jobs, progress))


class StudyResults:
    """The tables of a study: made by ``study``, or read from a folder of ``derail study``."""

    def __init__(self, folder: PathLike) -> None:
        def table(name: str) -> Optional[Arrays]:
            path = os.path.join(os.fspath(folder), name)
            if not os.path.exists(path):
                return None
            with open(path, encoding='utf-8', newline='') as file:
                return arrays(file.read(), _RUN_KINDS)

        with open(os.path.join(os.fspath(folder), 'about.json'), encoding='utf-8') as file:
            self.about: Dict[str, Any] = json.load(file)  #: the study, units of the columns, version, warnings
        self.warnings: List[str] = list(self.about['warnings'])  #: to be looked at before the numbers are believed
        self._tables = {name: table(f'{name}.csv') for name in ('runs', 'summary', 'sobol')}

    def _frame(self, name: str) -> Any:
        columns = self._tables[name]
        return None if columns is None else frame(columns)

    @property
    def table(self) -> Any:
        """runs.csv: one row a run, with its inputs. A pandas.DataFrame, or a dict of arrays without pandas."""
        return self._frame('runs')

    @property
    def summary(self) -> Any:
        """summary.csv: medians and ranges of each outcome at each point."""
        return self._frame('summary')

    @property
    def sobol(self) -> Any:
        """sobol.csv: shares of the variance; None unless the plan is saltelli."""
        return self._frame('sobol')


def study(path: PathLike, changes: Changes = None, *, out: Optional[PathLike] = None, resume: bool = False,
          replicates: Optional[int] = None, jobs: int = 0, progress: Progress = None, **short: Value) -> StudyResults:
    """Runs a study file, as ``derail study``; ``changes`` and keyword arguments change its base scenario.

    ``out``: folder for the results, which ``derail`` can go on with or report; without it they are kept in memory only.
    ``resume``: compute only what the folder lacks. ``replicates``: runs a point instead of the study's number. The rest
    is as for ``ensemble``. After Ctrl-C the runs that were done are in ``out``.
    """
    def compute(folder: str) -> StudyResults:
        warnings = _core.run_study(_found(path), folder, _changes(changes, short), replicates, jobs, resume, progress)
        results = StudyResults(folder)
        results.warnings = warnings
        return results

    if out is not None:
        return compute(os.fspath(out))
    with tempfile.TemporaryDirectory(prefix='train_derail_') as folder:
        return compute(folder)
