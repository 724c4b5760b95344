"""Shared by all tests that pytest runs."""

from contextlib import ExitStack
from pathlib import Path

import pytest

try:
    import fcntl
except ImportError:  # Windows: there tests run one after another
    fcntl = None


@pytest.fixture(autouse=True)
def one_at_a_time(request, tmp_path_factory):
    """Lets a test with the marker `alone` run while no other worker of pytest-xdist runs a test.

    Such a test measures seconds, which other tests on the same processors would lengthen. Every test holds a
    lock of its session: an exclusive one, or one that tests share. A second lock is the queue: a test that
    waits for the exclusive one holds it, so that no other test overtakes.
    """
    if fcntl is None or not hasattr(request.config, "workerinput"):
        yield
        return
    alone = request.node.get_closest_marker("alone") is not None
    folder: Path = tmp_path_factory.getbasetemp().parent  # one for all workers
    with ExitStack() as files:
        queue, lock = (files.enter_context((folder / name).open("a")) for name in ("queue", "lock"))
        fcntl.flock(queue, fcntl.LOCK_EX)
        fcntl.flock(lock, fcntl.LOCK_EX if alone else fcntl.LOCK_SH)
        fcntl.flock(queue, fcntl.LOCK_UN)
        yield
