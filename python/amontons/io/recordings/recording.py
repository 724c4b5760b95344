"""Reading recordings."""

from __future__ import annotations

import json
from functools import cached_property
from os import PathLike
from pathlib import Path
from types import TracebackType
from typing import Any

import h5py
import numpy as np

from ...errors import FileError, InputError
from ...model.model import Model
from ...simulation.forces import CONTACTS
from ...simulation.outcome import REPORTS
from ..files import existing
from ..hdf5 import Reader
from .model_json import model_from_json
from .recorder import FORMAT, STATE, VERSION

Table = np.ndarray[Any, Any]


class Recording:
    """A recorded run, open for reading; `amontons.read_recording` makes one.

    times (frames,) (s) and steps (frames,). positions (frames, bodies, 3), orientations (frames, bodies, 4),
    linear_velocities, angular_velocities (frames, bodies, 3), joint_coordinates (frames, coordinates): read
    from the file as they are indexed, `recording.positions[-1]`, `recording.positions[:, 3, 2]`. len() is the
    number of frames. complete is False if an exception ended the recording; source says where the model came
    from. Closes at the end of a `with` block, or by close().
    """

    positions: h5py.Dataset
    orientations: h5py.Dataset
    linear_velocities: h5py.Dataset
    angular_velocities: h5py.Dataset
    joint_coordinates: h5py.Dataset

    def __init__(self, path: Path, file: h5py.File) -> None:
        self.path, self._file, self._reader = path, file, Reader(path, file)
        r = self._reader
        if r.text("format") != FORMAT:
            raise r.fail("is no recording; give a file that `amontons run --record` or Recorder wrote")
        r.require_version(VERSION)
        frames = r.sub("frames")
        self.steps: Table = frames.array("step")
        self.times: Table = frames.array("time")[: len(self.steps)]
        self.complete = bool(r.integer("complete"))
        self.source = r.text("source")
        for name in STATE:
            dataset = frames.group.get(name)
            if not isinstance(dataset, h5py.Dataset) or len(dataset) < len(self):
                raise r.fail(f"{frames.name(name)} is missing or does not have {len(self)} frames")
            # A process that was killed may have begun a frame that /frames/step does not count.
            setattr(self, name, dataset if len(dataset) == len(self) else dataset[: len(self)])
        self._offsets = r.sub("contacts").integers("offsets")[: len(self) + 1]
        if len(self._offsets) != len(self) + 1:
            raise r.fail(f"/contacts/offsets must have {len(self) + 1} entries, one more than frames")

    def __len__(self) -> int:
        return len(self.steps)

    @cached_property
    def model(self) -> Model:
        """The model that was simulated."""
        return self._reader.parsed("model", model_from_json)

    @cached_property
    def options(self) -> dict[str, Any]:
        """The options of the simulation by name."""
        return self._reader.parsed("options", json.loads)

    @cached_property
    def reports(self) -> Table:
        """One row per step, recorded as a frame or not; the fields of `Report`, the timings among them."""
        return self._reader.array("reports").astype(REPORTS)

    def contacts(self, frame: int) -> Table:
        """The contact table of the step that led to a frame, fields as in `Simulation.contacts`.

        Fields that a recording of an older version lacks (torque, spin) are zero.
        """
        k = self._checked(frame)
        rows = self._file["contacts/rows"][self._offsets[k] : self._offsets[k + 1]]
        table = np.zeros(len(rows), CONTACTS)
        for name in set(rows.dtype.names or ()) & set(CONTACTS.names or ()):
            table[name] = rows[name]
        return table

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
    try:
        # A driver of its own, by which HDF5 tells it from the file that a recorder of this process writes.
        return h5py.File(path, driver="stdio", locking=False)
    except OSError:
        return h5py.File(path, libver="latest", swmr=True, locking=False)


def open_recording(path: str | PathLike[str]) -> Recording:
    """See `amontons.read_recording`."""
    path = existing(path, "a recording")
    try:
        file = _opened(path)
    except OSError:
        raise FileError(f"{path}: is no HDF5 file, or damaged; give a recording") from None
    try:
        return Recording(path, file)
    except BaseException:
        file.close()
        raise
