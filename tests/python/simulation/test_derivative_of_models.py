"""Derivatives of steps of published models, beside differences of whole steps."""

import os
import re
import warnings
from dataclasses import replace
from pathlib import Path

import amontons
import numpy as np
import pytest
from amontons import Simulation
from amontons.model.coordinates import degrees
from amontons.simulation.tables import effort_table
from amontons.simulation.tangent import difference, integrate

OPTIONS = {"dt": 2e-3, "tolerance": 1e-11, "warm_start": False, "on_failure": "ignore"}
CHANGE = 1e-6
"""of the differences: their error is its square times the third derivative, and 1e-11 / 1e-6 of the solves"""
BEND = 1e-4
"""Relative: differences over one and two changes that differ by more have passed a border between faces."""
CLOSED = 2e-6
"""Overlaps (of lengths) from rounding to this count as closed in a derivative, and are left by a step."""
STEPS = 6
"""of each model that are compared"""


def root_of(path):
    text = re.sub(r"<!--.*?-->", "", path.read_text(errors="replace"), flags=re.DOTALL)
    return text, (re.search(r"<([A-Za-z]\w*)", text) or ["", ""])[1]


def models(folder):
    """Every model of the folder that loads and has up to 40 degrees of freedom."""
    found, included = [], set()
    for path in sorted(p for p in folder.rglob("*") if p.suffix in (".xml", ".urdf")):
        text, kind = root_of(path)
        if kind in ("mujoco", "robot"):
            found.append(path)
            names = re.findall(r"<include\s[^>]*?file\s*=\s*[\"']([^\"']+)[\"']", text)
            included |= {(path.parent / name).resolve() for name in names}
    for path in found:
        if path.resolve() in included:
            continue
        try:
            model = replace(amontons.load_model(path), trees="auto")
        except (amontons.FileError, amontons.InputError):
            continue
        if 0 < model.nv <= 40:
            yield path.relative_to(folder), model


def rests_beyond(sim, model):
    """Whether a contact or limit that acts has an overlap that a derivative counts as closed."""
    gaps = [c["gap"] / model.length for c in sim.contacts if np.linalg.norm(c["impulse"]) > 0]
    for row, (_, dof) in zip(effort_table(sim._core), degrees(model.joints), strict=True):
        if row["limit"] != 0:
            gaps += [row["coordinate"] - dof.lower, dof.upper - row["coordinate"]]
    return any(-CLOSED < gap < -1e-12 for gap in gaps)


def compared(model, sim, random):
    """The relative errors of the derivative over velocities and over coordinates; None at a border.

    Rates are those of the middles of steps.
    """
    found = sim.derivative()
    before = sim._core.copy()
    before.restore_last()
    snapshot, nv = before.snapshot(), model.nv
    if not found.differentiable or found.margin < 1e-4:
        return None

    def after(dq, dqd):
        world = Simulation(model, **OPTIONS)
        world._core.restore(snapshot)
        world.state.controls = sim.controls
        world._core.show_middle()
        q, qd = world.q, world.qd
        world.q, world.qd = integrate(model, q, dq), qd + dqd
        world._core.begin_with_shown(False)
        world.step()
        world._core.show_middle()
        return world

    def state(world):
        return np.concatenate([difference(model, sim.q, world.q), world.qd])

    still = np.zeros(nv)
    if rests_beyond(after(still, still), model):
        return None
    # Coordinates change along velocities that contacts and limits allow: those after a step are such.
    along = after(still, random.normal(size=nv)).qd
    along, push = along / np.abs(along).max(), random.normal(size=nv)
    start, one, two = (state(after(k * CHANGE * along, still)) for k in (0, 1, 2))
    up, down = (state(after(still, sign * CHANGE * push)) for sign in (1, -1))
    if np.abs(start - 2 * one + two).max() > BEND * np.abs(one - start).max():
        return None
    if np.abs(up - 2 * start + down).max() > BEND * np.abs(up - start).max():
        return None
    by_q, by_qd = (-3 * start + 4 * one - two) / (2 * CHANGE), (up - down) / (2 * CHANGE)
    A = found.A[: 2 * nv]
    return [
        float(np.abs(A[:, :nv] @ along - by_q).max() / np.abs(A[:, :nv]).max()),
        float(np.abs(A[:, nv : 2 * nv] @ push - by_qd).max() / np.abs(by_qd).max()),
    ]


# Breaks when a kind of row of published models, or a stage of their steps, is missing in the derivative. What
# is compared is away from borders, where whole steps have a derivative.
def test_published_models(root):
    folder = Path(os.environ.get("AMONTONS_DATA", root.parent / "shared" / "data")) / "robots"
    if not folder.is_dir():
        pytest.skip(f"no {folder}")
    pytest.importorskip("mujoco")
    errors = {}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for name, model in models(folder):
            random, sim = np.random.default_rng(1), Simulation(model, **OPTIONS)
            lower, upper = np.clip(np.array(model.control_limits).reshape(-1, 2).T, -1, 1)
            for step in range(STEPS):
                sim.controls = random.uniform(lower, upper)
                sim.run(0.1 if step else 0.02)
                if (pair := compared(model, sim, random)) is not None:
                    errors.setdefault(name, []).append(max(pair))
    every = np.array([error for each in errors.values() for error in each])
    assert len(errors) >= 25
    assert len(every) >= 100
    assert np.median(every) < 1e-6
    assert np.mean(every < 1e-5) >= 0.98
