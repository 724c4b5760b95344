"""Shared by all tests that pytest runs."""

import os
import signal
import sys
import tempfile
import time
from contextlib import ExitStack
from pathlib import Path

import pytest
from core_room import pytest_addoption, pytest_configure, pytest_ignore_collect  # noqa: F401
from hypothesis import HealthCheck, settings
from skipped import pytest_sessionfinish, pytest_terminal_summary  # noqa: F401

try:
    import fcntl
except ImportError:  # Windows: there tests run one after another
    fcntl = None

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tools"))
sys.path.append(str(ROOT / "tools" / "website"))  # names that others might have, too: last

# A shell starts what runs in the background with Ctrl-C ignored; programs that tests start would inherit it.
if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

# Programs print alike in every terminal: as in CI, where the cursor cannot be moved.
os.environ["TERM"] = "dumb"

# Wall-clock limits per example would fail on a loaded machine. In CI examples are the same in every run.
settings.register_profile("local", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.register_profile("ci", settings.get_profile("local"), derandomize=True)
settings.load_profile("ci" if os.environ.get("CI") else "local")


@pytest.fixture(scope="session")
def root() -> Path:
    """The root of the repository."""
    return ROOT


# What the wait for tests of other workers may take (s): each of them has a limit of its own.
LOCK_LIMIT = 1800
LOCKED = pytest.StashKey[bool]()


@pytest.hookimpl(optionalhook=True)
def pytest_configure_node(node):
    """Tells a worker of pytest-xdist the folder of the locks that all of them share."""
    config = node.config
    if not hasattr(config, "locks"):
        config.locks = tempfile.TemporaryDirectory(prefix="amontons-locks-")
        config.add_cleanup(config.locks.cleanup)
    node.workerinput["locks"] = config.locks.name


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_runtest_protocol(item):
    """Lets a test with the marker `alone` run while no other worker of pytest-xdist runs a test.

    Such a test compares times, which other tests on the same processors would lengthen. Every test holds a
    lock of its session: an exclusive one, or one that tests share. A second lock is the queue: a test that
    waits for the exclusive one holds it, so that no other test overtakes. The limit
    of the test begins after the wait.
    """
    if fcntl is None or not hasattr(item.config, "workerinput"):
        return (yield)
    alone = item.get_closest_marker("alone") is not None
    folder = Path(item.config.workerinput["locks"])
    with ExitStack() as files:
        queue, lock = (files.enter_context((folder / name).open("a")) for name in ("queue", "lock"))
        end = time.monotonic() + LOCK_LIMIT
        item.stash[LOCKED] = locked(queue, fcntl.LOCK_EX, end) and locked(
            lock, fcntl.LOCK_EX if alone else fcntl.LOCK_SH, end
        )
        fcntl.flock(queue, fcntl.LOCK_UN)
        return (yield)


def locked(file, kind, end):
    """Whether the lock could be had before the time `end`."""
    while True:
        try:
            fcntl.flock(file, kind | fcntl.LOCK_NB)
            return True
        except BlockingIOError:
            if time.monotonic() > end:
                return False
        time.sleep(0.01)


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item):
    """Fails a test that waited too long for the others."""
    if not item.stash.get(LOCKED, True):
        pytest.fail(f"tests of other workers have not ended in {LOCK_LIMIT} s", pytrace=False)
