"""Recordings: what a simulation did, in HDF5 files that other programs read without amontons.

/format "amontons-recording", /version; /model and /options: JSON; /source: where the model came from. One
frame per recorded step: /frames/step, time, positions, orientations, linear_velocities, angular_velocities,
joint_coordinates, q, qd, controls. /signals/values: motor efforts, controls, reactions and sensors of each
frame, with a column for each name of /signals/units (JSON: unit by name). /contacts/rows: the contact tables
of all frames one after the other, that of frame k in rows offsets[k] to offsets[k + 1]. /reports: one row per
step, of frames or not. /complete: 1 where the recording was closed without an exception; a process that was
killed leaves 0.

/frames/step is written last in each frame: the file of a killed process is complete up to that frame.
"""

from __future__ import annotations

import json
import warnings
import weakref
from pathlib import Path
from types import TracebackType
from typing import Any, NamedTuple

import h5py
import numpy as np

from ...checks import option
from ...errors import FileError, InputError, StepWarning
from ...simulation.own_method import name_of
from ...simulation.signals import Signals
from ...simulation.simulation import Simulation
from ...simulation.step_report import REPORTS, Report, reports_array
from ...simulation.tables import CONTACTS
from ..files import writable
from ..hdf5 import hdf5_image, write_integer, write_text
from .background import Background
from .growing import LIBVER, GrowingFile, extensible
from .model_json import model_to_json

FORMAT = "amontons-recording"
VERSION = 1
BUFFER = 8_000_000
"""Bytes that are collected before they are written, unless DELAY comes first."""
OTHERS = {".csv", ".gif", ".html", ".json", ".mp4", ".npz", ".parquet", ".png", ".txt", ".usd", ".xml"}
"""Suffixes of files that are no recordings, whatever is in them."""
DELAY = 0.4
"""Seconds within which what was recorded is on its way to the disk."""
STATE = ("positions", "orientations", "linear_velocities", "angular_velocities", "joint_coordinates")
COORDINATES = ("q", "qd", "controls")
"""Arrays of a frame that recordings of older versions lack."""

Array = np.ndarray[Any, Any]


class _Item(NamedTuple):
    """The data of one step."""

    frame: dict[str, Any] | None
    contacts: Array | None
    report: Report | None


