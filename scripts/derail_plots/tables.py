"""Tables that the program has written."""

import contextlib
import csv

from derail_plots.errors import DataError


@contextlib.contextmanager
def table(path, command):
    """Rows of the CSV file that `command` writes, as dictionaries. Throws DataError, also for whatever a row lacks inside the block."""
    try:
        with open(path, encoding='utf-8', newline='') as file:
            yield csv.DictReader(file)
    except OSError as e:
        raise DataError(f'{path}: {e.strerror}; `{command}` writes it') from None
    except (KeyError, TypeError, ValueError):
        raise DataError(f'{path}: not a table of `{command}`, or a number is missing') from None
