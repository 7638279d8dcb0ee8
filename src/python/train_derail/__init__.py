"""Simulates how a train derails.

>>> import train_derail
>>> run = train_derail.run("config/baseline.yaml", speed="55 mph")
>>> run.outcome["cars_off_track"] > 15
True

``run`` computes one run, ``Simulation`` one that is stepped, ``ensemble`` and ``study`` many on all cores. ``load``
reads a scenario, which can be changed and written. Names are those of JSON and CSV: ``outcome_fields``,
``car_fields``, ``coupler_fields`` describe them. Numbers are in SI units. A wrong input raises ``InputError``.

In a ROS workspace the messages lie beside it: ``train_derail.msg``, ``train_derail.srv``. Who imports these does not
load the simulator: it is loaded when one of its names is first used.
"""

import importlib

__all__ = [
    'Ensemble',
    'Field',
    'InputError',
    'IntegrationError',
    'Run',
    'Scenario',
    'Simulation',
    'StudyResults',
    '__version__',
    'car_fields',
    'coupler_fields',
    'ensemble',
    'keys',
    'load',
    'loads',
    'outcome_fields',
    'run',
    'study',
]


def __getattr__(name):
    if name not in __all__:
        raise AttributeError(f"module 'train_derail' has no attribute '{name}'")
    value = getattr(importlib.import_module('train_derail._api'), name)
    globals()[name] = value
    return value


def __dir__():
    return sorted(set(globals()) | set(__all__))
