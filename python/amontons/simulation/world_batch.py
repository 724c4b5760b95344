"""Worlds side by side that stay in memory between steps, with their states as arrays."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..checks import Array, about, integer, option, reals
from ..errors import InputError
from ..model.model import Model
from .rollout import advance_worlds, models_of
from .simulation import Simulation


class WorldBatch:
    """Worlds of a model, or of its variants, stepped side by side in C++ threads, without Python's lock.

    model: of all worlds, or one per world: variants (`Model.with_`) with the same coordinates and controls.
    worlds: how many; None: one per model.
    threads: worlds at a time, by default as many as there are cores to use. Every world has the bits that it
        has by itself, whatever their number.
    options: those of `Simulation`, for all worlds. Steps that miss their tolerance raise and warn nothing:
        `missed` counts them.

    The arrays keep their memory: who holds one, or a view of it by `numpy.from_dlpack` or
    `torch.from_dlpack`, sees the present state. Raises InputError naming the argument.

    >>> batch = WorldBatch(scenes.make("pendulum"), 4)
    >>> batch.step()  # or batch.step(controls), (worlds, controls)
    >>> batch.q.shape
    (4, 1)
    """

    simulations: list[Simulation]
    """the worlds; after changing one by itself, `refresh()` brings the arrays up to date"""
    q: Array
    """(worlds, nq), as `Simulation.q`"""
    qd: Array
    """(worlds, nv), as `Simulation.qd`"""
    time: Array
    """(worlds,) (s)"""
    residual: Array
    """(worlds,), the largest of the last call of step"""
    missed: Array
    """(worlds,), steps that did not converge, or gained energy from nothing, since the last reset"""
    failures: list[str]
    """of each world why it stopped; empty while it goes on. It stays as it is until its reset"""

    def __init__(
        self,
        model: Model | Sequence[Model],
        worlds: int | None = None,
        *,
        threads: int | None = None,
        **options: Any,
    ) -> None:
        models = models_of(model)
        count = len(models) if worlds is None else integer("worlds", worlds, 1)
        if len(models) not in (1, count):
            raise InputError(f"there are {len(models)} models for {count} worlds; give one, or one each")
        self._threads = None if threads is None else int(option("threads", threads))
        quiet = {"on_failure": "ignore", **options}
        fresh: dict[int, Simulation] = {}
        for each in models:
            if id(each) not in fresh:
                fresh[id(each)] = Simulation(each, **quiet)
        each_model = models * count if len(models) == 1 else models
        self.simulations = [fresh[id(each)].copy() for each in each_model]
        first = models[0]
        self.q, self.qd = np.zeros((count, first.nq)), np.zeros((count, first.nv))
        self.time, self.residual = np.zeros(count), np.zeros(count)
        self.missed = np.zeros(count, dtype=np.uint64)
        self.failures = [""] * count
        self.refresh()

    @property
    def model(self) -> Model:
        """The model of the first world."""
        return self.simulations[0].model

    def __len__(self) -> int:
        return len(self.simulations)

    def step(
        self,
        controls: ArrayLike | None = None,
        *,
        joint_forces: ArrayLike | None = None,
        repeat: int = 1,
        worlds: ArrayLike | None = None,
        out: Any = None,
    ) -> None:
        """Advance by `repeat` steps with controls, clipped to their limits, and forces that are held.

        controls: (worlds, controls), or (controls,) for all alike; joint_forces: (worlds, nv), or (nv,). None
            leaves them as they are. Arrays of float64 that speak DLPack are read without copies.
        worlds: those that go on, as indices or a mask; by default all. Their rows of the inputs count.
        out: (worlds, nq + nv) of float64 in memory of the processor, into which q and qd of all worlds are
            written: an array of NumPy, or what speaks DLPack and may be written, as a tensor of PyTorch.
        """
        shape = len(self), self.q.shape[1] + self.qd.shape[1]
        place = None if out is None else writable("out", out, shape)
        rows = self._rows(worlds)
        rows = rows[[not self.failures[k] for k in rows]] if len(rows) else rows
        size, nv = len(self.model.control_names), self.model.nv
        given = self._inputs("controls", controls, size, rows)
        forces = self._inputs("joint_forces", joint_forces, nv, rows)
        if len(rows):
            acting = [self.simulations[k] for k in rows]
            course = advance_worlds(acting, given, int(option("repeat", repeat)), self._threads, forces, 1)
            well = np.array([not failure for failure in course.failures])
            self.q[rows[well]], self.qd[rows[well]] = course.q[well, 0], course.qd[well, 0]
            self.residual[rows] = course.residuals[:, 0]
            self.missed[rows] += course.missed[:, 0]
            for k, failure in zip(rows.tolist(), course.failures, strict=True):
                self.failures[k] = failure
                self.time[k] = self.simulations[k].time
        if place is not None:
            place[:, : self.q.shape[1]], place[:, self.q.shape[1] :] = self.q, self.qd

    def reset(
        self,
        worlds: ArrayLike | None = None,
        *,
        keyframe: int | str | None = None,
        q: ArrayLike | None = None,
        qd: ArrayLike | None = None,
    ) -> None:
        """Begin again in some worlds, by default in all, as `Simulation.reset` does.

        worlds: indices, or a mask (worlds,). q: (rows, nq) with a row for each of them, or (nq,) for all;
            qd: (rows, nv), or (nv,).
        """
        rows = self._rows(worlds)
        at = [
            None if values is None else by_rows(what, values, len(rows), size)
            for what, values, size in (("q", q, self.model.nq), ("qd", qd, self.model.nv))
        ]
        for k, row in enumerate(rows.tolist()):
            own = [None if values is None else values[k] for values in at]
            with about(f"world {row}"):
                self.simulations[row].reset(keyframe, q=own[0], qd=own[1])
            self.failures[row] = ""
        self.missed[rows] = 0
        self.residual[rows] = 0.0
        self.refresh(rows)

    def refresh(self, worlds: ArrayLike | None = None) -> None:
        """Read the states of simulations that were changed by themselves."""
        for k in self._rows(worlds).tolist():
            world = self.simulations[k]
            self.q[k], self.qd[k] = world.model.tree.coordinates(world._core)
            self.time[k] = world.time

    def _rows(self, worlds: ArrayLike | None) -> Any:
        if worlds is None:
            return np.arange(len(self))
        given = np.asarray(worlds)
        if given.dtype == bool:
            if given.shape != (len(self),):
                raise InputError(f"worlds is a mask of the shape {given.shape}; it must be ({len(self)},)")
            return np.flatnonzero(given)
        rows = np.atleast_1d(given)
        whole = rows.size == 0 or np.issubdtype(rows.dtype, np.integer)
        if not whole or rows.ndim != 1 or np.any((rows < 0) | (rows >= len(self))):
            raise InputError(f"worlds must be indices from 0 to {len(self) - 1}, or a mask ({len(self)},)")
        if len(np.unique(rows)) != len(rows):
            raise InputError("worlds has a world twice")
        return rows.astype(np.intp)

    def _inputs(self, what: str, values: Any, size: int, rows: Any) -> Array | None:
        """(rows, 1, size) of some worlds, from a row for every world."""
        if values is None:
            return None
        chosen = by_rows(what, values, len(self), size)[rows]
        if not np.isfinite(chosen).all():
            raise InputError(f"{what} of world {rows[np.argwhere(~np.isfinite(chosen))[0, 0]]} is not finite")
        return np.ascontiguousarray(chosen)[:, None]

    def __repr__(self) -> str:
        stopped = sum(map(bool, self.failures))
        more = f", {stopped} stopped" if stopped else ""
        return f"amontons.WorldBatch({len(self)} worlds of {self.model!r}{more})"


def by_rows(what: str, values: Any, rows: int, size: int) -> Array:
    """(rows, size), of an array that may be one row for all."""
    given = reals(what, values)
    if given.shape == (size,):
        given = np.broadcast_to(given, (rows, size))
    if given.shape != (rows, size):
        raise InputError(
            f"{what} has the shape {given.shape}; it must be ({rows}, {size}), by worlds, or ({size},)"
        )
    return given


def writable(what: str, values: Any, shape: tuple[int, ...]) -> Array:
    """A view of memory that may be written: an array of NumPy, or what lends its memory by DLPack."""
    wanted = f"{what} must be an array of float64 with the shape {shape}, in memory of the processor"
    view = values
    if not isinstance(values, np.ndarray):
        try:
            view = np.from_dlpack(values)
        except Exception as error:  # the object answers, which may raise anything
            raise InputError(f"{wanted} ({' '.join(str(error).split())[:200]})") from None
    if view.shape != shape or view.dtype != np.float64:
        raise InputError(f"{wanted}; it has the shape {view.shape} and {view.dtype}")
    if not view.flags.writeable:
        raise InputError(f"{what} may not be written: its owner lends it for reading; give an array of NumPy")
    return view
