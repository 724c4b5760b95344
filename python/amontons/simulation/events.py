"""Pairs of shapes that began to touch in a step, and those that ceased to."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .. import _core
from ..checks import Array
from ..model.model import Model
from .step_report import Table

PAIRS = np.dtype([(name, np.int32) for name in ("body_a", "body_b", "geom_a", "geom_b", "link_a", "link_b")])
"""The fields of ContactEvents, as in `Simulation.contacts`."""


class ContactEvents(NamedTuple):
    """Differences between the last step and the one before it, in the order of the indices.

    >>> builder = ModelBuilder()
    >>> ground = builder.add_floor()
    >>> ball = builder.add_body(shape=shapes.Sphere(0.1), mass=1, position=(0, 0, 0.15))
    >>> simulation = Simulation(builder.build())
    >>> report = simulation.run(1.0, after_step=lambda s, r: len(s.contact_events.began))
    >>> round(simulation.time, 3)  # the drop of 5 cm takes 0.101 s
    0.105
    """

    began: Table
    """pairs of geoms that carry a force since the last step, impacts included"""
    ended: Table
    """pairs that no longer do"""


def contact_events(core: _core.Simulation, model: Model) -> ContactEvents:
    began, ended = core.contact_events()
    return ContactEvents(_pairs(began, model), _pairs(ended, model))


def _pairs(rows: Array, model: Model) -> Table:
    table = np.zeros(len(rows), PAIRS)
    if len(table):
        table["body_a"], table["body_b"], table["geom_a"], table["geom_b"] = rows.T
        links = np.array(model.geom_links, dtype=np.int32)
        table["link_a"], table["link_b"] = links[table["geom_a"]], links[table["geom_b"]]
    return table
