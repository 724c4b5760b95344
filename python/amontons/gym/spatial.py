"""Inertias, velocities and contact forces of bodies as MuJoCo gives them: about the centre of mass of all.

Observations of Ant and Humanoid contain MuJoCo's `cinert`, `cvel` and `cfrc_ext`: spatial quantities in world
axes, about the centre of mass of the whole tree. Masses and inertias are MuJoCo's own. The pose and velocity
of a body of MuJoCo's are those of our body that carries its geoms; bodies that are fixed to each other may be
one body here and several there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..checks import Array
from ..model.model import Model
from ..simulation.simulation import Simulation
from ..simulation.tables import contact_table


def rotations(quaternions: Array) -> Array:
    """(..., 3, 3) from (..., 4) unit quaternions w, x, y, z."""
    w, x, y, z = np.moveaxis(quaternions, -1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def turned(rotation: Array, vectors: Array) -> Array:
    """R v. The sum is written out because the last bit of a matrix product depends on how many there are."""
    return sum(rotation[..., k] * vectors[..., k, None] for k in range(3))  # type: ignore[return-value]


@dataclass(frozen=True)
class Motion:
    """Bodies of MuJoCo's model in many worlds, world axes."""

    centre: Array
    """(worlds, 3), the centre of mass of all (m)"""
    centre_velocity: Array
    """(worlds, 3) (m/s)"""
    arms: Array
    """(worlds, n, 3), of each body's centre of mass from that of all (m)"""
    rotations: Array
    """(worlds, n, 3, 3), of the body of ours that carries it"""
    angular: Array
    """(worlds, n, 3) (rad/s)"""
    linear: Array
    """(worlds, n, 3), of each body's point at the centre of mass of all (m/s)"""


class SpatialBodies:
    """The bodies of a MuJoCo model with one tree, but for the world, and where ours carry them."""

    def __init__(self, model: Model, file: Path) -> None:
        import mujoco

        theirs = mujoco.MjModel.from_xml_path(str(file))
        home = mujoco.MjData(theirs)
        mujoco.mj_forward(theirs, home)
        bodies = range(1, theirs.nbody)
        carrier = {}
        self.part_of_geom = np.zeros(len(model.geoms), dtype=int)
        """of each geom of ours the body of MuJoCo's, 0 for the world"""
        for g in range(theirs.ngeom):
            ours = model.geom_index(theirs.geom(g).name)
            self.part_of_geom[ours] = theirs.geom_bodyid[g]
            carrier[int(theirs.geom_bodyid[g])] = model.geoms[ours].body
        self.carrier = np.array([carrier[b] for b in bodies])
        self.mass = np.array(theirs.body_mass[1:])
        simulation = Simulation(model, on_failure="ignore")
        to_carrier = np.swapaxes(rotations(simulation.state.orientations[self.carrier]), 1, 2)
        self.local_centre = turned(to_carrier, home.xipos[1:] - simulation.state.positions[self.carrier])
        axes = to_carrier @ home.ximat[1:].reshape(-1, 3, 3)
        self.local_inertia = axes @ (theirs.body_inertia[1:, :, None] * np.swapaxes(axes, 1, 2))

    def motion(self, simulations: Sequence[Simulation]) -> Motion:
        states = [s.state for s in simulations]
        names = ("positions", "orientations", "linear_velocities", "angular_velocities")
        at, turns, linear, angular = (
            np.array([getattr(state, name) for state in states])[:, self.carrier] for name in names
        )
        turn = rotations(turns)
        from_origin = turned(turn, self.local_centre)
        share = (self.mass / self.mass.sum())[:, None]
        centres = at + from_origin
        centre = (share * centres).sum(axis=1)
        velocity = (share * (linear + np.cross(angular, from_origin))).sum(axis=1)
        linear = linear + np.cross(angular, centre[:, None] - at)
        return Motion(centre, velocity, centres - centre[:, None], turn, angular, linear)

    def inertias(self, motion: Motion) -> Array:
        """`cinert`, (worlds, n, 10): xx, yy, zz, xy, xz, yz of the inertia about the centre of mass of all
        (kg m^2), mass times arm (kg m), mass (kg)."""
        r, d, m = motion.rotations, motion.arms, self.mass
        # R I R', by columns of R: turned(R, I') has the rows of I R', and once more those of R I R'.
        half = np.stack([turned(r, self.local_inertia[:, k]) for k in range(3)], axis=-2)
        whole = np.stack([turned(r, half[..., k]) for k in range(3)], axis=-2)
        squares = (d * d).sum(axis=-1)
        diagonal = [whole[..., k, k] + m * (squares - d[..., k] ** 2) for k in range(3)]
        mixed = [whole[..., i, k] - m * d[..., i] * d[..., k] for i, k in ((0, 1), (0, 2), (1, 2))]
        moments = [m * d[..., k] for k in range(3)]
        return np.stack([*diagonal, *mixed, *moments, np.broadcast_to(m, squares.shape)], axis=-1)

    def velocities(self, motion: Motion) -> Array:
        """`cvel`, (worlds, n, 6): angular velocity (rad/s), velocity at the centre of mass of all (m/s)."""
        return np.concatenate([motion.angular, motion.linear], axis=-1)

    def contact_forces(self, simulations: Sequence[Simulation], motion: Motion) -> Array:
        """`cfrc_ext`, (worlds, n + 1, 6), the world first: torque about the centre of mass of all (N m) and
        force (N) of the contacts on each body, means over the last step, about where that centre was then."""
        wrenches = np.zeros((len(simulations), len(self.mass) + 1, 6))
        for k, simulation in enumerate(simulations):
            contacts = contact_table(simulation._core, simulation.model)
            if len(contacts) == 0:
                continue
            centre = motion.centre[k] - simulation.dt * motion.centre_velocity[k]
            force = contacts["force"]
            wrench = np.hstack([np.cross(contacts["point"] - centre, force) + contacts["torque"], force])
            for side, sign in (("geom_a", 1.0), ("geom_b", -1.0)):
                np.add.at(wrenches[k], self.part_of_geom[contacts[side]], sign * wrench)
        wrenches[:, 0] = 0.0
        return wrenches
