"""Where links are and how they move, and what the fixed joints carry that hold them."""

from __future__ import annotations

import numpy as np

from .. import _core
from ..checks import Array
from ..model.links import Places, place_index
from ..model.model import Model
from ..model.parts import WORLD
from .sensors import Moment, plan_of
from .step_report import Table

MOVING = np.dtype(
    [
        ("body", np.int32),
        ("position", np.float64, 3),
        ("orientation", np.float64, 4),
        ("linear_velocity", np.float64, 3),
        ("angular_velocity", np.float64, 3),
    ]
)
"""The fields of Simulation.kinematics.sites and Simulation.kinematics.links."""

REACTIONS = np.dtype(
    [
        ("link", np.int32),
        ("body", np.int32),
        ("point", np.float64, 3),
        ("force", np.float64, 3),
        ("torque", np.float64, 3),
    ]
)
"""The fields of Simulation.forces.link_reactions."""


def moving_frames(core: _core.Simulation, places: Places, which: slice = slice(None)) -> Table:
    """A row for each of some frames on bodies."""
    bodies, frames = places
    return _core.moving_rows(core, bodies[which], frames[which]).view(MOVING)


def link_reactions(core: _core.Simulation, model: Model, qdd: Array) -> Table:
    """By the balance of forces of all that hangs on each fixed joint, at the last step's accelerations."""
    table = np.zeros(len(model.links), REACTIONS)
    table["link"] = len(model.bodies) + np.arange(len(table))
    table["body"] = [link.body for link in model.links]
    table["point"] = moving_frames(core, model._link_places)["position"][len(model.bodies) :]
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
