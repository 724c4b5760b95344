"""The fields of parts: the type that a class gives a field is also its check.

The names of types below say more than Python's do, as `Direction` of a vector that is made a unit vector.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from dataclasses import MISSING, fields
from functools import cache, partial
from typing import Any, ClassVar

from .. import _core
from ..checks import (
    Matrix3,
    Vector3,
    entries,
    flag,
    named,
    number,
    point,
    positive,
    sequence,
    shown,
    unit_vector,
    vector3,
)
from ..errors import InputError
from .mass import as_matrix

Real = float
"""May be infinite, as the limit of what has no limit."""
NonNegative = float
Positive = float
Direction = Vector3
"""A vector of any length but zero; kept as a unit vector."""
Point = Vector3
"""m"""
Bits = int
"""32 of them"""

REMEDIES = {
    "Material": "a Material, as Material(friction=0.5)",
    "Motor": 'a Motor, as Motor("position", kp=100)',
    "Shape": "one of amontons.shapes, as Sphere(0.1)",
    "Transmission": "a Transmission",
}


class Part:
    """A frozen part of a model. `called` begins messages about it, before its name if it has one."""

    _called: ClassVar[str] = ""

    def __init_subclass__(cls, called: str = "") -> None:
        cls._called = called

    def __post_init__(self) -> None:
        self._settle()

    def _settle(self, who: str | None = None) -> str:
        """Converts the fields by their types; returns how messages begin. InputError names the field."""
        if who is None and self._called:
            name = getattr(self, "name", None)
            who = f"{self._called}: " if name is None else named(self._called, name)
        kind: Any = type(self)
        for field, check, default in _checks(kind):
            value = getattr(self, field)
            if value is not default and (good := check((who or "") + field, value)) is not value:
                object.__setattr__(self, field, good)
        return who or ""

    def _in_order(self, who: str, end: str = "") -> None:
        """InputError if the field lower... exceeds upper..."""
        lower, upper = (getattr(self, side + end) for side in ("lower", "upper"))
        if lower > upper:
            low, up = (f"lower{end}", f"upper{end}") if end else ("the lower limit", "the upper one")
            raise InputError(f"{who}{low} {lower:g} exceeds {up} {upper:g}; swap them")


@cache
def _checks(cls: Any) -> list[tuple[str, Callable[[str, Any], Any], Any]]:
    """The fields of a class that have a check, with it and the default, if that passes it as it is."""
    found = []
    for field in fields(cls):
        said = str(field.type).removesuffix(" | None")
        check = _CHECKS.get(said)
        if said.startswith("tuple[") and check is None:
            check = _listed
        if said in REMEDIES:
            check = partial(_instance, vars(sys.modules[cls.__module__])[said], REMEDIES[said])
        if check is not None:
            check = partial(_or_none, check) if said != field.type else check
            settled = field.default is not MISSING and _passes(check, field.default)
            found.append((field.name, check, field.default if settled else MISSING))
    return found


def _passes(check: Callable[[str, Any], Any], value: Any) -> bool:
    try:
        return check("", value) is value
    except InputError:
        return False


def _or_none(check: Callable[[str, Any], Any], what: str, value: Any) -> Any:
    return None if value is None else check(what, value)


def _instance(kind: type, remedy: str, what: str, value: Any) -> Any:
    if not isinstance(value, kind):
        raise InputError(f"{what} is {shown(value)}; give {remedy}")
    return value


def _listed(what: str, value: Any) -> tuple[Any, ...]:
    return tuple(sequence(what, value))


def _numbers(what: str, value: Any) -> tuple[float, ...]:
    values = sequence(what, value)
    return entries(what, values, len(values))


def _nonnegative(what: str, value: Any) -> float:
    value = number(what, value)
    if value < 0:
        raise InputError(f"{what} is {value:g}; it must not be negative")
    return value


def _bits(what: str, value: Any) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value < 2**32:
        raise InputError(f"{what} is {shown(value)}; it must be 32 bits, an integer from 0 to 2^32 - 1")
    return value


def inertia_matrix(what: str, values: Any) -> Matrix3:
    """A tensor of principal moments (3,) or (3, 3)."""
    if isinstance(values, Sequence) or hasattr(values, "__len__"):
        rows = list(values)
        if len(rows) == 3 and not hasattr(rows[0], "__len__"):
            a, b, c = entries(what, rows, 3)
            return ((a, 0.0, 0.0), (0.0, b, 0.0), (0.0, 0.0, c))
        if len(rows) == 3:
            m = tuple([vector3(f"{what}[{i}]", row) for i, row in enumerate(rows)])
            (_, xy, xz), (yx, _, yz), (zx, zy, _) = m
            if xy == yx and xz == zx and yz == zy:
                return m  # type: ignore[return-value]
            scale = max(abs(x) for row in m for x in row)
            if all(abs(m[i][j] - m[j][i]) <= _core.ASYMMETRY * scale for i in range(3) for j in range(i)):
                return as_matrix(m)
            raise InputError(f"{what} is not symmetric; symmetrise it")
    raise InputError(f"{what} must be principal moments (3,) or a matrix (3, 3)")


_CHECKS: dict[str, Callable[[str, Any], Any]] = {
    "float": number,
    "Real": partial(number, infinite=True),
    "NonNegative": _nonnegative,
    "Positive": positive,
    "bool": flag,
    "Bits": _bits,
    "Vector3": vector3,
    "Direction": unit_vector,
    "Point": point,
    "Matrix3": inertia_matrix,
    "tuple[float, ...]": _numbers,
    "tuple[float, float, float]": vector3,
}
