"""Problems for the tests of devices, and the iterates that they compare."""

from __future__ import annotations

import os
from functools import lru_cache

import amontons
import numpy as np
import pytest
from amontons import _core, scenes
from amontons.device import cuda, found, opencl
from amontons.problem.options import core_options
from amontons.problem.solution import HISTORY
from problems import EXAMPLES


def stepped(scene, steps, **parameters):
    """The problem of a step of a scene, which is solved loosely up to there."""
    sim = amontons.Simulation(scenes.make(scene, **parameters), tolerance=1e-3, on_failure="ignore")
    for _ in range(steps):
        sim.step()
    return sim.problem()


def random_problem(contacts, bodies, rows=0, *, compliant=False, hub=False, seed=1):
    """Contacts and rows of every kind between random bodies, some fixed; hub: body 0 is in every third."""
    rng = np.random.default_rng(seed)
    mass = np.where(np.arange(bodies) % 7 == 3, 0, 0.5 + rng.random(bodies))
    root = rng.normal(size=(bodies, 3, 3))
    inertia = np.where(mass[:, None, None] > 0, 0.3 * root @ root.transpose(0, 2, 1), 0)

    def sides(n):
        a = rng.integers(0, bodies, n)
        if hub:
            a[::3] = 0
        b = np.where(rng.random(n) < 0.1, -1, (a + 1 + rng.integers(0, bodies - 1, n)) % bodies)
        swap = rng.random(n) < 0.3
        swap &= b >= 0
        return np.where(swap, b, a), np.where(swap, a, b)

    a, b = sides(contacts)
    ja, jb = sides(rows)
    normal = rng.normal(size=(contacts, 3))
    A = amontons.vi.Contacts(
        mass,
        inertia,
        a,
        b,
        rng.normal(size=(contacts, 3)),
        rng.normal(size=(contacts, 3)),
        normal / np.linalg.norm(normal, axis=1)[:, None],
        0.1 * rng.random(contacts) if compliant else None,
        joint_body_a=ja,
        joint_body_b=jb,
        joint_jacobian_a=rng.normal(size=(rows, 6)),
        joint_jacobian_b=rng.normal(size=(rows, 6)),
        joint_compliance=np.full(rows, 0.2) if compliant else None,
    )
    third = rows // 3
    cones = [
        amontons.vi.Friction(rng.choice([0, 0.3, 0.5, 1, 20], contacts)),
        amontons.vi.Bilateral(third),
        amontons.vi.Interval(np.full(third, -0.2), np.full(third, 0.1)),
        amontons.vi.NonNegative(rows - 2 * third),
    ]
    cones = [c for c in cones if len(np.atleast_1d(getattr(c, "mu", 1)))]
    return amontons.vi.Problem(A, rng.normal(size=3 * contacts + rows), cones)


@lru_cache(maxsize=1)
def problems():
    """By name: small ones that reach every branch of the passes, and steps of scenes."""
    return {
        "contacts": random_problem(300, 40),
        "compliant": random_problem(200, 30, 60, compliant=True),
        "rows": random_problem(0, 20, 90),
        "drum": random_problem(1500, 200, 30, hub=True),
        "pile": stepped("spheres_in_box", 30, count=300),
        "wall": stepped("wall", 2, columns=8, rows=6),
        "vehicle": stepped("tracked_vehicle", 3),
        "file": amontons.vi.read_problem(EXAMPLES / "wall_impact.hdf5"),
        "file of spheres": amontons.vi.read_problem(EXAMPLES / "spheres.hdf5"),
        "file of joints": amontons.vi.read_problem(EXAMPLES / "lattice.hdf5"),
    }


NAMES = (
    "contacts", "compliant", "rows", "drum", "pile", "wall", "vehicle", "file",
    "file of spheres", "file of joints",
)  # fmt: skip


@lru_cache(maxsize=64)
def solved(name, method, law):
    """50 iterations on the CPU, and how far x and residuals are from them where b changes in its last bit.

    A spectral method amplifies rounding: by 1e7 in 50 iterations on some of the problems. Nobody who sums in
    another order can agree with it more closely than it does with itself.
    """
    problem = problems()[name]
    options = dict(method=method, law=law, tolerance=0, max_iterations=50, history=True)
    other = amontons.vi.Problem(problem.A, problem.b * (1 + 2.0**-52), problem.cones)
    own, moved = problem.solve(**options), other.solve(**options)
    drift = np.abs(own.x - moved.x).max()
    return own, max(1e-10 * max(1.0, np.abs(own.x).max()), 100 * drift)


def compare_to_cpu(name, method, law, solve):
    """50 iterations of solve(problem, options) against those of the CPU."""
    own, tolerance = solved(name, method, law)
    other = solve(
        problems()[name], dict(method=method, law=law, tolerance=0, max_iterations=50, history=True)
    )
    assert own.iterations == other.iterations
    np.testing.assert_allclose(other.x, own.x, atol=tolerance, rtol=0)
    if tolerance <= 1e-10 * max(1.0, np.abs(own.x).max()):
        assert other.residual == pytest.approx(own.residual, rel=1e-6, abs=1e-10)
    else:
        early = slice(0, 12)  # before the rounding has grown
        np.testing.assert_allclose(
            other.history["residual"][early], own.history["residual"][early], rtol=1e-8
        )


WAYS = (
    dict(tolerance=0, max_iterations=110, history=True),  # one by one
    dict(
        tolerance=0, max_iterations=110, history=False
    ),  # in chunks; a refresh of u, and a chunk that is cut short
    dict(tolerance=0.3, max_iterations=90, history=False),  # a chunk that ends by the tolerance
)


def told(source, problem, law):
    """All that solves by both methods over a source of iterates tell, as one array."""
    values = []
    for method in ("p-spg-fb", "apgd"):
        for way in WAYS:
            options = core_options(method, law=law, deadline=None, threads=None, method_options={}, **way)
            options.iterates = source
            s = _core.solve(problem._core, method, options, None, None)
            values += [s.iterations, s.products, s.residual, *s.x]
            if way["history"]:
                records = s.history.view(HISTORY)
                values += [v for name in HISTORY.names if name != "time" for v in records[name]]
    return np.array(values)


DEVICE = os.environ.get("AMONTONS_DEVICE", "opencl")
"""where the tests run: pocl, or what `make gpu` found"""


def pocl():
    """The device; skips where there is none that compiles, unless it was asked for."""
    if DEVICE == "opencl":
        pytest.importorskip("pyopencl", reason="pyopencl is not installed; make test installs it with pocl")
        if not any(device.doubles for device in opencl.devices()):
            pytest.skip("no OpenCL driver; pip install pocl-binary-distribution")
    device = found.chosen_device(DEVICE)
    try:
        found.open_device(device)
    except amontons.InputError as error:
        if DEVICE != "opencl" or "not compile" not in str(error):
            raise
        pytest.skip(str(error))
    return device


def open_groups(group, text=None):
    """A backend of it with groups of so many work items, and perhaps with other kernels."""
    kind, _, index = pocl().name.partition(":")
    made = {"opencl": opencl.OpenCL, "cuda": cuda.Cuda}[kind]
    return made(int(index), group=group, text=text)
