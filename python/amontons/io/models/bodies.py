"""Bodies: which of MuJoCo's become ours, and with which mass."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...model.links import Link
from ...model.mass import MassProperties, principal
from ...model.parts import OWN, WORLD, Body, FluidBox
from ...model.transforms import Transform
from .compiled import Compiled, transform
from .urdf import fixed_joint_names, judge_masses

THIN = 1e-15
"""Inertia below this fraction of the largest counts as none."""


@dataclass
class Bodies:
    """Ours, and where each of MuJoCo's went."""

    bodies: list[Body]
    owner: list[int]
    """By MuJoCo body: the MuJoCo body that carries its geoms, joints and mass; 0 is the world."""
    index: dict[int, int]
    """Our index by MuJoCo body, of those that are bodies of ours; the world is WORLD."""
    frame: list[Transform]
    """By MuJoCo body: its frame in that of its owner."""
    links: list[Link]
    """MuJoCo's bodies that are parts of ours, as they have no joints."""
    link: list[int]
    """By MuJoCo body: which of these it is; OWN for those that are bodies of ours."""

    def at(self, mujoco_body: int) -> int:
        """Our body that carries what MuJoCo attaches to `mujoco_body`."""
        return self.index[self.owner[mujoco_body]]

    def is_static(self, mujoco_body: int) -> bool:
        index = self.at(mujoco_body)
        return index == WORLD or self.bodies[index].motion == "static"


def read_bodies(compiled: Compiled) -> Bodies:
    m, d = compiled.model, compiled.data
    owner = _owners(compiled)
    frame = [Transform()] * m.nbody
    own = [_mass_properties(compiled, i) for i in range(m.nbody)]
    mass = list(own)  # with that of what became part of it
    weightless = m.body_mass * m.body_gravcomp
    for i in range(m.nbody):
        if owner[i] != i:
            parent = m.body_parentid[i]
            # On the way to the owner all bodies are merged into it, so that the parent's frame is in it too.
            frame[i] = frame[parent] @ compiled.body_frame(i)
            mass[owner[i]] = mass[owner[i]] + own[i].moved(frame[i])
            weightless[owner[i]] += weightless[i]
            if m.body_mass[i] and m.body_gravcomp[i] != m.body_gravcomp[owner[i]]:
                compiled.refuse(
                    "body",
                    i,
                    "gravcomp unlike that of the body without mass that it is part of; the mean counts",
                )
    names = unique_names(compiled, "body", m.nbody)
    moving = [i for i in range(1, m.nbody) if m.body_weldid[i] != 0 and names[i] not in compiled.massless]
    judge_masses(compiled.root, {names[i]: float(m.body_mass[i]) for i in moving}, compiled.issues)
    bodies, index = [], {0: WORLD}
    for i in range(1, m.nbody):
        if owner[i] != i:
            continue
        index[i] = len(bodies)
        bodies.append(
            Body(
                name=names[i],
                motion=_motion(compiled, i),
                mass=mass[i].mass,
                centre_of_mass=mass[i].centre_of_mass,
                inertia=mass[i].inertia,
                gravity_scale=1 - weightless[i] / mass[i].mass if weightless[i] else 1.0,
                pose=transform(d.xpos[i], d.xquat[i]),
            )
        )
    found = Bodies(bodies, owner, index, frame, [], [OWN] * m.nbody)
    _add_links(compiled, found, names, own)
    return found


def _add_links(compiled: Compiled, bodies: Bodies, names: list[str], own: list[MassProperties]) -> None:
    """Lists what became part of another body. names and masses: by MuJoCo body."""
    joints = fixed_joint_names(compiled.root)
    for i, owner in enumerate(bodies.owner):
        if owner == i:
            continue
        bodies.link[i] = len(bodies.links)
        bodies.links.append(
            Link(
                names[i],
                bodies.at(i),
                bodies.frame[i],
                carrier=bodies.link[compiled.model.body_parentid[i]],
                joint=joints.get(names[i]) or f"{names[i]}_fixed",
                **vars(own[i]),
            )
        )


def unique_names(compiled: Compiled, kind: str, count: int) -> list[str]:
    """MuJoCo's names, and body_3 and so on for what has none."""
    names = [compiled.name(kind, i) for i in range(count)]
    taken = set(names)
    word = {"jnt": "joint"}.get(kind, kind)
    for i, name in enumerate(names):
        if not name:
            names[i] = f"{word}_{i}"
            while names[i] in taken:
                names[i] += "_"
            taken.add(names[i])
    return names


def _motion(compiled: Compiled, body: int) -> str:
    m = compiled.model
    if m.body_mocapid[body] >= 0:
        return "kinematic"
    return "static" if m.body_weldid[body] == 0 else "dynamic"


def _mass_properties(compiled: Compiled, body: int) -> MassProperties:
    m = compiled.model
    frame = transform(m.body_ipos[body], m.body_iquat[body])
    return principal(float(m.body_mass[body]), *m.body_inertia[body].tolist()).moved(frame)


def _owners(compiled: Compiled) -> list[int]:
    """A body without joints on one that moves is part of it: one body has fewer rows than two and a joint.

    Where the two feel unlike shares of gravity it is a body of its own, if both can be one.
    """
    m = compiled.model
    inertia = m.body_inertia
    solid = (m.body_mass > 0) & (inertia.min(axis=1) > THIN * inertia.max(axis=1))
    owner = list(range(m.nbody))
    for i in range(1, m.nbody):
        root = int(m.body_weldid[i])
        if root in (0, i):
            continue
        owner[i] = owner[m.body_parentid[i]]
        falls_alike = m.body_mocapid[root] >= 0 or m.body_gravcomp[i] == m.body_gravcomp[owner[i]]
        if not falls_alike and solid[i] and solid[root]:
            owner[i] = i
    return owner


def fluid_boxes(compiled: Compiled, bodies: Bodies) -> list[FluidBox]:
    """Each moving body with mass has the box of its mass and inertia in its own axes: I_x = m (b_y^2 + b_z^2)
    / 12. A body with a geom that has its own fluid model is listed as unread."""
    m = compiled.model
    found: list[FluidBox] = []
    if not (m.opt.density or m.opt.viscosity):
        return found
    # The first of the coefficients of a geom says whether it feels the fluid.
    ellipsoids = set(m.geom_bodyid[m.geom_fluid[:, 0] > 0].tolist())
    for i in range(1, m.nbody):
        if bodies.at(i) == WORLD or bodies.bodies[bodies.at(i)].motion != "dynamic" or m.body_mass[i] <= 0:
            continue
        if i in ellipsoids:
            compiled.refuse("body", i, 'fluidshape="ellipsoid"; the box of its inertia feels the fluid')
        x, y, z = m.body_inertia[i].tolist()
        squares = np.array([y + z - x, z + x - y, x + y - z]) * 6 / m.body_mass[i]
        frame = bodies.frame[i] @ transform(m.body_ipos[i], m.body_iquat[i])
        size = tuple(np.sqrt(np.maximum(squares, 0.0)).tolist())
        found.append(FluidBox(bodies.at(i), frame, size))
    return found


def fixed_groups(compiled: Compiled, bodies: Bodies) -> dict[int, list[int]]:
    """Our bodies by the MuJoCo body they are fixed to; 0 is what is fixed to the world."""
    groups: dict[int, list[int]] = {}
    for mujoco_body, ours in bodies.index.items():
        if ours != WORLD:
            groups.setdefault(int(compiled.model.body_weldid[mujoco_body]), []).append(ours)
    return groups
