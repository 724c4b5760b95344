"""A simulation in generalised coordinates: reading and setting them, and the equations of motion in them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .. import _core
from ..checks import Array, Numbers, flag, reals, shown, suggestion, vector3
from ..errors import InputError
from ..model.coordinates import known
from ..model.model import Model
from ..model.parts import WORLD
from .passive import passive_forces_of

Values = ArrayLike | Mapping[str, Any]
"""All entries, or some by the names of their coordinates."""


class GeneralisedCoordinates:
    """Functions of `Simulation` for q and qd; docs/simulation.md has order, frames and units."""

    _core: _core.Simulation
    _model: Model

    @property
    def q(self) -> Array:
        """Generalised coordinates, (nq,), of the present poses; read only, assign a whole array to set them.

        In the order of `Model.coordinates`: of hinges and slides rad and m, of a floating base the position
        of its body frame and its orientation (w, x, y, z), of a ball the rotation (w, x, y, z).
        """
        return _read_only(self._model.tree.coordinates(self._core)[0])

    @q.setter
    def q(self, values: ArrayLike) -> None:
        self.set_q(values)

    @property
    def qd(self) -> Array:
        """Generalised velocities, (nv,); read only, assign a whole array to set them.

        Hinges and slides: rad/s and m/s. Floating base: the velocity of its frame's origin in world axes,
        then its angular velocity in body axes. Ball: the angular velocity in the axes of body A.
        """
        return _read_only(self._model.tree.coordinates(self._core)[1])

    @qd.setter
    def qd(self, values: ArrayLike) -> None:
        self.set_qd(values)

    @property
    def qdd(self) -> Array:
        """Generalised accelerations, (nv,), of which the last step's forces are the cause; zeros before it.

        Means from the middle of the step before to that of the last one.
        """
        return _read_only(self._model.tree.rates(self._core))

    def set_q(self, values: Values) -> None:
        """Move the bodies to coordinates, all of them (nq,) or some by name: {"hip": 0.3}.

        Bodies go where the tree of joints puts them; qd stays. Quaternions are normalised. Where joints close
        loops or are coupled, the coordinates that were not named follow, as little as it takes; of an array
        all may. Raises InputError naming the joint and its gap if a loop does not close, or the coordinate
        that is not finite; nothing has changed then.
        """
        q, held = self._spread(values, "q")
        self._model.tree.set_q(self._core, q, held)

    def set_qd(self, values: Values) -> None:
        """Set generalised velocities, all of them (nv,) or some by name; as `set_q`, and poses stay."""
        qd, held = self._spread(values, "qd")
        self._model.tree.set_qd(self._core, qd, held)

    def _spread(self, values: Values, what: str) -> tuple[Array, Any]:
        """All entries of q or qd, and which velocities are held."""
        tree, coordinates = self._model.tree, self._model.coordinates
        held = np.zeros(tree.nv, np.uint8)
        size = tree.nq if what == "q" else tree.nv
        if not isinstance(values, Mapping):
            return _entries(what, values, size), held
        full = tree.coordinates(self._core)[what == "qd"]
        for name, value in values.items():
            if name not in coordinates:
                near = suggestion(name, coordinates)
                raise InputError(
                    f'there is no coordinate "{name}"{near}; known are {known(tuple(coordinates))}'
                )
            part = getattr(coordinates[name], what)
            full[part] = _entries(f'{what} of "{name}"', value, part.stop - part.start)
            held[coordinates[name].qd] = 1
        return full, held

    def coordinate(self, joint: int | str, dof: int = 0) -> float:
        """The coordinate of a joint's degree of freedom (m, or rad with full turns counted).

        joint: index or name, or the name of a degree of freedom; also of joints that close loops.
        """
        joint, dof = self._degree(joint, dof)
        values = self._model.tree.joint_coordinates(self._core)
        return float(values[self._model.dof_index(joint, dof)])

    def rate(self, joint: int | str, dof: int = 0) -> float:
        """The velocity of a joint's degree of freedom (m/s, rad/s); InputError if it closes a loop."""
        return float(self.qd[self._entry(joint, dof)])

    def acceleration(self, joint: int | str, dof: int = 0) -> float:
        """The acceleration of a joint's degree of freedom over the last step (m/s^2, rad/s^2); as `rate`."""
        return float(self.qdd[self._entry(joint, dof)])

    def _entry(self, joint: int | str, dof: int) -> int:
        """Where a degree of freedom is in qd."""
        joint, dof = self._degree(joint, dof)
        self._model.dof_index(joint, dof)
        j = self._model.joint_index(joint)
        for _, _, own, _, _, _, first, _ in self._model.tree.links:
            if own == j:
                return first + dof
        raise InputError(f'joint "{self._model.joints[j].name}" closes a loop and has no entry in qd')

    def _degree(self, joint: int | str, dof: int) -> tuple[int | str, int]:
        if isinstance(joint, str) and joint not in self._model.joint_names:
            named = self._model.coordinates.get(joint)
            if named is not None and named.dof >= 0:
                return named.joint, named.dof
        return joint, dof

    def jacobian(self, body: int | str | None, point: Numbers | None = None) -> Array:
        """(6, nv): velocity of a point of a body or link (3 rows), then its angular velocity, over qd.

        In world axes. point: in its frame (m), by default the origin. `jacobian(...) @ qd` is the velocity
        but for what a kinematic body brings along.
        """
        named = body is not None and not (isinstance(body, str) and body == "world")
        index = self._model.link_index(body) if named else WORLD
        at = (0.0, 0.0, 0.0) if point is None else vector3("point", point)
        if index >= len(self._model.bodies):
            link = self._model.links[index - len(self._model.bodies)]
            index, at = link.body, link.frame(at)
        return self._model.tree.jacobian(self._core, index, at)

    def jacobians(self) -> Array:
        """(n, 6, nv): `jacobian(link)` of all n bodies and links, in the order of `Model.link_names`."""
        bodies, frames = self._model._link_places
        return self._model.tree.jacobians(self._core, bodies, frames)

    def tendon_jacobian(self, tendon: int | str) -> Array:
        """(nv,): the rate of a tendon's length over qd."""
        return self._model.tree.tendon_jacobian(self._core, self._model.tendon_index(tendon))

    def mass_matrix(self) -> Array:
        """M(q), (nv, nv), with the armatures of joints and tendons; of the tree, without loops."""
        return self._model.tree.mass_matrix(self._core)

    def bias_forces(self) -> Array:
        """c(q, qd), (nv,): Coriolis, centrifugal and gravity forces, so that M qdd + c = tau (N, N m)."""
        return self.inverse_dynamics(np.zeros(self._model.nv))

    def inverse_dynamics(self, qdd: ArrayLike, *, passive: bool = False) -> Array:
        """tau = M qdd + c, (nv,): what springs, dampers, motors, contacts and loads must add up to.

        passive: without what springs, dampers and drag do of it, `passive_forces()`: what is left to motors,
            contacts and loads, as `mj_inverse` of MuJoCo says.
        """
        tau = self._model.tree.inverse_dynamics(self._core, _entries("qdd", qdd, self._model.nv))
        return tau - self.passive_forces() if flag("passive", passive) else tau

    def passive_forces(self) -> Array:
        """The forces along qd, (nv,), of springs, dampers and the drag of the fluid at present (N, N m).

        Those of joints and tendons, positive where they speed up qd, without dry friction, armature and
        actuators. Raises InputError naming a joint that closes a loop with springs on several degrees of
        freedom.
        """
        return passive_forces_of(self._core, self._model)

    def generalised_forces(self, forces: ArrayLike, torques: ArrayLike | None = None) -> Array:
        """The forces along qd, (nv,), of forces at the centres of mass and torques on bodies, (n, 3) each.

        World axes; what `contact_forces()` returns, for example.
        """
        shape = (len(self._model.bodies), 3)
        given = [
            np.zeros(shape) if x is None else reals(name, x)
            for name, x in (("forces", forces), ("torques", torques))
        ]
        for name, x in zip(("forces", "torques"), given, strict=True):
            if x.shape != shape:
                raise InputError(f"{name} has the shape {x.shape}; the model asks for {shape}")
        return self._model.tree.generalised_forces(self._core, *given)


def _entries(what: str, values: Any, size: int) -> Array:
    try:
        array = np.array(values, dtype=np.float64)
    except Exception:  # NumPy asks the object, which may raise anything
        raise InputError(f"{what} is {shown(values)}; it must be numbers") from None
    if array.ndim == 0 and size == 1:
        array = array[None]
    if array.shape != (size,):
        raise InputError(f"{what} has the shape {array.shape}; the model asks for ({size},)")
    if not np.isfinite(array).all():
        raise InputError(f"{what}[{int(np.argmin(np.isfinite(array)))}] is not finite")
    return array


def _read_only(array: Array) -> Array:
    array.flags.writeable = False
    return array
