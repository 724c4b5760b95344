"""Joints as lines: a pin along the axis of a hinge, rods to the points of joints, strings between two."""

from __future__ import annotations

import numpy as np

from ..checks import Array
from ..model.model import Model
from ..model.parts import WORLD, Joint
from ..model.turns import product, rotate
from .force_lines import Lines

COLOUR = (104, 116, 140)
ROD, PIN, REACH = 0.08, 0.26, 0.3
"""Widths of rods and pins, and half the length of a pin, over the thickness of a body."""
SHORTEST = 0.01
"""Shorter lines, over the thickness of a body, are left out: both ends of such a joint are one point."""


def joint_lines(model: Model, positions: Array, orientations: Array, thickness: float) -> Lines:
    """Starts and ends (k, 3) (m), widths (k,) (m) and colours (k, 3) of 8 bits.

    A line leads from the centre of mass of each body that moves to its end of the joint, and one from end to
    end where they are apart. A hinge has a pin along its axis.

    thickness: of a body of the model (m).
    """
    lines: list[tuple[Array, Array, float]] = []
    for joint in model.joints:
        ends = [
            _placed(positions, orientations, body, frame.position)
            for body, frame in ((joint.body_a, joint.frame_a), (joint.body_b, joint.frame_b))
        ]
        lines.append((ends[0], ends[1], ROD * thickness))
        for body, end in zip((joint.body_a, joint.body_b), ends, strict=True):
            if body != WORLD and model.bodies[body].motion != "static":
                centre = _placed(positions, orientations, body, model.bodies[body].centre_of_mass)
                lines.append((centre, end, ROD * thickness))
        for axis in _axes(joint, orientations):
            half = REACH * thickness * axis
            lines.append((ends[0] - half, ends[0] + half, PIN * thickness))
    kept = [line for line in lines if np.linalg.norm(line[1] - line[0]) > SHORTEST * thickness]
    start, end = (np.array([line[k] for line in kept], dtype=float).reshape(-1, 3) for k in (0, 1))
    widths = np.array([line[2] for line in kept], dtype=float)
    return start, end, widths, np.tile(np.array(COLOUR, dtype=np.uint8), (len(kept), 1))


def _placed(positions: Array, orientations: Array, body: int, point: tuple[float, ...] | Array) -> Array:
    """A point of a body, in the world."""
    local = np.asarray(point, dtype=float)
    return local if body == WORLD else positions[body] + rotate(orientations[[body]], local[None])[0]


def _axes(joint: Joint, orientations: Array) -> list[Array]:
    """Unit vectors along the hinges, in the world."""
    turn = np.array([joint.frame_a.rotation])
    if joint.body_a != WORLD:
        turn = product(orientations[[joint.body_a]], turn)
    return [rotate(turn, np.array([dof.axis]))[0] for dof in joint.dofs if dof.kind == "hinge"]
