"""Checks of `amontons doctor`: versions, processor, optional parts, a self-test against closed forms."""

from __future__ import annotations

import math
import os
import platform
import shutil
import sys
import time
from collections.abc import Callable, Iterator
from importlib.metadata import PackageNotFoundError, version
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from .. import _core
from ..model.builder import ModelBuilder
from ..model.model import Model
from ..model.parts import Material
from ..model.shapes import Box, Plane, Sphere
from ..simulation.rollout import rollout, usable_cores
from ..simulation.simulation import Simulation

REQUIRED = ("numpy", "scipy", "h5py")
# Extra of the package -> what it is for, and its modules with the distributions that bring them.
PARTS: dict[str, tuple[str, dict[str, str]]] = {
    "cli": (
        "the command, figures",
        {"typer": "typer", "rich": "rich", "matplotlib": "matplotlib", "PIL": "pillow"},
    ),
    "models": ("MJCF and URDF files", {"mujoco": "mujoco-core"}),
    "gym": ("environments for learning", {"gymnasium": "gymnasium", "mujoco": "mujoco-core"}),
    "view": ("the page of `amontons view`", {"viser": "viser"}),
    "studies": ("sweeps over many runs", {"loky": "loky", "pyarrow": "pyarrow"}),
}


def versions() -> dict[str, str]:
    """Versions of amontons, of its dependencies and of its build tools."""
    found = {"amontons": _version("amontons") or "not installed", "python": platform.python_version()}
    found |= {name: _version(name) or "missing" for name in REQUIRED}
    return found | {"compiler": _core.compiler()}


def machine() -> dict[str, Any]:
    """The processor, and what of it is used."""
    return {
        "system": f"{platform.system()} {platform.release()}",
        "processor": _processor(),
        "cores": usable_cores(),
        "instruction_set": _core.instruction_set(),
        "limited_by": os.environ.get("AMONTONS_ISA"),
    }


def parts() -> dict[str, dict[str, Any]]:
    """Extra -> what it is for, the versions of its modules (None where missing), how to get it."""
    found: dict[str, dict[str, Any]] = {}
    for extra, (purpose, modules) in PARTS.items():
        have = {module: _version(name) if find_spec(module) else None for module, name in modules.items()}
        complete = all(have.values())
        remedy = None if complete else f'pip install "amontons[{extra}]"'
        found[extra] = {"purpose": purpose, "installed": complete, "versions": have, "remedy": remedy}
    found["ffmpeg"] = {
        "purpose": "films",
        "installed": shutil.which("ffmpeg") is not None,
        "versions": {},
        "remedy": None if shutil.which("ffmpeg") else "install ffmpeg (Debian, Ubuntu: apt install ffmpeg)",
    }
    return found


def self_test() -> Iterator[dict[str, Any]]:
    """Each check as it is done: its name, whether it holds, what was measured, how long it took (s)."""
    for check in (_falls, _slides, _rests, _threads):
        start = time.perf_counter()
        try:
            holds, measured = check()
        except Exception as error:  # every fault of the installation must be reported
            holds, measured = False, f"{type(error).__name__}: {error}"
        seconds = time.perf_counter() - start
        yield {"check": check.__doc__, "passed": holds, "measured": measured, "seconds": seconds}


Check = Callable[[], tuple[bool, str]]


def _falls() -> tuple[bool, str]:
    """a ball falls on its parabola"""
    builder = ModelBuilder()
    builder.add_body("ball", shape=Sphere(0.1), density=1000, position=(0, 0, 5))
    sim = Simulation(builder.build(), dt=1e-2)
    sim.run(0.5)
    error = abs(sim.state.positions[0, 2] - (5 - 9.81 * 0.5**2 / 2))
    return error < 1e-12, f"off by {error:.0e} m"


def _slides() -> tuple[bool, str]:
    """a block slides until friction has stopped it"""
    builder = ModelBuilder()
    builder.add_geom(None, Plane(), material=Material(friction=0.4))
    builder.add_body("block", shape=Box((0.2, 0.2, 0.1)), density=500, position=(0, 0, 0.1),
                     linear_velocity=(1, 0, 0), material=Material(friction=0.4))  # fmt: skip
    sim = Simulation(builder.build(), dt=5e-3, tolerance=1e-8)
    sim.run(0.5)
    exact = 1 / (2 * 0.4 * 9.81)
    error = abs(sim.state.positions[0, 0] - exact)
    # The parabola is exact up to the step in which the block stops: it is slower there than mu g h.
    return error < 0.4 * 9.81 * sim.dt**2, f"{sim.state.positions[0, 0]:.4f} m of {exact:.4f} m"


def _tower() -> Model:
    builder = ModelBuilder()
    builder.add_geom(None, Plane())
    for k in range(12):
        place = (0.01 * (k % 2), 0, 0.1 + 0.2 * k)
        builder.add_body(f"box {k}", shape=Box((0.2, 0.2, 0.1)), density=500, position=place)
    return builder.build()


def _rests() -> tuple[bool, str]:
    """a tower stands, and the ground carries its weight"""
    sim = Simulation(_tower(), dt=5e-3)
    start = time.perf_counter()
    report = sim.run(0.2)
    rate = 40 / (time.perf_counter() - start)
    table = sim.contacts
    force = table[table["body_b"] == -1]["force"][:, 2].sum()
    weight = 9.81 * sim.model.total_mass
    holds = report.converged and math.isclose(force, weight, rel_tol=1e-4)
    return holds, f"residual {report.residual:.0e}, {force / weight:.6f} of the weight, {rate:.0f} steps/s"


def _threads() -> tuple[bool, str]:
    """the same bits with one thread and with several"""
    several, model = max(2, usable_cores()), _tower()
    one, many = (Simulation(model, dt=5e-3, threads=count) for count in (1, several))
    worlds = rollout(model, [one] * 4, steps=20, threads=several).simulations  # copies
    one.run(0.1), many.run(0.1)
    states = [sim.state.positions for sim in (one, many, *worlds)]
    return all(np.array_equal(states[0], other) for other in states), f"1 and {several} threads, 4 worlds"


def _version(name: str) -> str | None:
    try:
        return version(name)
    except PackageNotFoundError:
        return None


def _processor() -> str:
    if sys.platform == "linux":
        for line in Path("/proc/cpuinfo").read_text().splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()
