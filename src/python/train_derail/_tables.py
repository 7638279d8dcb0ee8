"""Tables of CSV as dicts of arrays, and as frames where pandas is there."""

import csv
import importlib
import io
from typing import Any, Dict, List

import numpy as np

Arrays = Dict[str, 'np.ndarray[Any, Any]']


def _column(texts: List[str], kind: type) -> 'np.ndarray[Any, Any]':
    """Numbers where all are numbers, an empty one is NaN; whole numbers unless the column is known to hold others."""
    if kind is str or not any(texts):
        return np.array(texts, dtype=object)
    if kind is not float and all(texts):
        try:
            return np.array([int(text) for text in texts])
        except ValueError:
            pass
    try:
        return np.array([float(text or 'nan') for text in texts])
    except ValueError:
        return np.array(texts, dtype=object)


def arrays(text: str, kinds: Dict[str, type]) -> Arrays:
    """Reads CSV; kinds: types of columns that are known."""
    names, *rows = csv.reader(io.StringIO(text))
    columns = list(zip(*rows)) or [()] * len(names)
    return {name: _column(list(column), kinds.get(name, object)) for name, column in zip(names, columns)}


def frame(columns: Arrays) -> Any:
    """The columns as a pandas.DataFrame, or as they are where pandas is not installed."""
    try:
        # By its name: it has no type hints, for which releases of mypy have different words.
        pandas: Any = importlib.import_module('pandas')
    except ImportError:
        return columns
    return pandas.DataFrame(columns)
