"""Simulations in HDF5 files, from which they continue bit for bit.

/format "amontons-simulation", /version; /model: the model as JSON (Python writes and reads floats exactly);
/options: the options of the simulation as JSON; /state: every array of the state by name, with what the warm
start needs, and a checksum of the model, which tells the state of another one of equal shape.
"""

from __future__ import annotations

import hashlib
import inspect
import json
from os import PathLike
from typing import Any

import numpy as np

from ... import _core
from ...checks import shown, suggestion
from ...errors import InputError
from ...limits import DEFAULT
from ...model.model import Model
from ...simulation.own_method import name_of
from ...simulation.simulation import Simulation
from ..files import existing, writable, write_whole
from ..hdf5 import Reader, hdf5_image, open_hdf5, write_integer, write_text
from .model_json import model_from_json, model_to_json

FORMAT = "amontons-simulation"
VERSION = 1
_SCALARS = ("time", "steps", "impulse_step", "last_step")
_MISSING = {"last_step": 0.0}
"""In files of old versions: the next step begins with the velocities that they have."""
DIGEST = "model_sha256"
"""The dataset that says of which model a state is."""
LATEST = 1e15
"""Upper bound of a time (s) and of a number of steps."""


def save(simulation: Simulation, path: str | PathLike[str]) -> None:
    """See `Simulation.save`."""
    path = writable(path)
    with hdf5_image() as (file, image):
        write_text(file, "format", FORMAT)
        write_integer(file, "version", VERSION)
        write_text(file, "model", model_to_json(simulation.model))
        options = dict(simulation.options)
        if callable(options["method"]):  # not by its name, which a known method may have
            options["method"] = {"function": name_of(options["method"])}
        write_text(file, "options", json.dumps(options))
        group = file.create_group("state")
        for name, values in simulation._core.snapshot().arrays.items():
            group.create_dataset(name, data=values)
        group.create_dataset(DIGEST, data=_digest(simulation.model))
    write_whole({path: image()})


def load(path: str | PathLike[str], changes: dict[str, Any]) -> Simulation:
    """See `Simulation.load`."""
    limits = changes.pop("limits", DEFAULT)
    path = existing(path, "a file that Simulation.save wrote")
    with open_hdf5(path, "one that Simulation.save wrote") as file:
        reader = Reader(path, file, limits)
        _require_format(reader)
        model = reader.parsed("model", model_from_json)
        options = reader.parsed("options", json.loads)
        if not isinstance(options, dict):
            raise reader.fail("/options must hold names and values")
        with reader.meaning("/model"):
            core = model.core
        state = _state(reader.sub("state"), core, _digest(model))
    unknown = set(changes) - set(inspect.signature(Simulation).parameters)
    if unknown:
        raise InputError(
            f"unknown option {min(unknown)!r} of a simulation{suggestion(min(unknown), options)}; "
            f"known are {', '.join(sorted(options))}"
        )
    kept = {name: value for name, value in options.items() if name not in changes}
    if isinstance(kept.get("method"), dict):
        function = shown(kept["method"].get("function"))
        raise reader.fail(
            f"its method is the function {function}, which a file cannot hold; load it with method="
        )
    if not set(kept) <= set(inspect.signature(Simulation).parameters) - {"model"}:
        raise reader.fail("/options has an option that this version does not know")
    try:
        simulation = Simulation(model, **kept, **changes)
    except InputError as error:
        if any(name in str(error) for name in changes):
            raise
        raise reader.fail(f"/options: {error}") from None
    with reader.meaning("/state"):
        simulation._core.restore(state)
    return simulation


def _require_format(reader: Reader) -> None:
    if reader.text("format") != FORMAT:
        remedy = "read it with amontons.vi.read_problem" if _is_problem(reader) else "it holds something else"
        raise reader.fail(f"is not a file that Simulation.save wrote; {remedy}")
    reader.require_version(VERSION)


def _is_problem(reader: Reader) -> bool:
    return reader.has("fclib_local") or reader.has("fclib_global")


def _digest(model: Model) -> np.ndarray[Any, Any]:
    """SHA-256 of a model as JSON, a number per byte, which old versions pass over like any array.

    The checksum is that of the model and not of a text, in which default values can be missing.
    """
    text = model_to_json(model).encode("utf-8", "backslashreplace")
    return np.frombuffer(hashlib.sha256(text).digest(), np.uint8).astype(np.float64)


def _state(reader: Reader, model: _core.Model, digest: np.ndarray[Any, Any]) -> _core.State:
    """Every array of the state that this version knows, of the size that the model asks for."""
    if reader.has(DIGEST) and not np.array_equal(reader.array(DIGEST, "f"), digest):  # of 0.1.0 there is none
        raise reader.fail(
            "/state is that of another model than /model: its checksum is another one. The file was changed, "
            "or an older version whose models have other fields wrote it; save it again"
        )
    scalars = {}
    for name in _SCALARS:
        values = np.array(_MISSING[name]) if name in _MISSING and not reader.has(name) else reader.array(name)
        if values.shape != () or not values >= 0 or not np.isfinite(values) or values > LATEST:
            raise reader.fail(f"{reader.name(name)} must be one number from 0 to {LATEST:g}")
        if name == "steps" and values != int(values):
            raise reader.fail(f"{reader.name(name)} is {values}; it must be a whole number of steps")
        scalars[name] = int(values) if name == "steps" else float(values)
    arrays = {}
    for name in reader.names():
        if name not in (*_SCALARS, DIGEST):
            arrays[name] = reader.finite(name, reader.array(name, "f"))
    with reader.meaning("/state"):
        return _core.State(model, arrays=arrays, **scalars)
