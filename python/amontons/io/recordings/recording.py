"""Reading recordings."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from functools import cached_property
from os import PathLike
from pathlib import Path
from types import TracebackType
from typing import Any, TypeVar

import h5py
import numpy as np

from ...errors import FileError, InputError
from ...limits import Limits
from ...model.model import Model
from ...simulation.copies import set_clock
from ...simulation.simulation import Simulation
from ...simulation.step_report import REPORTS
from ...simulation.tables import CONTACTS
from ..files import existing
from ..hdf5 import Reader, open_hdf5
from .columns import Column, column_of, units_of
from .model_json import model_from_json
from .recorder import COORDINATES, FORMAT, STATE, VERSION
from .unfinished import is_open_for_writing, open_unfinished

T = TypeVar("T")
Table = np.ndarray[Any, Any]
LONGEST_WAIT = 2.0
"""Seconds for a writer between whose writes nothing is seen."""
PAUSE = 0.02
WIDTH = {"orientations": 4, "joint_coordinates": None}
"""Numbers of a body, 3 else; of the coordinates of all joints as many as the model has."""


class StoredArray:
    """An array of a recording that is read as it is indexed, as NumPy does; `array[...]` is all of it."""

    def __init__(self, reader: Reader, name: str, dataset: h5py.Dataset | Table) -> None:
        self._reader, self._name, self._dataset = reader, name, dataset
        self.shape: tuple[int, ...] = tuple(map(int, dataset.shape))
        self.dtype = np.dtype(np.float64)

    def __len__(self) -> int:
        return self.shape[0]

    def __getitem__(self, index: Any) -> Any:
        if isinstance(self._dataset, h5py.Dataset) and not self._dataset:
            raise InputError(
                f"the recording {self._reader.path} is closed; use it inside its with block, or open it again"
            )
        try:
            return self._dataset[index]
        except (IndexError, TypeError, ValueError):  # of the index
            raise
        except Exception as error:
            reason = " ".join(str(error).split())[:300]
            where = f"{self._reader.name(self._name)}[{index}]"
            raise self._reader.fail(f"{where} cannot be read; the file is damaged ({reason})") from None

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> Table:
        return np.asarray(self[...], dtype)

    def __repr__(self) -> str:
        return f"amontons.StoredArray({self._name}, {self.shape})"


class Recording:
    """A recorded run, open for reading; `amontons.read_recording` makes one.

    times (frames,) (s) and steps (frames,). positions (frames, bodies, 3), orientations (frames, bodies, 4),
    linear_velocities, angular_velocities (frames, bodies, 3), joint_coordinates (frames, coordinates): read
    from the file as they are indexed, `recording.positions[-1]`, `recording.positions[:, 3, 2]`. q (frames,
    nq), qd (frames, nv) and controls (frames, controls) likewise. len() is the
    number of frames. complete is False if an exception ended the recording; source says where the model came
    from. Closes at the end of a `with` block, or by close().
    """

    positions: StoredArray
    orientations: StoredArray
    linear_velocities: StoredArray
    angular_velocities: StoredArray
    joint_coordinates: StoredArray
    q: StoredArray
    """(frames, nq), as `Simulation.q`; InputError in a recording of an older version"""
    qd: StoredArray
    """(frames, nv), as `Simulation.qd`"""
    controls: StoredArray
    """(frames, controls), as `Simulation.controls`: those that were set when the frame was recorded"""
    signals: StoredArray | None
    """(frames, signals), named by `signal_units`; None in a recording of an older version"""

    def __init__(self, path: Path, file: h5py.File, limits: Limits) -> None:
        self.path, self._file, self._reader = path, file, Reader(path, file, limits)
        r = self._reader
        if r.text("format") != FORMAT:
            raise r.fail("is no recording; give a file that `amontons run --record` or Recorder wrote")
        r.require_version(VERSION)
        frames = r.sub("frames")
        self.steps: Table = frames.integers("step")
        self.times: Table = frames.finite("time", frames.array("time"))[: len(self.steps)]
        if self.times.shape != self.steps.shape:
            raise r.fail(f"{frames.name('time')} must have {len(self.steps)} entries, one for each step")
        self.complete = bool(r.integer("complete"))
        self.source = r.text("source")
        bodies = None
        for name in STATE:
            stored = self._array(frames, name)
            if name != "joint_coordinates":
                bodies = stored.shape[1] if bodies is None else bodies
                if stored.shape != (len(self), bodies, WIDTH.get(name, 3)):
                    raise r.fail(f"{frames.name(name)} has the shape {stored.shape}, unlike the positions")
            setattr(self, name, stored)
        self.has_coordinates = frames.has("q")
        """whether q, qd and controls are in the file"""
        for name in COORDINATES if self.has_coordinates else ():
            setattr(self, name, self._array(frames, name))
        self.signals = self._array(r.sub("signals"), "values") if r.has("signals") else None
        self._contacts = r.sub("contacts")
        self._rows = self._contacts.dataset("rows", in_parts=True)
        self._contacts.require_columns(self._rows, "rows", CONTACTS, optional=("torque", "spin"))
        self._offsets = offsets = self._contacts.integers("offsets")[: len(self) + 1]
        if len(offsets) != len(self) + 1:
            raise r.fail(f"/contacts/offsets must have {len(self) + 1} entries, one more than frames")
        if offsets[0] < 0 or np.any(offsets[1:] < offsets[:-1]) or offsets[-1] > self._rows.shape[0]:
            raise r.fail(f"/contacts/offsets must ascend from 0 to at most {self._rows.shape[0]}, the rows")

    def _array(self, frames: Reader, name: str) -> StoredArray:
        """One of the arrays of the state, checked but for its values."""
        if not frames.has(name):
            raise frames.fail(f"{frames.name(name)} is missing")
        dataset = frames.dataset(name, in_parts=True)
        with frames.damage(frames.name(name)):
            dimensions = 2 if name in ("joint_coordinates", "values", *COORDINATES) else 3
            if dataset.dtype.kind != "f" or dataset.ndim != dimensions or dataset.shape[0] < len(self):
                raise frames.fail(
                    f"{frames.name(name)} is {dataset.shape} of {dataset.dtype}; it must hold real numbers "
                    f"of {len(self)} frames"
                )
            # A process that was killed may have begun a frame that /frames/step does not count.
            return StoredArray(frames, name, dataset if len(dataset) == len(self) else dataset[: len(self)])

    def __getattr__(self, name: str) -> Any:
        if name in COORDINATES:
            raise InputError(
                f"{self.path} has no {name}: an older version wrote it; record it again, or take its columns"
            )
        raise AttributeError(f"a recording has no {name}")

    def __len__(self) -> int:
        return len(self.steps)

    @cached_property
    def model(self) -> Model:
        """The model that was simulated."""
        model = self._reader.parsed("model", model_from_json)
        if self.positions.shape[1] != len(model.bodies):
            raise self._reader.fail(
                f"/frames have {self.positions.shape[1]} bodies but the model has {len(model.bodies)}"
            )
        if self.joint_coordinates.shape[1] != model.dofs:
            raise self._reader.fail(
                f"/frames/joint_coordinates has {self.joint_coordinates.shape[1]} columns but the model "
                f"has {model.dofs} degrees of freedom"
            )
        return model

    @cached_property
    def options(self) -> dict[str, Any]:
        """The options of the simulation by name."""
        options = self._reader.parsed("options", json.loads)
        if not isinstance(options, dict):
            raise self._reader.fail("/options must hold names and values")
        return options

    @cached_property
    def signal_units(self) -> dict[str, str]:
        """Unit by name of each column of `signals`: motor efforts, controls, reactions, sensors."""
        if self.signals is None:
            return {}
        units = self._reader.sub("signals").parsed("units", json.loads)
        texts = isinstance(units, dict) and all(isinstance(unit, str) for unit in units.values())
        if not texts or len(units) != self.signals.shape[1]:
            raise self._reader.fail(
                f"/signals/units must be a unit for each of {self.signals.shape[1]} signals"
            )
        return units

    @cached_property
    def columns(self) -> dict[str, str]:
        """Unit by name of each column: signals, joints, bodies and reports, in this order."""
        return units_of(self)

    def column(self, name: str) -> Column:
        """A recorded number over time by name: "screw.motor", "foot.fx", "ball.z", "residual".

        States and signals have a value for each frame, reports for each step. Raises InputError, which lists
        the known names, if there is no such column.
        """
        return column_of(self, name)

    @cached_property
    def reports(self) -> Table:
        """One row per step, recorded as a frame or not; the fields of `Report`, the timings among them."""
        self._reader.require_columns(self._reader.dataset("reports"), "reports", REPORTS)
        rows = self._reader.array("reports", "V")
        with self._reader.damage("/reports"):  # texts that are none
            return rows.astype(REPORTS)

    def contacts(self, frame: int) -> Table:
        """The contact table of the step that led to a frame, fields as in `Simulation.contacts`.

        Fields that a recording of an older version lacks (torque, spin) are zero.
        """
        k = self._checked(frame)
        with self._contacts.damage(self._contacts.name("rows")):
            rows = self._rows[self._offsets[k] : self._offsets[k + 1]]
        table = np.zeros(len(rows), CONTACTS)
        for name in set(rows.dtype.names or ()) & set(CONTACTS.names or ()):
            table[name] = rows[name]
        return table

    def simulation(self, frame: int, **options: Any) -> Simulation:
        """A simulation at the time of a frame, with its poses, velocities and controls.

        options: of the simulation, in place of those that were recorded. Its steps are near the recorded ones
        and have other bits: impulses of the step before, loads and activations are not recorded. A simulation
        that `Simulation.save` wrote goes on bit for bit. Raises InputError if there is no such frame, or an
        option cannot be used.
        """
        k = self._checked(frame)
        recorded = {n: v for n, v in self.options.items() if n != "method" or isinstance(v, str)}
        made = Simulation(self.model, **(recorded | options))
        if self.has_coordinates:
            made.set_q(self.q[k])  # turns too
            made.controls = self.controls[k]
        for name in STATE:
            if name != "joint_coordinates":
                setattr(made.state, name, getattr(self, name)[k])
        set_clock(made, float(self.times[k]), int(self.steps[k]))
        return made

    def frame_at(self, time: float) -> int:
        """The frame nearest to a time (s)."""
        return int(np.argmin(np.abs(self.times - time)))

    def close(self) -> None:
        """Close the file; what was not read before can no longer be."""
        self._file.close()

    def __enter__(self) -> Recording:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def __repr__(self) -> str:
        span = f"t = {self.times[0]:g} to {self.times[-1]:g} s" if len(self) else "empty"
        return f"amontons.Recording({self.path.name}, {len(self)} frames, {span})"

    def _checked(self, frame: int) -> int:
        if not -len(self) <= frame < len(self):
            raise InputError(f"there is no frame {frame}; the recording has {len(self)}")
        return frame % len(self)


def _opened(path: Path) -> h5py.File:
    """The file, which may be written at the moment, or have been when its process was killed."""
    if is_open_for_writing(path):
        return open_unfinished(path)
    # A driver of its own, by which HDF5 tells it from the file that a recorder of this process writes.
    return h5py.File(path, driver="stdio", locking=False)


def open_recording(path: str | PathLike[str], limits: Limits) -> Recording:
    """See `amontons.read_recording`."""
    path = existing(path, "a recording")
    return _settled(path, lambda: _with_file(path, lambda file: Recording(path, file, limits)))


def says_recording(path: str | PathLike[str]) -> bool:
    """See `is_recording`; looks at a file as `open_recording` does."""
    try:
        path = existing(path, "a recording")
        return _settled(path, lambda: _with_file(path, lambda file: _format(path, file))) == FORMAT
    except (InputError, OSError):
        return False


def _format(path: Path, file: h5py.File) -> str:
    with file:
        return Reader(path, file).text("format")


def _settled(path: Path, look: Callable[[], T]) -> T:
    """Returns the result of `look`. HDF5 reports a file as damaged while its writer opens or closes it, so
    `look` is called again while the file changes.
    """
    end = time.monotonic() + LONGEST_WAIT
    while True:
        before = path.stat()
        try:
            return look()
        except FileError:
            time.sleep(PAUSE)
            now = path.stat()
            same = (before.st_mtime_ns, before.st_size) == (now.st_mtime_ns, now.st_size)
            if same or time.monotonic() > end:
                raise


def _with_file(path: Path, look: Callable[[h5py.File], T]) -> T:
    file = open_hdf5(path, "a recording", _opened)
    try:
        return look(file)
    except BaseException:
        file.close()
        raise
