"""The options of a solve, checked before anything is computed."""

from __future__ import annotations

from typing import Any

from .. import _core
from ..checks import chosen, flag, nonnegative_number, option, shown, suggestion
from ..errors import InputError

LAWS = {
    "associated": _core.Law.associated, "coulomb": _core.Law.coulomb, "convex": _core.Law.associated
}  # fmt: skip
"""The field calls the associated law the convex relaxation of friction, too."""
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
}

LAW_TERMS = {
    "ccp": "associated",
    "cone-complementarity": "associated",
    "convex-relaxation": "associated",
    "de-saxce": "coulomb",
    "relaxed": "associated",
}
"""Names of laws of friction elsewhere -> here."""
COMMON = ("law", "x0", "tolerance", "max_iterations", "deadline", "history", "callback", "threads")
"""The options of every method."""
METHOD_TERMS = {
    "accelerated-projected-gradient": "apgd",
    "barzilai-borwein": "p-spg-fb",
    "bb": "p-spg-fb",
    "conjugate-gradient": "cg",
    "fista": "apgd",
    "gs": "gauss-seidel",
    "ip": "interior-point",
    "ipm": "interior-point",
    "ipopt": "interior-point",
    "nesterov": "apgd",
    "nsgs": "gauss-seidel",
    "nsn": "newton",
    "pcg": "cg",
    "pdip": "interior-point",
    "pgs": "gauss-seidel",
    "pj": "jacobi",
    "projected-gauss-seidel": "gauss-seidel",
    "projected-jacobi": "jacobi",
    "psor": "gauss-seidel",
    "semismooth-newton": "newton",
    "sor": "gauss-seidel",
    "spg": "p-spg-fb",
}
"""Names of methods elsewhere -> here."""
REMOVED = {"admm": "interior-point"}
"""Methods of earlier versions -> what to use."""
OPTION_TERMS = {
    "atol": "tolerance",
    "eps": "tolerance",
    "guess": "x0",
    "initial": "x0",
    "iterations": "max_iterations",
    "max-iter": "max_iterations",
    "maxiter": "max_iterations",
    "n-iter": "max_iterations",
    "rtol": "tolerance",
    "time-limit": "deadline",
    "timeout": "deadline",
    "tol": "tolerance",
    "warm-start": "x0",
    "relaxation": "omega",
}
"""Names of options elsewhere -> here."""


def methods() -> tuple[str, ...]:
    """The names that `method` accepts; "auto" picks one of the others by the structure of the problem.

    >>> "apgd" in vi.methods()
    True
    """
    return tuple(_core.method_names())


def require_method(method: object) -> str:
    if isinstance(method, str) and method in REMOVED:
        raise InputError(f"method {method!r} was removed; use {REMOVED[method]!r}")
    if not isinstance(method, str) or method not in methods():
        near = suggestion(method, methods(), METHOD_TERMS)
        raise InputError(f"unknown method {shown(method)}{near}; known are {', '.join(methods())}")
    return method


def _unknown_option(name: str, method: str, valid: dict[str, str]) -> str:
    near = suggestion(name, (*COMMON, *valid), OPTION_TERMS)
    owners = [owner for owner, own in METHOD_OPTIONS.items() if name in own]
    if owners:
        near = f" (it belongs to {', '.join(owners)})"
    return (
        f"unknown option {shown(name)} of method {shown(method)}{near}; "
        f"its options are: {', '.join(valid) if valid else 'none'}; all methods take {', '.join(COMMON)}"
    )


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
    options.law = None if law is None else chosen("law", law, LAWS, LAW_TERMS)  # that of the problem
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
            raise InputError(_unknown_option(name, method, valid))
        value = option(name, value) if name == "memory" else nonnegative_number(name, value)
        setattr(options, valid[name], value)
    return options
