"""Contact forces as a network: lines between the bodies that touch, as wide as the force is large."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..checks import Array
from ..model.model import Model
from ..model.parts import WORLD
from ..model.turns import rotate
from ..simulation.step_report import Table
from .colours import STATES

LARGE = 99.0
"""Percentile of the forces that is drawn as wide as LINE bodies are thick."""
LINE = 0.4
Lines = tuple[Array, Array, Array, Array]
"""Starts, ends (k, 3), widths (k,) in m and colours (k, 3) of 8 bits."""


@dataclass(frozen=True)
class Forces:
    """Forces between k pairs of bodies in contact."""

    body_a: NDArray[np.int32]
    """(k,)"""
    body_b: NDArray[np.int32]
    """(k,)"""
    points: Array
    """(k, 3) the mean of the contact points, weighted by the forces there (m)"""
    forces: Array
    """(k,) the magnitude of the sum of the contact forces (N)"""
    states: NDArray[np.str_]
    """(k,) of the contact with the largest force"""


def forces_of(contacts: Table) -> Forces:
    """The contacts of each pair as one force; pairs without a force are left out."""
    size = np.linalg.norm(contacts["force"], axis=1)
    contacts, size = contacts[size > 0], size[size > 0]
    order = np.lexsort((-size, contacts["body_b"], contacts["body_a"]))
    contacts, size = contacts[order], size[order]
    pairs = np.column_stack((contacts["body_a"], contacts["body_b"]))
    first = np.flatnonzero(np.concatenate(([True], (pairs[1:] != pairs[:-1]).any(axis=1)))[: len(pairs)])
    if not len(first):
        none = np.zeros(0, dtype=np.int32)
        return Forces(none, none, np.zeros((0, 3)), np.zeros(0), np.zeros(0, dtype="U5"))
    weight = np.add.reduceat(size, first)
    return Forces(
        body_a=pairs[first, 0],
        body_b=pairs[first, 1],
        points=np.add.reduceat(size[:, None] * contacts["point"], first) / weight[:, None],
        forces=np.linalg.norm(np.add.reduceat(contacts["force"], first), axis=1),
        states=contacts["state"][first],
    )


def width_per_newton(tables: Sequence[Table], thickness: float) -> float:
    """Width of the lines (m/N), for bodies of this thickness (m), that shows the forces of all tables."""
    forces = np.concatenate([forces_of(table).forces for table in tables]) if tables else np.zeros(0)
    forces = forces[forces > 0]
    return LINE * thickness / float(np.percentile(forces, LARGE)) if len(forces) else 0.0


def force_lines(model: Model, positions: Array, orientations: Array, contacts: Table, width: float) -> Lines:
    """Starts and ends (k, 3) (m), widths (k,) (m) and colours (k, 3) of 8 bits.

    A line goes from the centre of mass of each body of a pair that moves to the point of the force.

    width: m/N.
    """
    local = np.array([body.centre_of_mass for body in model.bodies]).reshape(-1, 3)
    centres = positions + rotate(orientations, local)
    moves = np.array([body.motion != "static" for body in model.bodies] + [False])  # of the world, the last
    acting = forces_of(contacts)
    colours = np.array([STATES[state] for state in acting.states.tolist()], dtype=np.uint8).reshape(-1, 3)
    drawn = []
    for side in (acting.body_a, acting.body_b):
        kept = moves[np.where(side == WORLD, -1, side)]
        drawn.append((centres[side[kept]], acting.points[kept], width * acting.forces[kept], colours[kept]))
    start, end, widths, shades = (np.concatenate(part) for part in zip(*drawn, strict=True))
    return start, end, widths, shades


def line_rows(lines: Lines) -> Array:
    """(k, 10) start, end, width and colour from 0 to 1."""
    start, end, width, colour = lines
    return np.ascontiguousarray(np.column_stack((start, end, width, colour / 255.0)))
