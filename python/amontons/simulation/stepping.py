"""Steps of a simulation, with what is called before and after each."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

from .. import _core
from ..checks import function, option
from ..errors import InputError
from .step_report import Report
from .verdict import check_steps

PATIENCE = 0.05
"""of a run without callbacks: after so long (s) the compiled module lets Python look at signals"""


def make_step(simulation: Any) -> Report:
    """One step, with a word about one that failed."""
    require_no_callback(simulation)
    _call(simulation, simulation.before_step, simulation._before_run)
    simulation._contacts = None
    core = simulation._core.step()
    check_steps(simulation, core, 1, core.residual, stacklevel=4)
    report = Report(core)
    simulation._ended = _call(simulation, simulation.after_step, simulation._after_run, report)
    return report


def _call(simulation: Any, functions: Sequence[Callable[..., object]], last: Any, *report: Report) -> bool:
    """Calls what goes before or after a step; whether one returned something true."""
    if last is not None:
        functions = [*functions, last]
    elif not functions:
        return False
    simulation._in_callback = True
    try:
        return any([bool(function(simulation, *report)) for function in functions])
    finally:
        simulation._in_callback = False


def require_no_callback(simulation: Any) -> None:
    """InputError within a function that a step of this simulation calls."""
    if simulation._in_callback:
        raise InputError(
            "before_step and after_step make no step of their own simulation, which is within one; step "
            "a copy()"
        )


def steps_watched(simulation: Any, count: int, before_step: Any, after_step: Any) -> list[_core.Report]:
    """At most so many steps with what is called before and after each, and without a word about them."""
    made: list[_core.Report] = []
    simulation._ended = False
    while len(made) < count and not simulation._ended and (not made or made[-1].advanced):
        _call(simulation, simulation.before_step, before_step)
        simulation._contacts = None
        made.append(simulation._core.step())
        simulation._ended = made[-1].advanced and _call(
            simulation, simulation.after_step, after_step, Report(made[-1])
        )
    return made


def run(simulation: Any, duration: float, before_step: Any, after_step: Any, plain: bool) -> Report:
    """Steps until a duration has passed. plain: `step` is that of Simulation, which nobody has replaced."""
    steps = max(1, math.ceil(option("duration", duration) / simulation.dt - 1e-9))
    function("before_step", before_step)
    function("after_step", after_step)
    watched = before_step or after_step or simulation.before_step or simulation.after_step
    if not watched and plain:
        return _run_compiled(simulation, steps)
    require_no_callback(simulation)
    simulation._before_run, simulation._after_run = before_step, after_step
    try:
        for _ in range(steps):
            simulation._ended = False
            report: Report = simulation.step()
            if simulation._ended:
                break
    finally:
        simulation._before_run = simulation._after_run = None
    return report


def _run_compiled(simulation: Any, steps: int) -> Report:
    require_no_callback(simulation)
    simulation._contacts = None
    while True:  # between two parts Python looks at signals
        part = simulation._core.run(steps, PATIENCE)
        check_steps(simulation, part.report, part.steps, part.residual, stacklevel=5)
        steps -= part.steps
        if steps <= 0:
            return Report(part.report)
