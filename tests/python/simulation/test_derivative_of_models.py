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
from amontons.simulation.differences import activated
from amontons.simulation.tables import effort_table
from amontons.simulation.tangent import difference, integrate

OPTIONS = {"dt": 2e-3, "tolerance": 1e-11, "warm_start": False, "on_failure": "ignore"}
CHANGES = (1e-6, 4e-6, 1.6e-5, 6.4e-5)
"""of the differences, of fourth order: errors of small ones are 1e-11 / 1e-6 of the solves"""
RESIDUAL = 1e-12
"""of solves whose differences over 1e-6 know a slope to 1e-6"""
BEND = 1e-2
"""Relative: differences over one and two changes that differ by more have passed a border between faces."""
KNOWN = 3e-7
"""Relative: two differences in a row that differ by more do not know the derivative."""
CLOSED = 3e-6
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
    for row, tendon in zip(sim.forces.tendon_efforts, model.tendons, strict=True):
        if row["limit"] != 0:
            ends = row["length"] - tendon.lower, tendon.upper - row["length"]
            gaps += [end / model.length for end in ends]
    return any(-CLOSED < gap < -1e-12 for gap in gaps)


CENTRAL = {-2: 1 / 12, -1: -2 / 3, 0: 0.0, 1: 2 / 3, 2: -1 / 12}
FORWARD = {0: -25 / 12, 1: 4.0, 2: -3.0, 3: 4 / 3, 4: -1 / 4}


def slope_of(state, scale, weights):
    """The derivative of state(change) at 0 as far as differences know it, to KNOWN of a scale, or None."""
    best, closest, last = None, KNOWN * scale, None
    for change in CHANGES:
        at = {k: state(k * change) for k in weights}
        first, middle, end = (at[k] for k in ((-1, 0, 1) if weights is CENTRAL else (0, 1, 2)))
        if np.abs(first - 2 * middle + end).max() > BEND * np.abs(middle - first).max():
            break
        slope = sum(weight * at[k] for k, weight in weights.items()) / change
        if last is not None and np.abs(slope - last).max() < closest:
            best, closest = slope, np.abs(slope - last).max()
        last = slope
    return best


def compared(model, sim, random):
    """The relative errors of the derivative over coordinates, rates and controls. None at a border, or where
    residuals of solves hide the slope.

    Rates are those of the middles of steps.
    """
    found = sim.derivative()
    before = sim._core.copy()
    before.restore_last()
    snapshot, nv = before.snapshot(), model.nv
    if not found.differentiable or found.margin < 1e-4:
        return None
    still, undriven = np.zeros(nv), np.zeros(len(model.control_names))
    residuals = []

    def after(dq=still, dqd=still, du=undriven):
        world = Simulation(model, **OPTIONS)
        world._core.restore(snapshot)
        world.state.controls = sim.controls + du
        world._core.show_middle()
        q, qd = world.q, world.qd
        world.q, world.qd = integrate(model, q, dq), qd + dqd
        world._core.begin_with_shown(False)
        residuals.append(world.step().residual)
        world._core.show_middle()
        return world

    def state(**changes):
        world = after(**changes)
        return np.concatenate([difference(model, sim.q, world.q), world.qd])

    if rests_beyond(after(), model):
        return None
    # Coordinates change along velocities that contacts and limits allow: those after a step are such.
    along = after(dqd=random.normal(size=nv)).qd
    along, push = along / np.abs(along).max(), random.normal(size=nv)
    A, B = found.A[: 2 * nv], found.B[: 2 * nv]
    checks = [
        (A[:, :nv] @ along, np.abs(A[:, :nv]).max(), lambda by: state(dq=by * along), FORWARD),
        (A[:, nv : 2 * nv] @ push, None, lambda by: state(dqd=by * push), CENTRAL),
    ]
    drive = random.normal(size=len(undriven))
    moved = np.abs(B @ drive).max(initial=0)
    if moved > 0:
        drive /= moved
        lower, upper = np.array(model.control_limits).reshape(-1, 2).T
        reach = 2 * max(CHANGES) * np.abs(drive)
        if np.all((sim.controls - reach > lower) & (sim.controls + reach < upper)):
            checks.append((B @ drive, None, lambda by: state(du=by * drive), CENTRAL))
    errors = []
    for mine, scale, moving, weights in checks:
        scale = scale or np.abs(mine).max()
        if (slope := slope_of(moving, scale, weights)) is None:
            return None
        errors.append(float(np.abs(mine - slope).max() / scale))
    return errors if max(residuals) < RESIDUAL else None


def transposed(model, sim, random):
    """The error of products with a row vector beside those with the matrices, over the largest entry."""
    w, by_qd = random.normal(size=2 * model.nv + len(activated(model))), random.normal(size=model.nv)
    found, back = sim.derivative(), sim.vjp(qd=by_qd, state=w)
    mine = np.concatenate([back.state, back.inputs, back.inputs_before])
    matrix = np.concatenate([found.A, found.B, found.B_before], axis=1)
    expected = w @ matrix + by_qd @ found.rates[:, : matrix.shape[1]]
    return float(np.abs(mine - expected).max() / np.abs(expected).max())


# Breaks when a kind of row of published models, or a stage of their steps, is missing in the derivative. What
# is compared is away from borders, where whole steps have a derivative that their differences know.
def test_published_models(root):
    folder = Path(os.environ.get("AMONTONS_DATA", root.parent / "shared" / "data")) / "robots"
    if not folder.is_dir():
        pytest.skip(f"no {folder}")
    pytest.importorskip("mujoco")
    errors, unlike = {}, []
    with warnings.catch_warnings(action="ignore"):
        for name, model in [*models(folder), *models(root / "examples" / "models")]:
            random, sim = np.random.default_rng(1), Simulation(model, **OPTIONS)
            lower, upper = np.clip(np.array(model.control_limits).reshape(-1, 2).T, -1, 1)
            for step in range(STEPS):
                sim.controls = random.uniform(lower, upper)
                sim.run(0.1 if step else 0.02)
                if (found := compared(model, sim, random)) is not None:
                    errors.setdefault(name, []).append(max(found))
            unlike.append(transposed(model, sim, random))
    every = np.array([error for each in errors.values() for error in each])
    assert len(errors) >= 30
    assert len(every) >= 100
    assert max(unlike) < 1e-10
    assert np.median(every) < 1e-7
    assert np.mean(every < 1e-6) >= 0.99
