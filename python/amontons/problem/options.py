"""The options of a solve, checked before anything is computed."""

from __future__ import annotations

from typing import Any

from .. import _core
from ..checks import chosen, flag, nonnegative_number, option, shown, suggestion
from ..errors import InputError

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


def require_method(method: object) -> str:
    if not isinstance(method, str) or method not in methods():
        raise InputError(
            f"unknown method {shown(method)}{suggestion(method, methods())}; known are {', '.join(methods())}"
        )
    return method


def core_options(
    method: str,
    *,
    law: str | None,
    tolerance: float,
    max_iterations: int | None,
    deadline: float | None,
    history: bool,
    threads: int | None,
    method_options: dict[str, Any],
) -> _core.Options:
    options = _core.Options()
    options.law = None if law is None else chosen("law", law, LAWS)  # that of the problem
    options.tolerance = option("tolerance", tolerance)
    if max_iterations is not None:
        options.max_iterations = option("max_iterations", max_iterations)
    if deadline is not None:
        options.deadline = option("deadline", deadline)
    options.history = flag("history", history)
    options.threads = 0 if threads is None else option("threads", threads)
    valid = METHOD_OPTIONS.get(method, {})
    for name, value in method_options.items():
        if name not in valid:
            listed = ", ".join(valid) if valid else "none"
            raise InputError(
                f"unknown option {shown(name)} of method {shown(method)}{suggestion(name, valid)}; "
                f"its options are: {listed}"
            )
        value = option(name, value) if name == "memory" else nonnegative_number(name, value)
        setattr(options, valid[name], value)
    return options
