"""Groups of tests that need more than `make install`: why they are skipped, and the command that adds each."""

import importlib.util
import os
import re
import shutil
from collections import Counter
from collections.abc import Callable
from typing import NamedTuple

import browser
import problems


class Group(NamedTuple):
    """Tests that are skipped for one reason."""

    name: str
    reason: str
    """a regular expression that finds it"""
    command: str
    here: Callable[[], bool]
    """whether this machine has what they need, so that the skip is a fault"""


def always() -> bool:
    return True


GROUPS = (
    Group(
        "the page in a browser",
        "Chromium|no browser",
        "make browser, or as root: apt-get install chromium",
        lambda: any(map(shutil.which, browser.PROGRAMS)),
    ),
    Group(
        "devices by OpenCL",
        "pyopencl|OpenCL driver",
        "make pocl",
        lambda: importlib.util.find_spec("pyopencl") is not None,
    ),
    Group(
        "files of other projects",
        "AMONTONS_DATA|no models in",
        "AMONTONS_DATA=FOLDER make test",
        problems.DATA.is_dir,
    ),
    Group(
        "Stable-Baselines3",
        "Stable-Baselines3",
        ".venv/bin/pip install stable-baselines3",
        lambda: importlib.util.find_spec("stable_baselines3") is not None,
    ),
    Group(
        "films by FFmpeg",
        "ffmpeg",
        "as root: apt-get install ffmpeg",
        lambda: shutil.which("ffmpeg") is not None,
    ),
    Group(
        "the documentation site and notebooks",
        r"make docs|amontons\[docs\]",
        "make docs",
        lambda: importlib.util.find_spec("mkdocs") is not None,
    ),
    Group(
        "optional packages",
        "could not import|[Nn]eeds (viser|usd-core|Playwright)|pip install playwright",
        '.venv/bin/pip install -e ".[test]"',
        always,
    ),
)


def summary(reasons: list[str]) -> tuple[list[str], list[str]]:
    """A line for each group that is skipped, and the names of those that this machine could run."""
    counts = Counter(
        next((group for group in GROUPS if re.search(group.reason, reason)), None) for reason in reasons
    )
    lines = [f"{n} tests of {group.name}; add them: {group.command}" for group, n in counts.items() if group]
    return lines, [group.name for group in counts if group and group.here()]


def in_ci() -> bool:
    return bool(os.environ.get("CI"))
