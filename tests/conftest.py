"""Shared by all tests that pytest runs."""

import os
import sys
from contextlib import ExitStack
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings
from skipped import pytest_sessionfinish, pytest_terminal_summary  # noqa: F401

try:
    import fcntl
except ImportError:  # Windows: there tests run one after another
    fcntl = None

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tools"))
sys.path.append(str(ROOT / "tools" / "website"))  # names that others might have, too: last

# Wall-clock limits per example would fail on a loaded machine. In CI examples are the same in every run.
settings.register_profile("local", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.register_profile("ci", settings.get_profile("local"), derandomize=True)
settings.load_profile("ci" if os.environ.get("CI") else "local")


@pytest.fixture(scope="session")
def root() -> Path:
    """The root of the repository."""
    return ROOT


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
