"""Where links are and how they move, and what the fixed joints carry that hold them."""

from __future__ import annotations

import numpy as np

from .. import _core
from ..checks import Array
from ..model.links import place_index
from ..model.model import Model
from ..model.parts import WORLD
from ..model.transforms import ORIGIN, Transform
from .outcome import Table
from .sensors import Frames, Moment, frame_rows, plan_of

MOVING = np.dtype(
    [
        ("body", np.int32),
        ("position", np.float64, 3),
        ("orientation", np.float64, 4),
        ("linear_velocity", np.float64, 3),
        ("angular_velocity", np.float64, 3),
    ]
)
"""The fields of Simulation.sites and Simulation.links."""

REACTIONS = np.dtype(
    [
        ("link", np.int32),
        ("body", np.int32),
        ("point", np.float64, 3),
        ("force", np.float64, 3),
        ("torque", np.float64, 3),
    ]
)
"""The fields of Simulation.link_reactions."""


def moving_frames(core: _core.Simulation, model: Model, bodies: list[int], frames: list[Transform]) -> Table:
    """A row for each frame on a body."""
    table = np.zeros(len(bodies), MOVING)
    table["body"] = bodies
    rows, _ = model.tree.observe(
        core, np.zeros(model.nv), np.ascontiguousarray(table["body"]), frame_rows(frames)
    )
    seen = Frames(rows)
    table["position"], table["orientation"] = seen.position, seen.orientation
    table["linear_velocity"], table["angular_velocity"] = seen.velocity, seen.angular_velocity
    return table


def link_table(core: _core.Simulation, model: Model) -> Table:
    """Bodies, then their links, in the order of `Model.link_names`."""
    bodies = [*range(len(model.bodies)), *(link.body for link in model.links)]
    frames = [*(ORIGIN for _ in model.bodies), *(link.frame for link in model.links)]
    return moving_frames(core, model, bodies, frames)


def link_reactions(core: _core.Simulation, model: Model, qdd: Array) -> Table:
    """By the balance of forces of all that hangs on each fixed joint, at the last step's accelerations."""
    table = np.zeros(len(model.links), REACTIONS)
    table["link"] = len(model.bodies) + np.arange(len(table))
    table["body"] = [link.body for link in model.links]
    table["point"] = link_table(core, model)["position"][len(model.bodies) :]
    if len(table) and core.impulse_step:
        sums = hanging(model) @ Moment(core, model, plan_of(model), qdd).from_carriers
        table["force"] = sums[:, :3]
        table["torque"] = sums[:, 3:] - np.cross(table["point"], sums[:, :3])
    return table


def hanging(model: Model) -> Array:
    """(links, bodies and links): per fixed joint of a link 1 for all that hangs on it.

    Columns are those of `Model.link_names`. A body that hangs there counts with its links, which stay 0.
    """
    bodies = len(model.bodies)
    parent = dict.fromkeys(range(bodies), WORLD)
    for body, above, j, *_ in model.tree.links:
        if j >= 0:
            joint = model.joints[j]
            link = joint.link_b if joint.body_a == body else joint.link_a
            parent[body] = place_index(bodies, above, link) if above != WORLD else WORLD
    for k, part in enumerate(model.links):
        parent[bodies + k] = place_index(bodies, part.body, part.carrier)
    inside = np.zeros((len(model.links), bodies + len(model.links)))
    for place in parent:
        own = model.links[place - bodies].body if place >= bodies else WORLD
        above = place
        while above != WORLD:
            if above >= bodies and own in (WORLD, model.links[above - bodies].body):
                inside[above - bodies, place] = 1
            above = parent[above]
    return inside
