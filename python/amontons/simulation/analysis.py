"""The step of a simulation as a linear function: by differences, and on the faces of its solution."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..checks import chosen, option
from ..errors import InputError, StepWarning
from ..problem.problem import Problem
from .derivative import Derivative, Held, StepGradient, cotangent, derivative_of, remembered_slips
from .differences import INPUTS, activated, placed
from .linearise import Linearisation, linearise_core
from .options import core_options
from .tangent import along_velocities, of_coordinates

CONTACTS = {"free": None, "held": None}


def linear_model(
    simulation: Any, inputs: str, contacts: str, tolerance: float, threads: int | None
) -> Linearisation:
    """See `Simulation.linearise`."""
    chosen("inputs", inputs, INPUTS)
    chosen("contacts", contacts, CONTACTS)
    if threads is not None:
        threads = int(option("threads", threads))
    probe = precise_copy(simulation, tolerance)
    core, margin = probe._core, None
    if contacts == "held":
        core.assign(placed(core, simulation._model, steady=True))
        core.step()
        held = Held(core, simulation._model, core_options(probe.options))
        core, margin = held.simulation(), held.step.margin
    found = linearise_core(core, simulation._model, simulation.dt, inputs, threads, margin)
    if contacts == "free" and found.nonsmooth:
        count = len(found.states + found.inputs)
        warnings.warn(
            f"differences to both sides disagree for {len(found.nonsmooth)} of {count} states and inputs, as "
            f"{found.nonsmooth[0]}: contacts open, close or begin to slide; for a feedback give "
            'contacts="held"',
            StepWarning,
            stacklevel=3,
        )
    return found


def derivative_of_last(
    simulation: Any, inputs: str, parameters: Iterable[str], tolerance: float, threads: int | None
) -> Derivative:
    """See `Simulation.derivative`."""
    chosen("inputs", inputs, INPUTS)
    if threads is not None:
        threads = int(option("threads", threads))
    _ = simulation._core.instant_time  # there was a step
    before = simulation.copy()
    before._core.restore_last()
    for finest in (tolerance, 100 * tolerance, simulation.options["tolerance"]):
        precise = precise_copy(before, finest)
        precise._core.assign(placed(precise._core, simulation._model))
        report = precise._core.step()
        if report.is_sound and report.path == "accurate":
            break
    unsound = "" if report.is_sound and report.path == "accurate" else f"the step ended by {report.path}"
    if report.substeps > 1:
        unsound = f"the step was made in {report.substeps} parts"
    if slipping := remembered_slips(precise._core, simulation._model):
        unsound = f"the friction of {', '.join(slipping[:3])} depends on the slip of the step before"
    held = Held(precise._core, simulation._model, core_options(precise.options))
    return derivative_of(held, simulation.dt, inputs, parameters, threads, unsound)


def vjp_of_last(
    simulation: Any,
    cotangents: Mapping[str, ArrayLike | None],
    inputs: str,
    parameters: Iterable[str],
    tolerance: float,
    threads: int | None,
) -> StepGradient:
    """See `Simulation.vjp`; cotangents: q, qd and state."""
    model = simulation._model
    size = 2 * model.nv + len(activated(model))
    shapes = {"q": (model.nq,), "qd": (model.nv,), "state": (size,)}
    by_q, by_qd, state = (cotangent(name, cotangents[name], shape) for name, shape in shapes.items())
    found = derivative_of_last(simulation, inputs, parameters, tolerance, threads)
    state = state + np.pad(along_velocities(model, simulation.q, by_q), (0, size - model.nv))
    back = found.vjp(state, by_qd)
    before = simulation.copy()
    before._core.restore_last()
    return StepGradient(
        back.state,
        back.inputs,
        back.inputs_before,
        back.parameters,
        of_coordinates(model, before.q, back.state[: model.nv]),
        back.state[model.nv : 2 * model.nv],
        found.differentiable,
        found.margin,
        found.reason,
    )


def precise_copy(simulation: Any, tolerance: float) -> Any:
    """A copy whose steps are solved to a tolerance that is no looser."""
    probe = simulation.copy()
    least = min(option("tolerance", tolerance), probe.options["tolerance"])
    probe.change_options(tolerance=least, threads=1)
    return probe


def problem_of_last(simulation: Any) -> Problem:
    """The variational inequality of the last step."""
    core = simulation._core.problem
    if core is None:
        raise InputError("there is no problem before the first step; call step() first")
    return Problem._from_core(
        core,
        name=f"step {simulation.steps}",
        description=(
            f"t = {simulation.time:g} s, dt = {simulation.dt:g} s, law {simulation._options['law']}"
        ),
        source="amontons.Simulation",
    )
