"""An engine to the comparison: an adapter (`in_X.py`) with settings, which runs in a process of its own."""

from __future__ import annotations

import contextlib
import importlib
import importlib.util
import itertools
import json
import os
import select
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import date
from functools import cache
from pathlib import Path
from statistics import fmean, median
from types import ModuleType
from typing import Any

import numpy as np
from amontons.report.health import machine

from .plain import Motion, Scene, Unsupported, Variant

HERE = Path(__file__).resolve().parent
ENVIRONMENTS = HERE.parents[1] / "build" / "engines"
NAMES = ("amontons", "mujoco", "drake", "dart", "pybullet", "rapier", "newton", "exudyn")
PATIENCE = 60.0
"""s that an answer may take; then the process is ended, and with it all its scenes."""


class Worker:
    """A process that answers a line with a line."""

    def __init__(self, python: str, *words: str) -> None:
        one = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "RAYON_NUM_THREADS"), "1")
        self.process = subprocess.Popen(
            [python, "-m", *words],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
            cwd=HERE.parent, env={**os.environ, **one},
        )  # fmt: skip
        self.numbers = itertools.count()

    def ask(self, patience: float = PATIENCE, **order: Any) -> dict[str, Any]:
        """Raises Unsupported with what the engine does not have, or how its process ended."""
        assert self.process.stdin
        assert self.process.stdout
        try:
            self.process.stdin.write(json.dumps(order).encode() + b"\n")
            self.process.stdin.flush()
        except BrokenPipeError:
            pass
        if not select.select([self.process.stdout], [], [], patience)[0]:
            self.end()
            raise Unsupported(f"answer within {patience:g} s")
        line = self.process.stdout.readline()
        if not line:
            raise Unsupported(f"way on: its process ended with {self.process.wait()}")
        found: dict[str, Any] = json.loads(line)
        if "unsupported" in found:
            raise Unsupported(found["unsupported"])
        return found

    def lives(self) -> bool:
        return self.process.poll() is None

    def end(self) -> None:
        self.process.kill()
        self.process.wait()


class Running:
    def __init__(self, worker: Worker, scene: Scene, dt: float, options: Mapping[str, Any]) -> None:
        self.worker, self.where = worker, next(worker.numbers)
        # A first start compiles kernels in some engines.
        self.version = worker.ask(
            600.0, do="start", where=self.where, scene=scene.as_dict(), dt=dt, options=dict(options)
        )["version"]  # fmt: skip

    def advance(self, steps: int) -> float:
        """The processor time (s)."""
        return float(self.worker.ask(do="advance", where=self.where, steps=steps)["time"])

    def ask(self, what: str) -> dict[str, Any]:
        return self.worker.ask(do=what, where=self.where)

    def motion(self) -> Motion:
        return Motion(*(np.array(values, dtype=float) for values in self.ask("motion").values()))

    def contacts(self) -> np.ndarray[Any, Any]:
        """As `law_left` takes them."""
        return np.array(self.ask("contacts")["contacts"], dtype=float).reshape(-1, 12)

    def save(self) -> None:
        self.ask("save")

    def restore(self) -> None:
        self.ask("restore")

    def close(self) -> None:
        with contextlib.suppress(Unsupported):
            self.ask("close")


@dataclass
class Timed:
    """A scene under way that takes turns with others."""

    running: Running
    times: list[float] = field(default_factory=list, kw_only=True)
    """processor time per step of each part (s)"""
    why: str = field(default="", kw_only=True)
    """it makes no further part"""

    def go_on(self, steps: int) -> bool:
        """Whether the part was made."""
        try:
            self.times.append(self.running.advance(steps) / steps)
        except Unsupported as missing:
            self.why = f"no {missing}"
        return not self.why

    def columns(self, steps: int, dt: float, reference: Sequence[float]) -> dict[str, Any]:
        """`time`: the mean of a step (s); `ratio`: to the reference, the median of equal parts of so many
        steps, so that a disturbance of some does not count. `load`: programs that ran in the last minute,
        over all cores."""
        mean, pairs = fmean(self.times), list(zip(self.times, reference, strict=False))
        return {
            "time": mean, "cost": mean / dt, "ratio": median(a / b for a, b in pairs) if pairs else "",
            "timed": steps * len(self.times), "machine": machine()["processor"],
            "load": round(os.getloadavg()[0], 1), "timed_on": date.today().isoformat(),
        }  # fmt: skip


_workers: dict[str, Worker] = {}


@dataclass(frozen=True)
class Engine:
    """An adapter with settings; `start` raises Unsupported where it has no such thing."""

    key: str
    """of NAMES"""
    variant: Variant = field(compare=False)
    python: str = field(compare=False, default=sys.executable)

    @property
    def name(self) -> str:
        return self.variant.name

    @property
    def tuned(self) -> bool:
        return self.variant.tuned

    def start(self, scene: Scene, dt: float, threads: int = 1) -> Running:
        """One process per setting, that another one takes over from when it has ended. `threads` is for
        adapters with THREADS; the others have one."""
        worker = _workers.get(self.name)
        if worker is None or not worker.lives():
            worker = _workers[self.name] = Worker(self.python, "beside.worker", f"in_{self.key}")
        several = {"threads": threads} if threads > 1 and getattr(adapter(self.key), "THREADS", False) else {}
        return Running(worker, scene, dt, {**self.variant.options, **several})


def stop() -> None:
    for worker in _workers.values():
        worker.end()
    _workers.clear()


def adapter(key: str) -> ModuleType:
    return importlib.import_module(f"{__package__}.in_{key}")


@cache
def python_of(key: str) -> str | None:
    """The interpreter that has the engine: that of its environment, or else this one; None if neither has."""
    module = adapter(key)
    own = str(ENVIRONMENTS / key / "bin" / "python")
    if Path(own).exists():
        found = subprocess.run([own, "-c", f"import {module.IMPORT}"], capture_output=True)
        if found.returncode == 0:
            return own
    return sys.executable if importlib.util.find_spec(module.IMPORT.split(".")[0]) else None


def engines(*keys: str) -> Iterator[Engine]:
    """All settings of those that are installed, in the order of NAMES."""
    for key in NAMES:
        if keys and key not in keys:
            continue
        if python := python_of(key):
            for variant in adapter(key).VARIANTS:
                yield Engine(key, variant, python)
        else:
            print(f"beside: {key} is not installed (python -m beside.install {key})")
