"""The tendons and actuators of ModelBuilder."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from ..checks import Numbers, about, number, one_or_two, sequence, shown, vector3
from ..errors import InputError
from ..guidance import guided
from .drives import Actuator, PathElement, Tendon, TendonTerm, Transmission, law
from .joint_builder import JointBuilder
from .joint_options import Limits, bounds
from .parts import OWN, WORLD
from .transforms import IDENTITY, Transform

Joints = Mapping[int | str, float] | Sequence[TendonTerm]
Path = Sequence[PathElement | tuple[int | str | None, Numbers]]


@guided
class DriveBuilder(JointBuilder):
    """Builder functions for tendons and actuators."""

    _tendons: list[Tendon]
    _actuators: list[Actuator]

    def add_tendon(
        self,
        name: str | None = None,
        *,
        joints: Joints | None = None,
        path: Path | None = None,
        limits: Limits = None,
        stiffness: float = 0.0,
        rest: float | Numbers = 0.0,
        damping: float = 0.0,
        friction: float = 0.0,
        armature: float = 0.0,
        closed: bool = False,
    ) -> int:
        """Add a tendon and return its index.

        joints: of a fixed tendon, whose length is the sum of coefficients times joint coordinates:
        {joint: coefficient}, or TendonTerms where joints have several degrees of freedom.
        path: of a spatial tendon, the points (body, position in the body frame) that it passes through in
        this order, and PathElements for obstacles that it bends around and for pulleys.
        limits: (lower, upper) of the length, None for no bound (m, or the unit of the coordinates).
        stiffness, rest: of a spring (N/m) without force at the length `rest`, or between two lengths.
        damping: N s/m. friction: largest force of dry friction (N). armature: inertia of the drive (kg).
        closed: a belt around two parallel cylinders, the only elements of its path.

        A rope rubs where a PathElement has friction. It then needs an upper limit, its length, or a stiffness
        beyond its rest length, and nothing else acts along it. `Simulation.forces.tensions` has its tensions.
        """
        name = self._new_name("tendon", name)
        who = f'tendon "{name}"'
        if (joints is None) == (path is None):
            raise InputError(f"{who}: give either joints with coefficients or a path")
        with about(who):
            rests = one_or_two("rest", rest)
            lower, upper = bounds((None, None) if limits is None else limits)
            tendon = Tendon(
                name,
                self._terms(() if joints is None else joints),
                tuple(self._stop(stop) for stop in sequence("path", path if path is not None else ())),
                lower,
                upper,
                stiffness,
                *rests,
                damping,
                friction,
                armature,
                closed,
            )
        return self._append("tendon", self._tendons, tendon)

    def _terms(self, joints: Joints) -> tuple[TendonTerm, ...]:
        given = (
            [TendonTerm(*item[:1], 0, item[1]) for item in joints.items()]
            if isinstance(joints, Mapping)
            else sequence("joints", joints)
        )
        terms = []
        for term in given:
            if not isinstance(term, TendonTerm):
                raise InputError(f"joints has {shown(term)}; give {{joint: coefficient}} or TendonTerms")
            index = self._index("joint", term.joint)
            self._require_dof(index, term.dof)
            terms.append(replace(term, joint=index))
        return tuple(terms)

    def _stop(self, stop: Any) -> PathElement:
        if not isinstance(stop, PathElement):
            try:
                body, position = stop
            except (TypeError, ValueError):
                raise InputError(
                    f"path has {shown(stop)}; give (body, position in its frame), or a PathElement"
                ) from None
            stop = PathElement(body=body, frame=Transform(vector3("position", position)))
        body, frame = self._carried(stop.body, stop.frame)
        side_body, at = self._carried(stop.side_body, Transform(stop.side or (0.0, 0.0, 0.0)))
        side = stop.side and at.position
        return replace(stop, body=body, frame=frame, side_body=side_body, side=side)

    def add_actuator(
        self,
        name: str | None = None,
        *,
        joint: int | str | None = None,
        dof: int = 0,
        tendon: int | str | None = None,
        body: int | str | None = None,
        position: Numbers = (0.0, 0.0, 0.0),
        orientation: Numbers = IDENTITY,
        force: Numbers = (0.0, 0.0, 0.0),
        torque: Numbers = (0.0, 0.0, 0.0),
        transmission: Transmission | None = None,
        gear: float = 1.0,
        law: str = "effort",
        kp: float = 0.0,
        kd: float = 0.0,
        gain: Numbers | None = None,
        bias: Numbers | None = None,
        control: float = 0.0,
        control_limits: Limits = None,
        force_limits: Limits = None,
        dynamics: str = "none",
        time_constant: float = 0.0,
        activation: float = 0.0,
        activation_limits: Limits = None,
    ) -> int:
        """Add an actuator and return its index; `Simulation.set_control` commands it.

        It acts on one of: joint with dof, whose coordinate times gear is the length l; tendon, likewise;
        body, with the wrench force, torque per unit of effort at position, in axes turned by orientation,
        both in the body frame (a thruster); or a transmission.
        law: "effort": effort = control - kd l'; "position": effort = kp (control - l) - kd l'; "velocity":
        effort = kd (control - l'). gain, bias: any affine law in place of it, see `Actuator`.
        control: initial. control_limits, force_limits, activation_limits: (lower, upper), None for no bound.
        dynamics: "none"; "integrator" or "filter" (with time_constant, s): the control drives an activation,
        which takes its place in the law.
        """
        name = self._new_name("actuator", name)
        who = f'actuator "{name}"'
        with about(who):
            wrench = _wrench(position, orientation, force, torque, gear)
            moved = self._transmission(transmission, joint, dof, tendon, body, wrench, gear)
            limits = _limits(control=control_limits, force=force_limits, activation=activation_limits)
            actuator = Actuator(
                name,
                moved,
                **_law(law, kp, kd, gain, bias),
                control=control,
                dynamics=dynamics,
                time_constant=time_constant,
                activation=activation,
                **limits,
            )
        return self._append("actuator", self._actuators, actuator)

    def _transmission(
        self,
        transmission: Transmission | None,
        joint: int | str | None,
        dof: int,
        tendon: int | str | None,
        body: int | str | None,
        wrench: Transmission,
        gear: float,
    ) -> Transmission:
        """Returns the transmission of an actuator for one kind of target."""
        if sum(place is not None for place in (joint, tendon, body, transmission)) != 1:
            raise InputError("give one of joint, tendon, body and transmission to act on")
        if joint is not None:
            index = self._index("joint", joint)
            self._require_dof(index, dof)
            return Transmission("dof", joint=index, dof=dof, gear=gear)
        if tendon is not None:
            return Transmission("tendon", tendon=self._index("tendon", tendon), gear=gear)
        if body is not None:
            index, frame = self._carried(body, wrench.frame)
            return replace(wrench, body=index, frame=frame)
        if not isinstance(transmission, Transmission):
            raise InputError(f"transmission is {shown(transmission)}; give a Transmission")
        index, frame = self._carried(transmission.body, transmission.frame)
        other, reference = self._carried(transmission.reference_body, transmission.reference)
        return replace(transmission, body=index, frame=frame, reference_body=other, reference=reference)

    def _carried(self, body: int | str | None, frame: Transform) -> tuple[int, Transform]:
        """The body of what is on a body or link, by default the world, and its frame there."""
        index, inner, link = self._place(None if type(body) is int and body == WORLD else body)
        return index, frame if link == OWN else inner @ frame

    def _require_dof(self, joint: int, dof: object) -> None:
        if not (type(dof) is int and 0 <= dof < len(self._joints[joint].dofs)):
            raise InputError(f'joint "{self._joints[joint].name}" has no degree of freedom {shown(dof)}')

    @abstractmethod
    def _index(self, kind: str, key: object) -> int:
        """The index of a thing given by index or name."""


def _wrench(
    position: Numbers,
    orientation: Numbers,
    force: Numbers,
    torque: Numbers,
    gear: float,
) -> Transmission:
    """The transmission of a thruster, to which the caller adds the body."""
    gear = number("gear", gear)
    parts = [tuple(gear * x for x in vector3(name, v)) for name, v in (("force", force), ("torque", torque))]
    frame = Transform.named("actuator", position, orientation)
    return Transmission("wrench", frame=frame, force=parts[0], torque=parts[1], own_axes=True)  # type: ignore[arg-type]


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
