"""What a run of the tests left out: each group with the one command that adds it.

tests/conftest.py takes the two hooks. In CI a group that this machine could run is a failure.
"""

from __future__ import annotations

import os
import platform
import re
import shutil
import sys
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass

import pytest
from problems import DATA

INSTALL = ".venv/bin/python -m pip install"


def always() -> bool:
    return True


def has_browser() -> bool:
    """Whether Chromium is there, or Debian's package can be had."""
    names = ("chromium", "chromium-browser", "google-chrome")
    return any(map(shutil.which, names)) or (bool(shutil.which("apt-get")) and os.geteuid() == 0)


def has_pocl() -> bool:
    return sys.platform == "linux" and platform.machine() == "x86_64"


@dataclass(frozen=True)
class Group:
    """Tests that need the same thing."""

    name: str
    reason: str
    """a pattern of the reason with which they are skipped"""
    command: str
    """what adds the thing"""
    possible: Callable[[], bool] = always
    """whether it can be had on this machine: CI then fails"""


GROUPS = (
    Group(
        "a browser",
        r"no browser|Chromium",
        "apt-get install chromium (as root), or make browser",
        has_browser,
    ),
    Group("OpenCL on the processor", r"pyopencl|OpenCL driver", "make pocl", has_pocl),
    Group("the site", r"site is not built|griffe|latex2mathml|cxxheaderparser", "make docs"),
    Group(
        "the engine of pages",
        r"playground",
        "apt-get install emscripten npm (as root), make playground",
        lambda: False,
    ),
    Group("notebooks", r"amontons\[docs\]", "make docs"),
    Group("the compiled module of a build folder", r"build/python is not there", "make install"),
    Group("ffmpeg", r"ffmpeg", "apt-get install ffmpeg (as root)", lambda: bool(shutil.which("ffmpeg"))),
    Group(
        "counts of instructions",
        r"valgrind",
        "apt-get install valgrind (as root), cmake --build build/python --target step_work",
        lambda: False,
    ),
    Group("Stable-Baselines3", r"Stable-Baselines3", f"{INSTALL} stable-baselines3", lambda: False),
    Group("PyTorch and JAX", r"PyTorch|JAX", f"{INSTALL} torch jax", lambda: False),
    Group(
        "files of other projects",
        r"AMONTONS_DATA|^no (model|models in) /",
        "AMONTONS_DATA=FOLDER make test",
        DATA.is_dir,
    ),
    Group("the history of the repository", r"no git history", "git fetch --unshallow", lambda: False),
    Group("packages of tests", r"could not import|pip install|^needs ", f"{INSTALL} -e '.[test]'"),
)


def group_of(reason: str) -> Group | None:
    """The group of a skipped test; None for a case that has nothing to test on any machine."""
    return next((group for group in GROUPS if re.search(group.reason, reason)), None)


def reasons(reports: list[pytest.TestReport | pytest.CollectReport]) -> list[str]:
    return [str(report.longrepr[2]).removeprefix("Skipped: ") for report in reports]  # type: ignore[index]


def left_out(found: list[str]) -> Counter[Group]:
    """How many skipped tests, or files of tests, each group has."""
    return Counter(group for group in map(group_of, found) if group is not None)


def pytest_sessionfinish(session: pytest.Session) -> None:
    reporter = session.config.pluginmanager.get_plugin("terminalreporter")
    if reporter is None or hasattr(session.config, "workerinput"):
        return
    groups = left_out(reasons(reporter.stats.get("skipped", [])))
    if os.environ.get("CI") and any(group.possible() for group in groups) and session.exitstatus == 0:
        session.exitstatus = pytest.ExitCode.TESTS_FAILED


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    groups = left_out(reasons(terminalreporter.stats.get("skipped", [])))
    if not groups:
        return
    terminalreporter.section("left out on this machine")
    for group, count in groups.most_common():
        failed = (
            "; this machine could run them, which CI demands"
            if os.environ.get("CI") and group.possible()
            else ""
        )
        terminalreporter.line(f"{count} skipped for want of {group.name}: {group.command}{failed}")
