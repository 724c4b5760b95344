"""Recordings: what a simulation did, in HDF5 files that other programs read without amontons.

/format "amontons-recording", /version; /model and /options: JSON; /source: where the model came from. One
frame per recorded step: /frames/step, time, positions, orientations, linear_velocities, angular_velocities,
joint_coordinates. /contacts/rows: the contact tables of all frames one after the other, that of frame k in
rows offsets[k] to offsets[k + 1]. /reports: one row per step, of frames or not. /complete: 0 if an exception
ended the recording.
"""

from __future__ import annotations

import json
from os import PathLike
from types import TracebackType
from typing import Any

import h5py
import numpy as np

from ...errors import FileError, InputError
from ...simulation.forces import CONTACTS
from ...simulation.outcome import REPORTS, Report, reports_array
from ...simulation.simulation import Simulation
from ..files import reserve, settle, writable
from ..hdf5 import write_integer, write_text
from .model_json import model_to_json

FORMAT = "amontons-recording"
VERSION = 1
BUFFER = 8_000_000
"""Bytes of frames that are collected before they are written."""
STATE = ("positions", "orientations", "linear_velocities", "angular_velocities", "joint_coordinates")


class Recorder:
    """Writes a recording while a simulation runs; `amontons.record` makes one.

    add(report) after every step. The file appears under its name at close(), or when a `with` block ends; an
    exception ends the recording with what came before it, marked as not complete.
    """

    def __init__(
        self,
        path: str | PathLike[str],
        simulation: Simulation,
        *,
        every: int = 1,
        contacts: bool = True,
        source: str = "",
    ) -> None:
        if isinstance(every, bool) or not isinstance(every, int) or every < 1:
            raise InputError(f"every = {every!r}; it must be an integer, at least 1")
        self.path, self.every = writable(path), every
        self._simulation, self._with_contacts = simulation, contacts
        self._first_step = simulation.steps
        self._frames: dict[str, list[Any]] = {name: [] for name in ("step", "time", *STATE)}
        self._contacts: list[np.ndarray[Any, Any]] = []
        self._reports: list[Report] = []
        self._buffered, self._written_rows = 0, 0
        self._temporary = reserve(self.path)
        self._file: h5py.File | None = h5py.File(self._temporary, "w", libver=("earliest", "v110"))
        try:
            self._create(self._file, source)
            self._frame()
        except BaseException:
            self._discard()
            raise

    def add(self, report: Report) -> None:
        """Record the step that returned `report`."""
        if self._file is None:
            raise InputError(f"the recording {self.path} is closed")
        self._reports.append(report)
        if (self._simulation.steps - self._first_step) % self.every == 0:
            self._frame()
        if self._buffered > BUFFER:
            self._flush()

    def close(self, *, complete: bool = True) -> None:
        """Write what is left and give the file its name."""
        if self._file is None:
            return
        try:
            self._flush()
            self._file["complete"][...] = int(complete)
            self._file.close()
            settle([self._temporary], [self.path])
        except OSError as error:  # a full disk
            raise FileError(f"{self.path}: cannot be written ({error})") from None
        finally:
            self._discard()

    def _discard(self) -> None:
        if self._file is not None:
            self._file.close()
        self._file = None
        self._temporary.unlink(missing_ok=True)

    def __enter__(self) -> Recorder:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close(complete=kind is None)

    def _create(self, file: h5py.File, source: str) -> None:
        write_text(file, "format", FORMAT)
        write_integer(file, "version", VERSION)
        write_integer(file, "complete", 0)
        write_text(file, "source", source)
        write_text(file, "model", model_to_json(self._simulation.model))
        write_text(file, "options", json.dumps(dict(self._simulation.options)))
        frames = file.create_group("frames")
        _extensible(frames, "step", np.dtype(np.int64), ())
        _extensible(frames, "time", np.dtype(np.float64), ())
        for name in STATE:
            shape = getattr(self._simulation.state, name).shape
            _extensible(frames, name, np.dtype(np.float64), shape)
        contacts = file.create_group("contacts")
        _extensible(contacts, "rows", storable(CONTACTS), ())
        offsets = _extensible(contacts, "offsets", np.dtype(np.int64), ())
        offsets.resize(1, axis=0)
        _extensible(file, "reports", storable(REPORTS), ())

    def _frame(self) -> None:
        sim = self._simulation
        self._frames["step"].append(sim.steps)
        self._frames["time"].append(sim.time)
        for name in STATE:
            self._frames[name].append(getattr(sim.state, name).copy())
            self._buffered += self._frames[name][-1].nbytes
        table = sim.contacts if self._with_contacts else np.empty(0, CONTACTS)
        self._contacts.append(table.astype(storable(CONTACTS)))
        self._buffered += self._contacts[-1].nbytes

    def _flush(self) -> None:
        assert self._file is not None
        for name, values in self._frames.items():
            _append(self._file["frames"][name], np.array(values))
            values.clear()
        if self._contacts:
            _append(self._file["contacts/rows"], np.concatenate(self._contacts))
            offsets = self._written_rows + np.cumsum([len(table) for table in self._contacts])
            _append(self._file["contacts/offsets"], offsets)
            self._written_rows = int(offsets[-1])
            self._contacts.clear()
        _append(self._file["reports"], reports_array(self._reports).astype(storable(REPORTS)))
        self._reports.clear()
        self._buffered = 0


def storable(dtype: np.dtype[Any]) -> np.dtype[Any]:
    """The same record with strings of bytes, which HDF5 has, in place of those of NumPy."""
    names = dtype.names or ()
    return np.dtype([(n, f"S{dtype[n].itemsize // 4}" if dtype[n].kind == "U" else dtype[n]) for n in names])


def _extensible(group: h5py.Group, name: str, dtype: np.dtype[Any], shape: tuple[int, ...]) -> h5py.Dataset:
    """A dataset that grows along its first axis, in compressed chunks of about 256 kB."""
    row = max(1, dtype.itemsize * int(np.prod(shape)))
    return group.create_dataset(
        name,
        shape=(0, *shape),
        maxshape=(None, *(n or None for n in shape)),  # a model without joints: HDF5 has no chunks of nothing
        dtype=dtype,
        chunks=(max(1, 262144 // row), *(max(1, n) for n in shape)),
        compression="gzip",  # which every HDF5 has
        compression_opts=1,
        shuffle=True,
    )


def _append(dataset: h5py.Dataset, values: np.ndarray[Any, Any]) -> None:
    if len(values):
        first = len(dataset)
        dataset.resize(first + len(values), axis=0)
        dataset[first:] = values
