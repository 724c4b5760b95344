"""Loads of joints and contacts over a run: peaks, means and impulses, for the design of parts."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, Protocol

import numpy as np

from ..checks import Array
from ..model.coordinates import degrees, joint_labels
from ..model.model import Model, no_model
from ..model.parts import WORLD
from ..model.turns import conjugate, exponential, rotate
from .determinacy import Determined, Pose, determined
from .step_report import Report, Table
from .tables import WRENCH, WRENCH_UNITS

OF_CONTACTS = ("normal", "friction", "fx", "fy", "fz")
FIELDS = [
    ("component", "U8"),
    ("unit", "U3"),
    ("peak", np.float64),
    ("time", np.float64),
    ("mean", np.float64),
    ("rms", np.float64),
    ("impulse", np.float64),
    ("determined", np.bool_),
]


class Watched(Protocol):
    """The parts of a simulation that loads come from."""

    after_step: list[Any]

    @property
    def model(self) -> Model: ...
    @property
    def dt(self) -> float: ...
    @property
    def state(self) -> Any: ...
    @property
    def forces(self) -> Any: ...
    @property
    def contacts(self) -> Table: ...
    @property
    def _core(self) -> Any: ...


class Sums:
    """Peak, its time, mean, mean square and impulse of numbers that hold over steps; each an array (n,)."""

    def __init__(self, count: int) -> None:
        self.peak, self.time = np.zeros(count), np.full(count, np.nan)
        self.integral, self.square = np.zeros(count), np.zeros(count)

    def grow(self, count: int) -> None:
        """More numbers, which were zero up to now."""
        more = Sums(count)
        for name, values in vars(self).items():
            setattr(self, name, np.concatenate([values, getattr(more, name)]))

    def add(self, values: Array, time: float, lasting: float, at: Any = slice(None)) -> None:
        """values: of the numbers `at`, means over a step that began at `time` (s) and lasted so long (s)."""
        peak = self.peak[at]
        # The first of equal peaks counts: rounding makes none.
        larger = (np.abs(values) > (1 + 1e-9) * np.abs(peak)) | np.isnan(self.time[at])
        self.peak[at] = np.where(larger, values, peak)
        self.time[at] = np.where(larger, time, self.time[at])
        self.integral[at] += lasting * values
        self.square[at] += lasting * values**2


class Loads:
    """Loads of the joints and contacts of a model over a run; `Simulation.forces.loads` makes one.

    Both tables have one row for each component. The fields are its name, component, unit, peak, time, mean,
    rms, impulse and determined. peak is the value of the largest size, with its sign; time is the start of
    its step (s). impulse is the integral over time (N s, N m s). The tables are structured arrays:
    `pandas.DataFrame(loads.joints)` reads them.

    A component is not determined where it depends on how joints and contacts share a load that several of
    them could carry; the numbers are then one choice among many. It counts as determined if it was so
    whenever contacts or limits began, ended or changed between sticking and sliding, and at the end. Loops
    and piles of more than 300 unknowns count as not determined. Couplings, tendons and moments of contacts
    count as known.

    >>> simulation = Simulation(scenes.make("slider_crank"))
    >>> with simulation.forces.loads() as loads:
    ...     report = simulation.run(0.1)
    >>> loads.joints.dtype.names[:5]
    ('joint', 'component', 'unit', 'peak', 'time')
    """

    def __init__(self, model: Model, *, efforts: bool = True) -> None:
        """efforts: whether values of degrees of freedom follow those of joints in `add`."""
        if not isinstance(model, Model):
            raise no_model("Loads: model", model)
        count = 6 * len(model.joints) + model.dofs * efforts
        self._model, self._efforts = model, efforts
        self._sums, self._known = Sums(count), np.ones(count, bool)
        self._pairs: dict[tuple[int, int], int] = {}
        self._of_pairs, self._pairs_known = Sums(0), np.zeros((0, len(OF_CONTACTS)), bool)
        self._duration = 0.0
        self._active: tuple[Any, ...] = ()
        self._simulation: Watched | None = None

    def watch(self, simulation: Watched) -> None:
        """Collect the steps of a simulation of the same model from now on."""
        self._simulation = simulation
        simulation.after_step.append(self._after_step)

    def stop(self) -> None:
        """Collect no more."""
        if self._simulation is not None:
            self._judge_now()
            self._simulation.after_step.remove(self._after_step)
            self._simulation = None

    def __enter__(self) -> Loads:
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    @property
    def duration(self) -> float:
        """Time over which loads were collected (s)."""
        return self._duration

    def _after_step(self, simulation: Watched, report: Report) -> None:
        if simulation is not self._simulation:  # a copy, whose list holds the same function
            return
        contacts, stops = simulation.contacts, simulation.forces.joint_efforts["limit"] != 0
        self.add(joint_values(simulation), contacts, simulation.forces.instant.time, simulation.dt)
        if self.changed(contacts, stops):
            self._judge_now()

    def _judge_now(self) -> None:
        if self._simulation is not None and self._duration:
            pose = pose_of(self._simulation)
            self.judge(determined(self._model, pose, self._simulation.contacts))

    def changed(self, contacts: Table, stops: Array) -> bool:
        """Whether the points of contact by pair and state, or the active limits, are others than before."""
        fields = (contacts[name].tolist() for name in ("geom_a", "geom_b", "state"))
        active = (*map(tuple, fields), tuple(stops.tolist()))
        before, self._active = self._active, active
        return active != before

    def add(self, joints: Array, contacts: Table, time: float, lasting: float) -> None:
        """Values of one step: reactions and efforts (6 joints + dofs,), the contact table, start and length
        (s)."""
        self._duration += lasting
        self._sums.add(joints, time, lasting)
        pairs, values = pair_values(contacts)
        at = np.array([self._pairs.setdefault(pair, len(self._pairs)) for pair in pairs], dtype=int)
        more = len(self._pairs) - len(self._pairs_known)
        self._of_pairs.grow(len(OF_CONTACTS) * more)
        known = np.ones((more, len(OF_CONTACTS)), bool)
        self._pairs_known = np.concatenate([self._pairs_known, known])
        places = len(OF_CONTACTS) * at[:, None] + np.arange(len(OF_CONTACTS))
        self._of_pairs.add(values.ravel(), time, lasting, places.ravel())

    def judge(self, found: Determined) -> None:
        """Mark components that are not determined now; they stay so."""
        self._known &= np.concatenate([found.reactions.ravel(), found.efforts])[: len(self._known)]
        for pair, (normal, *force) in found.contacts.items():
            if pair in self._pairs:
                self._pairs_known[self._pairs[pair]] &= [normal, normal and all(force), *force]

    @property
    def joints(self) -> Table:
        """Rows of joints, then of degrees of freedom.

        fx, fy, fz (N) and tx, ty, tz (N m) of a joint: its reaction on body A in the axes of frame B, which
        is fixed in body B. The torque is about the origin of frame A. The axis of common joints is z. effort
        of a degree of freedom: motor, spring, damper, dry friction and limit together (N, N m).
        """
        self._judge_now()
        names = [(name, part, unit) for name in joint_labels(self._model.joints) for part, unit in _WRENCH]
        for name, dof in degrees(self._model.joints) if self._efforts else ():
            names.append((name, "effort", "N m" if dof.kind == "hinge" else "N"))
        return _table("joint", names, self._sums, self._duration, self._known)

    @property
    def contacts(self) -> Table:
        """Rows of pairs of geoms that carried a load: forces on the first one (N).

        normal: the sum of normal forces; friction: the size of the sum of tangential forces; fx, fy, fz: the
        whole force in world axes. Means are over the whole time, in touch or not.
        """
        self._judge_now()
        names = [
            (" / ".join(_geom_label(self._model, geom) for geom in pair), part, "N")
            for pair in self._pairs
            for part in OF_CONTACTS
        ]
        return _table("pair", names, self._of_pairs, self._duration, self._pairs_known.ravel())

    def rows(self) -> Iterator[list[Any]]:
        """Header and rows of both tables with what they are of, for CSV files."""
        yield ["of", "name", *(name for name, _ in FIELDS)]
        for kind, table in (("joint", self.joints), ("contact", self.contacts)):
            yield from ([kind, *row] for row in table.tolist())

    def __len__(self) -> int:
        """Number of rows of both tables."""
        return len(self._known) + self._pairs_known.size

    def __repr__(self) -> str:
        return f"amontons.results.Loads({len(self._model.joints)} joints, {self._duration:g} s)"


_WRENCH = tuple(zip(WRENCH, WRENCH_UNITS, strict=True))


def _table(first: str, names: Sequence[Sequence[str]], sums: Sums, duration: float, known: Array) -> Table:
    width = max((len(name) for name, *_ in names), default=1)
    table = np.zeros(len(names), [(first, f"U{width}"), *FIELDS])
    for field, values in zip((first, "component", "unit"), zip(*names, strict=True), strict=False):
        table[field] = values
    over = duration or 1.0
    table["peak"], table["time"], table["impulse"] = sums.peak, sums.time, sums.integral
    table["mean"], table["rms"] = sums.integral / over, np.sqrt(sums.square / over)
    table["determined"] = known
    return table


def _geom_label(model: Model, geom: int) -> str:
    part = model.geoms[geom]
    if part.name:
        return part.name
    return "world" if part.body == WORLD else model.bodies[part.body].name or f"body {part.body}"


def pose_of(simulation: Watched) -> Pose:
    """The present one."""
    state, core = simulation.state, simulation._core
    return Pose(
        state.positions, state.orientations, state.linear_velocities, state.angular_velocities,
        simulation.model.tree.joint_coordinates(core),
    )  # fmt: skip


def joint_values(simulation: Watched) -> Array:
    """Reactions in the axes of frames B and efforts of the last step, (6 joints + dofs,)."""
    reactions, efforts = simulation.forces.joint_reactions, simulation.forces.joint_efforts
    wrenches = np.concatenate([reactions["force"], reactions["torque"]], axis=1)
    turned = in_frames_b(simulation.model, pose_of(simulation), wrenches, simulation.dt)
    sums = efforts["passive"] + efforts["motor"] + efforts["friction"] + efforts["limit"]
    return np.concatenate([turned.ravel(), sums])


def in_frames_b(model: Model, pose: Pose, wrenches: Array, dt: float) -> Array:
    """Wrenches (joints, 6) of the last step, from world axes to those of the frames B at its start.

    A step turns a body by its velocity at the end: R_start = exp(-dt w) R_end.
    """
    turned = wrenches.reshape(-1, 2, 3).copy()
    bodies = np.array([joint.body_b for joint in model.joints], dtype=int)
    on = bodies != WORLD
    if on.any():
        steps = exponential(dt * pose.angular_velocities[bodies[on]])
        ends = pose.orientations[bodies[on]]
        ends = ends / np.linalg.norm(ends, axis=1, keepdims=True)
        turned[on] = rotate(conjugate(ends)[:, None], rotate(steps[:, None], turned[on]))
    frames = np.array([joint.frame_b.rotation for joint in model.joints]).reshape(-1, 4)
    return rotate(conjugate(frames)[:, None], turned).reshape(-1, 6)


def pair_values(contacts: Table) -> tuple[list[tuple[int, int]], Array]:
    """Pairs of geoms that touch, and (pairs, 5) sums over their points: normal, friction, fx, fy, fz (N)."""
    rows = contacts[contacts["state"] != "open"]
    pairs, of = np.unique(np.stack([rows["geom_a"], rows["geom_b"]], axis=1), axis=0, return_inverse=True)
    normal = np.sum(rows["force"] * rows["normal"], axis=1)
    sums = np.zeros((len(pairs), 7))
    across = rows["force"] - normal[:, None] * rows["normal"]
    np.add.at(sums, of.ravel(), np.column_stack([normal, rows["force"], across]))
    friction = np.linalg.norm(sums[:, 4:], axis=1)
    return [(a, b) for a, b in pairs.tolist()], np.column_stack([sums[:, 0], friction, sums[:, 1:4]])
