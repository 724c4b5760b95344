"""The options of the add_*_joint functions, written once: keyword arguments that several of them share.

An option that is not given has the default of the field of `Joint` or `Dof` that it fills: rigid, without
limits, spring, damper, friction, drive or motor.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, TypedDict

from ..checks import Numbers, flag, number, sequence, shown
from ..errors import InputError
from .parts import Dof, Motor

Limits = Sequence[float | None] | None
"""(lower, upper), each None for no bound"""


class JointOptions(TypedDict, total=False):
    """Options of every joint."""

    name: str | None
    """unique; made up if None"""
    compliance: float
    """of the locked directions (m/N), 0 is rigid"""
    collide: bool
    """whether the two bodies may touch; the shapes of the world may in any case"""


class BallOptions(JointOptions, total=False):
    """Options of a free rotation: fields of `Dof`, about all axes."""

    stiffness: float
    damping: float
    friction: float
    limit: float | None
    """the largest angle of rotation (rad), None for no bound"""
    armature: float


class DofOptions(JointOptions, total=False):
    """Options of degrees of freedom, fields of `Dof`: one value for all, or a sequence with one for each."""

    limits: Limits | Sequence[Limits]
    """(lower, upper) or None; of several degrees of freedom a sequence of them"""
    stiffness: float | Numbers
    rest: float | Numbers
    damping: float | Numbers
    friction: float | Numbers
    friction_static: float | Numbers | None
    stribeck_speed: float | Numbers
    armature: float | Numbers
    motor: Motor | Sequence[Motor | None] | None


_SHARED = JointOptions.__optional_keys__


def require_options(function: str, options: Mapping[str, Any], kind: Any) -> None:
    """TypeError, as Python raises for any function, if an option is not one of the TypedDict `kind`."""
    known = kind.__optional_keys__
    for name in options:
        if name not in known:
            listed = ", ".join(sorted(known))
            raise TypeError(
                f"{function}() got an unexpected keyword argument {shown(name)}; options are {listed}"
            )


def joint_fields(options: Mapping[str, Any]) -> dict[str, Any]:
    """The fields of `Joint` that the options of every joint fill, but for the name; checked."""
    checks = {"compliance": number, "collide": flag}
    return {key: check(key, options[key]) for key, check in checks.items() if key in options}


def ball_dof(options: Mapping[str, Any]) -> Dof:
    """Spring, damper, friction, drive and limit of a free rotation, as of one degree of freedom."""
    given = {key: value for key, value in options.items() if key not in _SHARED}
    limit = given.pop("limit", None)
    return Dof(upper=math.inf if limit is None else limit, **given)


def dofs_of(count: int, options: Mapping[str, Any]) -> tuple[Dof, ...]:
    """Degrees of freedom with their share of the options of a joint, which gives kinds and axes."""
    shares: list[dict[str, Any]] = [{} for _ in range(count)]
    for key, value in options.items():
        if key not in _SHARED:
            for share, part in zip(shares, _spread(key, value, count), strict=True):
                share[key] = part
    return tuple(Dof(**_dof_fields(share)) for share in shares)


def _spread(key: str, value: Any, count: int) -> list[Any]:
    """One value per degree of freedom; limits of a single one are a pair, not one value for each of two."""
    together = value is None or isinstance(value, Motor | str | bytes) or not hasattr(value, "__iter__")
    if together or (key == "limits" and count == 1):
        return [value] * count
    listed = sequence(key, value)
    if len(listed) != count:
        raise InputError(f"{key} has {len(listed)} entries; the joint has {count} degrees of freedom")
    return listed


def _dof_fields(share: dict[str, Any]) -> dict[str, Any]:
    """The options of one degree of freedom as fields of `Dof`, in which infinity is no bound."""
    given = {key: value for key, value in share.items() if key != "limits" and value is not None}
    if share.get("limits") is not None:
        given["lower"], given["upper"] = bounds(share["limits"])
    return given


def bounds(limits: Any) -> tuple[Any, Any]:
    """(lower, upper) with infinities for None."""
    try:
        lower, upper = limits
    except (TypeError, ValueError):
        raise InputError(f"limits are {shown(limits)}; give (lower, upper), None for no bound") from None
    return (-math.inf if lower is None else lower, math.inf if upper is None else upper)
