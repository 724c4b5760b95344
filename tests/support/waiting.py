"""Waits and times that hold on a machine that does other work."""

import os
import time
from contextlib import contextmanager
from pathlib import Path

LONGEST = 240.0
"""For what comes for certain (s): below the limit of a test, so that the failure tells what did not come."""


def until(condition, seconds=LONGEST):
    """Whether the condition holds before the time (s) is over: asked again and again."""
    end = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > end:
            return False
        time.sleep(0.02)
    return True


class Spent:
    seconds = 0.0


def _own_and_children():
    times = os.times()
    return times.user + times.system + times.children_user + times.children_system


@contextmanager
def processor_time():
    """Processor time (s) of this process and its ended children, which other programs do not lengthen."""
    spent, start = Spent(), _own_and_children()
    yield spent
    spent.seconds = _own_and_children() - start


def processor_time_of(number):
    """What a running process has used so far (s); 0 where the system does not tell."""
    try:
        fields = Path(f"/proc/{number}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return 0.0
    return sum(map(int, fields[11:13])) / os.sysconf("SC_CLK_TCK")
