"""How far a support may move before the blocks fall: statics on the geometry that the movement makes.

A support that moves by ever so little turns blocks into a mechanism with the least (or the largest) of all
thrusts (Heyman, 1966), and they stand. They fall once the geometry has changed so far that no forces balance
the weight (Ochsendorf, 2006; Portioli and Cascini, 2017). So the support moves slowly in a simulation, and on
the way the question of `Statics.solve` is asked about the contacts that there are. Its answer is a proof on
both sides of the movement at which they fall. A mechanism alone is no proof of a collapse: blocks may move a
little and find new joints. So the support then stops, and the blocks either come to stand or fall.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...checks import positive, unit_vector
from ...errors import InputError
from ...model.assembly import Assembly
from ...model.mass import MassProperties
from ...model.transforms import rotation_matrix
from ...simulation.simulation import Simulation
from .joints import Joint
from .search import Factor
from .statics import Equilibrium, Statics

SPEED = 0.02
"""Speed of the support over sqrt(g L), L the median size of the blocks: accelerations are thousandths of g"""
STEP = 0.05
"""Time step over sqrt(L / g)"""
TOUCH = 1e-4
"""Gap over L up to which a contact can bear"""
LOOKS = 60
"""Questions to the statics up to the largest movement; the time between them is halved near collapse"""
PAUSE = 10
"""Steps between questions while the support rests"""
PATIENCE = 60.0
"""Time over sqrt(L / g) after which blocks that neither stand nor fall are undecided"""
FALLEN = 0.1
"""Displacement of a block over L, after the support stopped, from which it has fallen"""


@dataclass(frozen=True)
class Settlement:
    """Supports that move; made by `settlement`.

    >>> from amontons.studies import settlement
    >>> settlement("left", (-1, 0, 0)).unit
    'm'
    """

    name: str
    supports: tuple[str, ...]
    direction: tuple[float, float, float]
    largest: float | None
    unit: str = "m"


def settlement(
    supports: str | Sequence[str], direction: tuple[float, float, float], *, largest: float | None = None
) -> Settlement:
    """Supports that move slowly along a direction (world axes), the others at rest. The factor is in m.

    largest: movement up to which collapse is looked for (m); None for a quarter of the extent of the blocks.
    The blocks follow in a simulation, so that a large assembly takes minutes. Mortar is left out.

    >>> from amontons.studies import settlement
    >>> settlement(["left"], (0, 0, -1), largest=0.1).name
    'settlement of left along (0, 0, -1)'
    """
    names = (supports,) if isinstance(supports, str) else tuple(map(str, supports))
    if not names:
        raise InputError("settlement: give the name of a support")
    along = unit_vector("settlement: direction", direction)
    most = None if largest is None else positive("settlement: largest", largest)
    axis = ", ".join(f"{x:g}" for x in along)
    return Settlement(f"settlement of {', '.join(names)} along ({axis})", names, along, most)


def settled(statics: Statics, given: Settlement, *, within: float) -> Factor:
    """The movement between two proofs: forces on the geometry before collapse, a mechanism on that after."""
    assembly = statics.assembly
    for name in given.supports:
        if not assembly.blocks[assembly.index(name)].fixed:
            raise InputError(
                f"settlement: block {name!r} is no support; the supports are {assembly.supports}"
            )
    if statics.ties or any(block.given_mass for block in assembly.blocks):
        raise InputError(
            "settlement: give an Assembly, as read_assembly makes; a model has no settlement yet"
        )
    path = _Path(assembly, given)
    most = given.largest or path.extent / 4
    start = statics.solve(statics.weights)
    if start.status != "stands":
        return Factor(given.name, given.unit, 0.0, 0.0, None, start, math.nan, 1)
    every = max(1, round(most / LOOKS / path.stride))
    lower, forces, kept, looks = 0.0, start, path.simulation.copy(), 1
    upper, mechanism = math.inf, None
    while path.moved < min(most, upper):
        path.move(every)
        found = path.forces()
        looks += 1
        if found.status == "stands":
            lower, forces, kept = path.moved, found, path.simulation.copy()
        elif (rest := path.stopped()) is not None:
            lower, forces, kept = path.moved, rest, path.simulation.copy()
        elif found.status == "falls":
            upper, mechanism = path.moved, found
            if every == 1:
                break
            every = max(1, every // 4)
            path.go_back(kept, lower)
        if math.isfinite(upper) and upper - lower <= within * upper:
            break
    return Factor(given.name, given.unit, lower, upper, forces, mechanism, lower, looks)


class _Path:
    """Blocks on supports of which some move slowly."""

    def __init__(self, assembly: Assembly, given: Settlement) -> None:
        self.assembly = assembly
        free = [block for block in assembly.blocks if not block.fixed]
        self.size = float(np.median([block.size for block in free]))
        corners = np.concatenate([block.vertices for block in free])
        self.extent = float(np.linalg.norm(np.ptp(corners, axis=0)))
        g = float(np.linalg.norm(assembly.gravity))
        dt = STEP * math.sqrt(self.size / g)
        self.velocity = SPEED * math.sqrt(g * self.size) * np.array(given.direction)
        self.stride = float(np.linalg.norm(self.velocity)) * dt
        model = assembly.model(moving_supports=True)
        self.simulation = Simulation(model, dt=dt, on_failure="ignore")
        self.moving = [model.body_index(name) for name in given.supports]
        self.free = [model.body_index(block.name) for block in free]
        self.start = self.simulation.state.positions.copy()
        self.place = [assembly.index(name) for name in model.body_names]
        self.moved = 0.0
        self.weights = Statics(assembly, ()).weights

    def move(self, steps: int) -> None:
        """Moves the support on by some steps."""
        self.simulation.state.linear_velocities[self.moving] = self.velocity
        self.simulation.run(steps * self.simulation.dt)
        self.moved += steps * self.stride

    def stopped(self) -> Equilibrium | None:
        """The forces with which the blocks come to stand if the support stops; None if they do not.

        The simulation itself goes on from where it was.
        """
        going, first = self.simulation, self.simulation.state.positions.copy()
        self.simulation = going.copy()
        state = self.simulation.state
        state.linear_velocities[self.moving] = 0.0
        found = None
        for _ in range(round(PATIENCE / STEP / PAUSE)):
            self.simulation.run(PAUSE * self.simulation.dt)
            if np.abs(state.positions - first).max() > FALLEN * self.size:
                break
            found = self.forces()
            if found.status == "stands":
                break
            found = None
        self.simulation = going
        return found

    def forces(self) -> Equilibrium:
        """The answer of the statics on the present poses."""
        return self.statics().solve(self.weights)

    def go_back(self, kept: Simulation, moved: float) -> None:
        """To a copy that was made where the blocks stood."""
        self.simulation, self.moved = kept.copy(), moved

    def statics(self) -> Statics:
        """Statics on the present poses, with the contacts that the simulation finds there."""
        state = self.simulation.state
        blocks = list(self.assembly.blocks)
        for body, index in enumerate(self.place):
            block = blocks[index]
            turn = np.array(rotation_matrix(tuple(state.orientations[body])))
            origin = np.zeros(3) if block.fixed else np.array(block.mass.centre_of_mass)
            points = (block.vertices - origin) @ turn.T + state.positions[body]
            mass = None
            if not block.fixed:
                inertia = turn @ np.array(block.mass.inertia) @ turn.T
                mass = MassProperties(
                    block.mass.mass, tuple(state.positions[body]), tuple(map(tuple, inertia))
                )  # type: ignore[arg-type]
            blocks[index] = replace(block, vertices=points, given_mass=mass)
        joints = [
            Joint(
                self.place[c["body_a"]], self.place[c["body_b"]], c["point"][None].copy(), c["normal"].copy(),
                0.0, float(c["friction"]), float(c["gap"]),
            )
            for c in self.simulation.contacts
            if c["gap"] <= TOUCH * self.size
        ]  # fmt: skip
        return Statics(replace(self.assembly, blocks=tuple(blocks)), tuple(joints))
