"""Simulations in HDF5 files, from which they continue bit for bit.

/format "amontons-simulation", /version; /model: the model as JSON (Python writes and reads floats exactly);
/options: the options of the simulation as JSON; /state: every array of the state by name, with what the warm
start needs.
"""

from __future__ import annotations

import json
from os import PathLike
from typing import Any

import h5py
import numpy as np

from ... import _core
from ...errors import FileError, InputError
from ...simulation.simulation import Simulation
from ..files import existing, writable, write_whole
from ..hdf5 import Reader, hdf5_image, write_integer, write_text
from .model_json import model_from_json, model_to_json

FORMAT = "amontons-simulation"
VERSION = 1
_SCALARS = ("time", "steps", "impulse_step")


def save(simulation: Simulation, path: str | PathLike[str]) -> None:
    """See `Simulation.save`."""
    path = writable(path)
    with hdf5_image() as (file, image):
        write_text(file, "format", FORMAT)
        write_integer(file, "version", VERSION)
        write_text(file, "model", model_to_json(simulation.model))
        write_text(file, "options", json.dumps(dict(simulation.options)))
        group = file.create_group("state")
        for name, values in simulation._core.snapshot().arrays.items():
            group.create_dataset(name, data=values)
    write_whole({path: image()})


def load(path: str | PathLike[str], changes: dict[str, Any]) -> Simulation:
    """See `Simulation.load`."""
    path = existing(path, "a file that Simulation.save wrote")
    try:
        file = h5py.File(path)
    except OSError:
        raise FileError(f"{path}: is no HDF5 file, or damaged; give one that Simulation.save wrote") from None
    with file:
        reader = Reader(path, file)
        _require_format(reader)
        model = reader.parsed("model", model_from_json)
        options = reader.parsed("options", json.loads)
        if not isinstance(options, dict):
            raise reader.fail("/options must hold names and values")
        state = _state(reader.sub("state"), model.core)
    try:
        simulation = Simulation(model, **{**options, **changes})
    except TypeError:
        unknown = set(changes) - set(options)
        if unknown:
            raise InputError(
                f"unknown option {min(unknown)!r} of a simulation; known are {', '.join(sorted(options))}"
            ) from None
        raise reader.fail("/options has an option that this version does not know") from None
    simulation._core.restore(state)
    return simulation


def _require_format(reader: Reader) -> None:
    if reader.text("format") != FORMAT:
        remedy = "read it with amontons.read_problem" if _is_problem(reader) else "it holds something else"
        raise reader.fail(f"is not a file that Simulation.save wrote; {remedy}")
    reader.require_version(VERSION)


def _is_problem(reader: Reader) -> bool:
    return reader.has("fclib_local") or reader.has("fclib_global")


def _state(reader: Reader, model: _core.Model) -> _core.State:
    scalars = {}
    for name in _SCALARS:
        values = reader.array(name)
        if values.shape != () or values.dtype.kind not in "iuf" or not values >= 0 or not np.isfinite(values):
            raise reader.fail(f"{reader.name(name)} must be one number that is not negative")
        scalars[name] = int(values) if name == "steps" else float(values)
    arrays = {}
    for name in reader.group:
        if name not in _SCALARS:
            values = reader.array(name)
            if values.dtype.kind != "f":
                raise reader.fail(f"{reader.name(name)} must hold real numbers, not {values.dtype}")
            arrays[name] = np.ascontiguousarray(values, dtype=np.float64)
    try:
        return _core.State(model, arrays=arrays, **scalars)
    except InputError as error:
        raise reader.fail(f"/state: {error}") from None
