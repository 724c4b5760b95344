"""Differences of a time step: steps of a simulation from states that differ in one entry each.

The state x of a simulation has dq (nv), a change of q along qd, then qd (nv), then the activations of
actuators that have any. qd are the rates of the middle of a step, with which the next one begins. A
motion depends on them and q alone, so that derivatives of steps multiply.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from .. import _core
from ..checks import Array
from ..errors import SimulationError
from ..model.model import Model
from .processors import usable_cores
from .tangent import angles

CHANGE = 1e-6
"""rad, or Model.length: by which coordinates change. Errors are 1e-12 of the third derivative, and 1e-16 /
1e-6 of rounding."""
WIDE = 10.0
"""Times as much change rates of steps that are held on their faces, which bear it: less rounding. Coordinates
do where loops close to 1e-10, which changes have to pass, or where there is no border."""
HELD_REACH = 3e-6
"""of Model.length: overlaps that held steps close. Changes make them, with levers of three lengths."""
ROUNDING = 1e-5
"""Inputs of held steps change until rates change by so much of those of a fall through `Model.length`. Less
would be near rounding where an input moves little."""
MOST_INPUT = 1e-2
"""N, N m or the unit of a control, relative above 1: by which inputs change at most"""
UNCHANGED = ("nothing", 0, 0.0)
KINK = 0.02
"""One-sided slopes that differ by more belong to a contact that opens, closes, or begins to slide."""
BENT = 1e-3
"""Those that differ by more may belong to a curve: a tenth of the change then errs by a hundredth."""
SMALL = 1e-2
"""Slopes of inputs below this share of others of their kind may be rounding."""
FLAT = 1e-4
"""Slopes of states below it may be rounding: a change that a contact takes back within the step."""
Change = tuple[str, int, float]
"""what, which entry, by how much"""
INPUTS = {"controls": None, "joint_forces": None, "none": None}
HELD = {"controls": "held_controls", "joint_forces": "held_joint_forces"}
"""the same over the step before, in which a part of the impulses of this one acts"""


@dataclass(frozen=True)
class Entry:
    """Something that is changed by so much to both sides."""

    kind: str
    """q | qd | activations | controls | joint_forces | held_controls | held_joint_forces"""
    index: int
    low: float
    high: float
    """by how much"""


@dataclass(frozen=True)
class Sides:
    """The states after steps of both sides of an entry."""

    low: Array
    high: Array
    by: tuple[float, float]
    """low <= 0 <= high, by how much the entry was changed"""

    @property
    def slope(self) -> Array:
        return (self.high - self.low) / (self.by[1] - self.by[0])

    def slopes(self, middle: Array) -> tuple[Array, Array]:
        """To both sides; of one side alone twice the same."""
        if self.by[0] == 0 or self.by[1] == 0:
            return self.slope, self.slope
        return (self.high - middle) / self.by[1], (self.low - middle) / self.by[0]


def nonsmooth_of(
    names: Sequence[str],
    entries: Sequence[Entry],
    sides: Sequence[Sides],
    middle: Array,
    least: float = KINK,
) -> tuple[str, ...]:
    """The entries whose slopes to both sides disagree, by more than the share `least`.

    Each is compared with its own largest slope, unless that is rounding: far below those of its kind, or of
    states below FLAT.
    """
    pairs = [side.slopes(middle) for side in sides]
    sizes = [float(np.abs(pair).max(initial=0.0)) for pair in pairs]
    typical: dict[str, float] = {}
    for entry, size in zip(entries, sizes, strict=True):
        typical[entry.kind] = max(typical.get(entry.kind, 0.0), size)
    found = []
    for name, entry, (up, down), size in zip(names, entries, pairs, sizes, strict=True):
        noise = SMALL * typical[entry.kind] if entry.kind in INPUTS else FLAT
        if np.abs(up - down).max(initial=0.0) > least * max(size, noise):
            found.append(name)
    return tuple(found)


class Stepped:
    """States after a step of a simulation, each with one change before it, as changes from coordinates q.

    Behind each state are the rates of the instant of q (nv). steady: the step is one of a motion that lasts,
    with the same loads before.
    """

    def __init__(self, core: _core.Simulation, q: Array, threads: int | None, steady: bool = False) -> None:
        self.core, self.q, self.threads, self.steady = core, q, threads or usable_cores(), steady
        self.residual = 0.0
        """the largest of all steps"""
        self.middle = self.after([UNCHANGED])[0]
        """without a change"""

    def after(self, changes: Sequence[Change], core: _core.Simulation | None = None) -> Array:
        """The states, a row per change (what, entry, by how much); of another simulation, if one is given."""
        rows, residual, failure = _core.changed_steps(
            core or self.core, changes, self.q, self.steady, self.threads
        )
        if failure:
            raise SimulationError(f"there is no linear model here, as a step fails: {failure}")
        self.residual = max(self.residual, residual)
        return rows

    def sides(self, entries: Sequence[Entry]) -> list[Sides]:
        """Both sides of each entry; without a change to one side, the state without any."""
        ends = [(e, by) for e in entries for by in (e.low, e.high)]
        rows = iter(self.after([(e.kind, e.index, by) for e, by in ends if by != 0]))
        found = [next(rows) if by != 0 else self.middle for _, by in ends]
        return [
            Sides(low, high, (e.low, e.high))
            for e, low, high in zip(entries, found[::2], found[1::2], strict=True)
        ]

    def unbent(self, entries: Sequence[Entry], sides: list[Sides]) -> None:
        """Replaces sides of a strong curve by those of a smaller change."""
        names = [str(k) for k in range(len(entries))]
        at = [int(k) for k in nonsmooth_of(names, entries, sides, self.middle, BENT)]
        less = [replace(entries[k], low=entries[k].low / 10, high=entries[k].high / 10) for k in at]
        for k, side in zip(at, self.sides(less), strict=True):
            sides[k] = side


def steadied(core: _core.Simulation) -> _core.Simulation:
    """A copy whose next step is one of a motion that lasts."""
    copy = core.copy()
    copy.show_middle()
    copy.begin_with_shown(True)
    return copy


def placed(core: _core.Simulation, model: Model, steady: bool = False) -> _core.Simulation:
    """A copy whose bodies are where the tree of joints puts them, as those of changed copies are."""
    copy, none = core.copy(), np.zeros(model.nv, np.uint8)
    copy.show_middle()
    q, qd = model.tree.coordinates(copy)
    model.tree.set_q(copy, q, none)
    model.tree.set_qd(copy, qd, none)
    copy.begin_with_shown(steady)
    return copy


def activated(model: Model) -> list[int]:
    """The actuators with an activation."""
    return [k for k, drive in enumerate(model.actuators) if drive.dynamics != "none"]


def entries_of(core: _core.Simulation, model: Model, inputs: str, margin: float | None = None) -> list[Entry]:
    """Those of the state, then those of the inputs; margin: that of a held step."""
    in_tree = {link[2] for link in model.tree.links}
    loops = any(j not in in_tree for j in range(len(model.joints)))
    wide = margin is not None and (loops or np.isinf(margin))
    return [
        *_of_state(model, WIDE if wide else 1.0, 1.0 if margin is None else WIDE),
        *_of_activations(core, model),
        *_of_inputs(core, model, inputs),
    ]


def _typical_rate(model: Model) -> float:
    """1/s: that of what falls through Model.length; without gravity, of what passes it in a second."""
    gravity = float(np.linalg.norm(model.gravity))
    return float(np.sqrt(gravity / model.length)) if gravity > 0 else 1.0


def felt(stepped: Stepped, model: Model, entries: list[Entry]) -> list[Entry]:
    """Entries whose inputs change by enough to be felt: steps held on their faces bear larger changes."""
    core, inputs = stepped.core, [e for e in entries if e.kind in INPUTS]
    scale = np.where(angles(model), 1.0, 1 / model.length) / _typical_rate(model)
    found = [e for e in entries if e.kind not in INPUTS]
    rows = stepped.after([(e.kind, e.index, e.high or e.low) for e in inputs])
    for entry, after in zip(inputs, rows, strict=True):
        rates = (after - stepped.middle)[model.nv : 2 * model.nv]
        moved = float(np.abs(rates * scale).max(initial=0.0))
        now = float(getattr(core, entry.kind)[entry.index])
        most = MOST_INPUT * max(1.0, abs(now)) / (max(entry.high, -entry.low) or 1.0)
        factor = min(max(1.0, ROUNDING / moved), most) if moved > 0 else most
        lower, upper = model.control_limits[entry.index] if entry.kind == "controls" else (-np.inf, np.inf)
        low, high = max(factor * entry.low, lower - now), min(factor * entry.high, upper - now)
        found.append(Entry(entry.kind, entry.index, low, high))
    return found


def _of_state(model: Model, further: float, faster: float) -> Iterator[Entry]:
    """Coordinates and rates, which change by these multiples of CHANGE."""
    rate = faster * CHANGE * _typical_rate(model)
    units = np.where(angles(model), 1.0, model.length)
    for kind, by in (("q", further * CHANGE), ("qd", rate)):
        yield from (Entry(kind, k, -by * unit, by * unit) for k, unit in enumerate(units.tolist()))


def _of_activations(core: _core.Simulation, model: Model) -> Iterator[Entry]:
    for k in activated(model):
        drive, now = model.actuators[k], float(core.activations[k])
        yield _within("activations", k, now, drive.lower_activation, drive.upper_activation)


def _of_inputs(core: _core.Simulation, model: Model, inputs: str) -> Iterator[Entry]:
    if inputs == "controls":
        for k, (lower, upper) in enumerate(model.control_limits):
            yield _within("controls", k, float(core.controls[k]), lower, upper)
    elif inputs == "joint_forces":
        for k in range(model.nv):
            yield _within("joint_forces", k, float(core.joint_forces[k]), -np.inf, np.inf)


def _within(kind: str, index: int, now: float, lower: float, upper: float) -> Entry:
    """At a limit to one side only, beyond which nothing would change."""
    by = CHANGE * max(1.0, abs(now))
    return Entry(kind, index, max(lower - now, -by), min(upper - now, by))


def names_of(model: Model, inputs: str) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Names of the entries of the state and of the inputs."""
    states = [f"{name}.change" for name in model.qd_names] + [f"{name}.rate" for name in model.qd_names]
    states += [f"{model.actuators[k].name}.activation" for k in activated(model)]
    if inputs == "controls":
        return tuple(states), tuple(f"{name}.control" for name in model.control_names)
    return tuple(states), tuple(f"{name}.force" for name in model.qd_names if inputs != "none")