class Recorder:
    """Writes a recording while a simulation runs; `amontons.record` makes one.

    add(report) after every step, or `simulation.run(..., after_step=recorder)`. The file has its name from
    the beginning and can be read at any time; close(), or the end of a `with` block, marks it as complete,
    unless an exception ended it.
    """

    def __init__(
        self,
        path: Path,
        simulation: Simulation,
        *,
        every: int,
        contacts: bool,
        signals: bool,
        source: str,
        overwrite: bool,
    ) -> None:
        if path.suffix.lower() in OTHERS:
            raise FileError(
                f"{path}: recordings are HDF5 files: name it {path.stem}.h5; "
                "`amontons export` makes others of it"
            )
        self.path, self.every = writable(path, new=not overwrite), int(option("every", every))
        self._simulation, self._with_contacts = simulation, contacts
        self._signals = Signals(simulation.model) if signals else None
        self._first_step, self._added = simulation.steps, False
        with hdf5_image(LIBVER) as (file, image):
            self._create(file, source)
        self._file = GrowingFile(self.path, image(), overwrite=overwrite)
        writer = _Writer(self._file)
        try:
            writer([self._item(None)])
        except BaseException as error:
            self._file.close()
            self.path.unlink(missing_ok=True)
            if isinstance(error, FileError):  # which says that something is in it
                why = getattr(error.__context__, "strerror", None) or error
                raise FileError(
                    f"{self.path}: cannot be begun ({why}); nothing was recorded, and no file is left"
                ) from None
            raise
        self._background: Background[_Item] = Background(writer, delay=DELAY, enough=BUFFER)
        # Closes a recorder that was not closed, at the end of its life or of the process.
        self._end = weakref.finalize(self, _finish, self._background, self._file)

    def add(self, report: Report) -> None:
        """Record the step that returned `report`.

        Raises FileError where what was added before could not be written: the disk is full, or somebody
        removed the file. Data written before the error stays.
        """
        if not self._end.alive:
            raise InputError(
                f"the recording {self.path} is closed; use it inside its with block, or open it again"
            )
        if not self._background.ours:
            raise InputError(
                f"{self.path} is recorded by the process that began it; let each record a file of its own"
            )
        self._added = True
        item = self._item(report)
        size = sum(np.asarray(v).nbytes for v in (item.frame or {}).values())
        self._background.put(item, 200 + size + (0 if item.contacts is None else item.contacts.nbytes))

    def __call__(self, simulation: Simulation, report: Report) -> None:
        """The recorder as an `after_step` of its simulation."""
        if simulation is not self._simulation:
            raise InputError(f"{self.path} records another simulation; give each a recorder of its own")
        self.add(report)

    def close(self, *, complete: bool = True) -> None:
        """Write what is left, and whether that is all; warns if steps were made and none was added."""
        if not self._end.alive or not self._background.ours:
            return
        if complete and not self._added and (made := self._simulation.steps - self._first_step) > 0:
            warnings.warn(
                f"{self.path} has the first state alone: {made} steps were made and none was recorded; run "
                "with simulation.run(..., after_step=recorder), or call recorder.add(simulation.step())",
                StepWarning,
                stacklevel=3,
            )
        try:
            self._background.close()
            if complete:
                self._file.append({}, complete=1)
        finally:
            self._end()

    def __enter__(self) -> Recorder:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close(complete=kind is None)

    def _create(self, file: h5py.File, source: str) -> None:
        options = self._simulation.options
        write_text(file, "format", FORMAT)
        write_integer(file, "version", VERSION)
        write_integer(file, "complete", 0)
        write_text(file, "source", source)
        write_text(file, "model", model_to_json(self._simulation.model))
        write_text(file, "options", json.dumps(dict(options) | {"method": name_of(options["method"])}))
        frames = file.create_group("frames")
        extensible(frames, "step", np.dtype(np.int64))
        extensible(frames, "time", np.dtype(np.float64))
        for name in STATE:
            shape = getattr(self._simulation.state, name).shape
            extensible(frames, name, np.dtype(np.float64), shape)
        for name, size in zip(COORDINATES, self._sizes(), strict=True):
            extensible(frames, name, np.dtype(np.float64), (size,))
        units = self._signals.units if self._signals else {}
        signals = file.create_group("signals")
        write_text(signals, "units", json.dumps(units))
        extensible(signals, "values", np.dtype(np.float64), (len(units),))
        contacts = file.create_group("contacts")
        extensible(contacts, "rows", storable(CONTACTS), compressed=True)
        offsets = extensible(contacts, "offsets", np.dtype(np.int64))
        offsets.resize(1, axis=0)
        extensible(file, "reports", storable(REPORTS))

    def _sizes(self) -> tuple[int, int, int]:
        model = self._simulation.model
        return model.nq, model.nv, len(model.control_names)

    def _item(self, report: Report | None) -> _Item:
        sim = self._simulation
        if (sim.steps - self._first_step) % self.every:
            return _Item(None, None, report)
        frame = {"step": sim.steps, "time": sim.time}
        frame |= {name: getattr(sim.state, name).copy() for name in STATE}
        frame["q"], frame["qd"] = sim.model.tree.coordinates(sim._core)
        frame["controls"] = sim.state.controls.copy()
        frame["signals"] = self._signals.read(sim) if self._signals else np.zeros(0)
        table = sim.contacts if self._with_contacts else np.empty(0, CONTACTS)
        return _Item(frame, table.astype(storable(CONTACTS)), report)


class _Writer:
    """Items as rows of the file."""

    def __init__(self, file: GrowingFile) -> None:
        self._file, self._contact_rows = file, 0

    def __call__(self, items: list[_Item]) -> None:
        rows: dict[str, Array] = {}
        frames = [item.frame for item in items if item.frame is not None]
        tables = [item.contacts for item in items if item.contacts is not None]
        reports = [item.report for item in items if item.report is not None]
        if frames:
            rows["contacts/rows"] = np.concatenate(tables)
            rows["contacts/offsets"] = self._contact_rows + np.cumsum([len(table) for table in tables])
            rows["signals/values"] = np.array([frame["signals"] for frame in frames])
            for name in (*STATE, *COORDINATES, "time", "step"):
                rows[f"frames/{name}"] = np.array([frame[name] for frame in frames])
        if reports:
            rows["reports"] = reports_array(reports).astype(storable(REPORTS))
        self._file.append({name: values for name, values in rows.items() if len(values)})
        self._contact_rows += sum(map(len, tables))


def _finish(background: Background[_Item], file: GrowingFile) -> None:
    if background.ours:
        try:
            background.close()
        finally:
            file.close()


def storable(dtype: np.dtype[Any]) -> np.dtype[Any]:
    """The same record with strings of bytes, which HDF5 has, in place of those of NumPy."""
    names = dtype.names or ()
    return np.dtype([(n, f"S{dtype[n].itemsize // 4}" if dtype[n].kind == "U" else dtype[n]) for n in names])
