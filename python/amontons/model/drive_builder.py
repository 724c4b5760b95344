"""The tendons and actuators of ModelBuilder."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from ..checks import Numbers, Vector3, about, number, one_or_two, sequence, shown, vector3
from ..errors import InputError
from ..guidance import guided
from .drives import Actuator, PathElement, Tendon, TendonTerm, Transmission, law
from .joint_builder import JointBuilder
from .joint_options import Limits, bounds
from .transforms import IDENTITY, ORIGIN, Transform

Joints = Mapping[int | str, float] | Sequence[TendonTerm]
Path = Sequence[PathElement | tuple[int | str | None, Numbers]]


@guided
class DriveBuilder(JointBuilder):
    """The functions for tendons and actuators."""

    def add_tendon(
        self,
        name: str | None = None,
        *,
        joints: Joints | None = None,
        path: Path | None = None,
        limits: Limits = None,
        rest: float | Numbers = 0.0,
        **fields: Any,
    ) -> int:
        """Add a tendon and return its index.

        joints: of a fixed tendon, whose length is the sum of coefficients times joint coordinates:
        {joint: coefficient}, or TendonTerms where joints have several degrees of freedom.
        path: of a spatial tendon, the points (body, position in the body frame) that it passes through in
        this order, and PathElements for obstacles that it bends around and for pulleys.
        limits: (lower, upper) of the length, None for no bound (m, or the unit of the coordinates).
        rest: the length at which the spring has no force, or two lengths between which it has none.
        fields: any other of `Tendon`, as stiffness, damping, friction, armature and closed.

        A rope rubs where a PathElement has friction. It then needs an upper limit, its length, or a stiffness
        beyond its rest length, and nothing else acts along it. `Simulation.forces.tensions` has its tensions.
        """
        name = self._new_name("tendon", name)
        who = f'tendon "{name}"'
        if (joints is None) == (path is None):
            raise InputError(f"{who}: give either joints with coefficients or a path")
        with about(who):
            lower, upper = bounds((None, None) if limits is None else limits)
            rest_lower, rest_upper = one_or_two("rest", rest)
            terms = _terms(() if joints is None else joints)
            stops = tuple(map(_element, sequence("path", () if path is None else path)))
            both = {"lower": lower, "upper": upper, "rest_lower": rest_lower, "rest_upper": rest_upper}
            tendon = Tendon(name, terms, stops, **(both | fields))
        return self.add(tendon)

    def add_actuator(
        self,
        name: str | None = None,
        *,
        joint: int | str | None = None,
        tendon: int | str | None = None,
        body: int | str | None = None,
        transmission: Transmission | None = None,
        law: str = "effort",
        kp: float = 0.0,
        kd: float = 0.0,
        gain: Numbers | None = None,
        bias: Numbers | None = None,
        control_limits: Limits = None,
        force_limits: Limits = None,
        activation_limits: Limits = None,
        **fields: Any,
    ) -> int:
        """Add an actuator and return its index; `Simulation.set_control` commands it.

        It acts on one of: joint with dof, whose coordinate times gear is the length l; tendon, likewise;
        body, with the wrench force, torque per unit of effort at position, in axes turned by orientation,
        both in the body frame (a thruster); or a transmission.
        law: "effort": effort = control - kd l'; "position": effort = kp (control - l) - kd l'; "velocity":
        effort = kd (control - l'). gain, bias: any affine law in place of it, see `Actuator`.
        control_limits, force_limits, activation_limits: (lower, upper), None for no bound.
        fields: dof, gear, force, torque of `Transmission`, position and orientation of its frame, and any
        other of `Actuator`, as control, dynamics, time_constant and activation.
        """
        name = self._new_name("actuator", name)
        with about(f'actuator "{name}"'):
            places = {"dof": joint, "tendon": tendon, "wrench": body, "": transmission}
            given = {kind: place for kind, place in places.items() if place is not None}
            if len(given) != 1:
                raise InputError("give one of joint, tendon, body and transmission to act on")
            limits = _limits(control=control_limits, force=force_limits, activation=activation_limits)
            through = transmission or _transmission(*given.popitem(), fields)
            actuator = Actuator(name, through, **_law(law, kp, kd, gain, bias), **(limits | fields))
        return self.add(actuator)


def _terms(joints: Joints) -> tuple[TendonTerm, ...]:
    if isinstance(joints, Mapping):
        return tuple(TendonTerm(joint, 0, coefficient) for joint, coefficient in joints.items())
    for term in (listed := sequence("joints", joints)):
        if not isinstance(term, TendonTerm):
            raise InputError(f"joints has {shown(term)}; give {{joint: coefficient}} or TendonTerms")
    return tuple(listed)


def _element(stop: Any) -> PathElement:
    """An element of a path, or the point that a body and a position in its frame stand for."""
    if isinstance(stop, PathElement):
        return stop
    try:
        body, position = stop
    except (TypeError, ValueError):
        raise InputError(
            f"path has {shown(stop)}; give (body, position in its frame), or a PathElement"
        ) from None
    return PathElement(body=body, frame=Transform(vector3("position", position)))


def _transmission(kind: str, place: Any, given: dict[str, Any]) -> Transmission:
    """That of a kind to a place; takes the fields that are its own out of those given."""
    if kind != "wrench":
        own: dict[str, Any] = {key: given.pop(key) for key in ("dof", "gear") if key in given}
        own["joint" if kind == "dof" else "tendon"] = place
        return Transmission(kind, **own)
    at = [given.pop(key, none) for key, none in (("position", ORIGIN.position), ("orientation", IDENTITY))]
    factor = number("gear", given.pop("gear", 1.0))
    push: dict[str, Any] = {
        key: _times(factor, key, given.pop(key, (0.0, 0.0, 0.0))) for key in ("force", "torque")
    }
    return Transmission("wrench", body=place, frame=Transform.named("actuator", *at), own_axes=True, **push)


def _times(factor: float, what: str, vector: Numbers) -> Vector3:
    x, y, z = vector3(what, vector)
    return factor * x, factor * y, factor * z


def _limits(**pairs: Limits) -> dict[str, Any]:
    """The fields lower_X and upper_X of an actuator."""
    found = {}
    for what, pair in pairs.items():
        found[f"lower_{what}"], found[f"upper_{what}"] = bounds((None, None) if pair is None else pair)
    return found


def _law(kind: str, kp: float, kd: float, gain: Numbers | None, bias: Numbers | None) -> dict[str, Any]:
    for what, value in (("kp", kp), ("kd", kd)):
        if number(what, value) < 0:
            raise InputError(f"{what} = {value:g}; it must not be negative")
    usual = law(kind, kp, kd)
    if kp and kind != "position":
        raise InputError(f'kp is of the law "position"; that of "{kind}" takes kd')
    if gain is None and bias is None:
        return usual
    if kp or kd or kind != "effort":
        raise InputError("gain and bias say the whole law; leave law, kp and kd out")
    return {"gain": gain or usual["gain"], "bias": bias or (0.0, 0.0, 0.0)}
