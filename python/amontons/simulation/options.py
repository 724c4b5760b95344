"""Options of a simulation, as the compiled module takes them."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from typing import Any

from .. import _core
from ..checks import chosen, option, suggestion
from ..errors import InputError
from ..problem.iterate import source_of_device
from ..problem.options import LAW_TERMS, LAWS, OPTION_TERMS, require_method
from .own_method import name_of, wrapped
from .pairs import search_of_device

RECOVERIES = {"projection": "projection", "velocity": "velocity"}


def core_options(given: Mapping[str, Any]) -> _core.SimulationOptions:
    """Options of the compiled module, in which zero stands for automatic."""
    o = _core.SimulationOptions()
    o.dt = option("dt", given["dt"])
    o.law = chosen("law", given["law"], LAWS, LAW_TERMS)
    if callable(given["method"]):
        o.method = name_of(given["method"])
        o.set_own_method(wrapped(given["method"]))
    else:
        o.method = require_method(given["method"])
    o.tolerance = option("tolerance", given["tolerance"])
    o.threads = 0 if given["threads"] is None else option("threads", given["threads"])
    least = int(option("device_contacts", given["device_contacts"]))
    o.iterates = source_of_device(given["device"], least)
    o.pairs = search_of_device(given["device"], least)
    o.max_substeps = option("max_substeps", given["max_substeps"])
    o.warm_start = given["warm_start"]
    o.recovery = chosen("recovery", given["recovery"], RECOVERIES)
    if given["max_iterations"] is not None:
        o.max_iterations = option("max_iterations", given["max_iterations"])
    if given["budget"] is not None:
        o.budget = option("budget", given["budget"])
    for name in ("margin", "recovery_speed", "restitution_speed"):
        if given[name] is not None:
            value = option(name, given[name])
            if value < 0:
                raise InputError(f"{name} = {value:g}; it must not be negative")
            setattr(o, name, max(value, sys.float_info.min))  # no automatic value for a zero that was given
    return o


def require_known(given: Mapping[str, Any], known: Mapping[str, Any]) -> None:
    """InputError if one is no option of a simulation."""
    if unknown := set(given) - set(known):
        near = suggestion(min(unknown), known, OPTION_TERMS | {"timestep": "dt", "time-step": "dt"})
        raise InputError(
            f"unknown option {min(unknown)!r} of a simulation{near}; known are {', '.join(sorted(known))}"
        )
