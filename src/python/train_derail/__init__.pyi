from train_derail._api import Ensemble as Ensemble
from train_derail._api import Field as Field
from train_derail._api import InputError as InputError
from train_derail._api import IntegrationError as IntegrationError
from train_derail._api import Run as Run
from train_derail._api import Scenario as Scenario
from train_derail._api import Simulation as Simulation
from train_derail._api import StudyResults as StudyResults
from train_derail._api import __version__ as __version__
from train_derail._api import car_fields as car_fields
from train_derail._api import coupler_fields as coupler_fields
from train_derail._api import ensemble as ensemble
from train_derail._api import keys as keys
from train_derail._api import load as load
from train_derail._api import loads as loads
from train_derail._api import outcome_fields as outcome_fields
from train_derail._api import run as run
from train_derail._api import study as study

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
