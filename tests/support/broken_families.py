"""Families of which every case fails in its own way; test_soak.py runs them."""

import os
import signal

import numpy as np
from soak.family import Failure, Family


def crash(case):
    os.kill(os.getpid(), signal.SIGSEGV)


def hang(case):
    while True:
        pass


def memory(case):
    return {"bytes": np.ones(1 << 28).nbytes}


def internal(case):
    raise KeyError("x")


def nonsense(case):
    raise Failure("accepted nonsense", "two and two are five")


def good(case):
    return {"outcome": "accepted", "height": float(case.rng().random())}


def parts(case):
    """Fails as long as part 3 is there."""
    kept = [k for k in range(5) if case.kept(k)]
    (case.folder / "kept.txt").write_text("".join(f"{k}\n" for k in kept))
    return replay(case.folder / "kept.txt")


def replay(path):
    if "3" in path.read_text():
        raise Failure("accepted nonsense", "3")
    return {}


def family(run, **options):
    return Family(run.__name__, "", run, cpu_s=1, memory=1 << 29, **options)


FAMILIES = [family(run) for run in (crash, hang, memory, internal, nonsense, good)]
FAMILIES.append(family(parts, replay=replay, main="kept.txt"))
