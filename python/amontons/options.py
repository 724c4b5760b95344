"""The options of a solve, checked before anything is computed."""

from __future__ import annotations

import math
import numbers
from typing import Any

from . import _core
from .errors import InputError

LAWS = {"associated": _core.Law.associated, "coulomb": _core.Law.coulomb}
NORMS = {
    "natural": _core.Norm.natural,
    "plain": _core.Norm.plain,
    "plain_inf": _core.Norm.plain_inf,
    "siconos": _core.Norm.siconos,
}

_SPG = ("alpha_min", "alpha_max", "sigma_min", "sigma_max", "memory", "gamma")
# Option of a method -> field of _core.Options.
METHOD_OPTIONS: dict[str, dict[str, str]] = {
    "p-spg-fb": {name: name for name in _SPG},
    "p-spg-fb-literal": {name: name for name in (*_SPG, "tau_g")},
    "jacobi": {"omega": "jacobi_omega"},
    "gauss-seidel": {"omega": "sor_omega"},
    "admm": {"rho": "admm_rho"},
}


def methods() -> tuple[str, ...]:
    """The names that `method` accepts; "auto" picks one of the others by the structure of the problem."""
    return tuple(_core.method_names())


def chosen(what: str, name: object, known: dict[str, Any]) -> Any:
    if not isinstance(name, str) or name not in known:
        raise InputError(f"unknown {what} {name!r}; known are {', '.join(known)}")
    return known[name]


def require_method(method: object) -> str:
    if not isinstance(method, str) or method not in methods():
        raise InputError(f"unknown method {method!r}; known are {', '.join(methods())}")
    return method


def integer(name: str, value: object, at_least: int) -> int:
    if isinstance(value, bool) or not isinstance(value, numbers.Integral) or value < at_least:
        raise InputError(f"{name} = {value!r}; it must be an integer, at least {at_least}")
    return int(value)


def _number(name: str, value: object, *, positive: bool = False) -> float:
    if isinstance(value, bool) or not isinstance(value, numbers.Real) or math.isnan(value):
        raise InputError(f"{name} = {value!r}; it must be a number")
    if value < 0 or (positive and value == 0):
        raise InputError(f"{name} = {value!r}; it must be {'positive' if positive else 'zero or positive'}")
    return float(value)


def positive_number(name: str, value: object) -> float:
    return _number(name, value, positive=True)


def core_options(
    method: str,
    *,
    law: str,
    tolerance: float,
    max_iterations: int | None,
    deadline: float | None,
    history: bool,
    threads: int,
    method_options: dict[str, Any],
) -> _core.Options:
    options = _core.Options()
    options.law = chosen("law", law, LAWS)
    options.tolerance = _number("tolerance", tolerance)
    if max_iterations is not None:
        options.max_iterations = integer("max_iterations", max_iterations, 1)
    if deadline is not None:
        options.deadline = _number("deadline", deadline, positive=True)
    options.history = bool(history)
    options.threads = integer("threads", threads, 1)
    valid = METHOD_OPTIONS.get(method, {})
    for name, value in method_options.items():
        if name not in valid:
            listed = ", ".join(valid) if valid else "none"
            raise InputError(f"unknown option {name!r} of method {method!r}; its options are: {listed}")
        value = integer(name, value, 0) if name == "memory" else _number(name, value)
        setattr(options, valid[name], value)
    return options
