"""Waiting in tests: for a condition, with a bound."""

import threading
import time


def wait_for(condition, limit):
    """Whether the condition came true within `limit` wall seconds; asked over and over."""
    deadline = time.monotonic() + limit
    pause = threading.Event()
    while not condition():
        if time.monotonic() > deadline:
            return False
        pause.wait(0.02)
    return True
