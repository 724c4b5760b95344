"""Functional mock-up units: a simulation as a file that other programs run, without Python."""

from __future__ import annotations

import hashlib
import io
import json
import platform
import re
import sys
import warnings
import zipfile
from collections.abc import Iterable, Sequence
from dataclasses import replace
from os import PathLike
from pathlib import Path
from typing import Any

from ... import _core
from ...checks import chosen
from ...errors import FileError, InputError, UnsupportedWarning
from ...model.model import Model
from ...simulation.simulation import Simulation
from ..files import writable, write_whole
from ..recordings.model_json import model_to_json
from .description import description
from .sensors import Sensors, left_out
from .variables import Frames, Variable, chosen_variables, input_variables, output_variables

VERSIONS = {"2.0": None, "3.0": None}
LIBRARY = "amontons_fmu"
"""The file with the C functions, beside the module amontons._core, but for its suffix."""
FOLDERS = {
    ("linux", "x86_64"): ("linux64", "x86_64-linux", ".so"),
    ("linux", "aarch64"): ("", "aarch64-linux", ".so"),
    ("macosx", "x86_64"): ("darwin64", "x86_64-darwin", ".dylib"),
    ("macosx", "arm64"): ("", "aarch64-darwin", ".dylib"),
    ("win", "amd64"): ("win64", "x86_64-windows", ".dll"),
}
"""By system and processor: the folder of binaries for FMI 2.0, empty where it names none, for 3.0, and the
suffix."""
START = (
    "positions",
    "orientations",
    "linear_velocities",
    "angular_velocities",
    "forces",
    "torques",
    "joint_coordinates",
    "joint_forces",
    "controls",
    "activations",
)


def write_fmu(
    simulation: Simulation,
    path: str | PathLike[str],
    *,
    inputs: Iterable[str] | None = None,
    outputs: Iterable[str] | None = None,
    fmi: str = "3.0",
    wheels: Sequence[str | PathLike[str]] = (),
) -> None:
    """Write a simulation as a functional mock-up unit (.fmu) for co-simulation by FMI 2.0 or 3.0.

    The unit has the model, the options and the present poses, speeds, loads and controls of the simulation,
    and the compiled library, so that it needs no Python. It begins there, with the impulses of no step, and
    makes the steps of `dt` that `run` makes, bit for bit; communication steps are multiples of `dt`.

    inputs, outputs: names of variables, or patterns with *: docs/fmu.md lists them. By default all controls;
    all coordinates with their velocities, sensors, and the counters. An UnsupportedWarning names the sensors
        of other kinds than those of docs/fmu.md.
    wheels: wheels of amontons for other systems, whose library the unit takes in beside that of this one.

    Raises InputError naming the variable or option, and FileError.

    >>> write_fmu(Simulation(scenes.make("pendulum")), "pendulum.fmu")
    """
    chosen("fmi", fmi, VERSIONS)
    path = writable(path)
    if path.suffix.lower() != ".fmu":
        raise FileError(f"{path}: unknown kind of file; units are written to .fmu")
    for name, given in (("inputs", inputs), ("outputs", outputs)):
        if isinstance(given, str):
            raise InputError(f"{name}: give a list of names, as in [{given!r}]")
    frames = Frames()
    variables = [Variable("time", "time", 0, 0, "independent", "s")]
    variables += chosen_variables(list(input_variables(simulation)), inputs, ("control.*",), "inputs")
    usual = ("q.*", "qd.*", "sensor.*", "contacts*", "steps.*")
    variables += chosen_variables(list(output_variables(simulation.model, frames)), outputs, usual, "outputs")
    _require_unique(variables)
    without = [s.name for s in simulation.model.sensors if left_out(s)] if outputs is None else []
    if without:
        told = (
            f"{path.name}: a unit does not read the sensors {', '.join(without)}, which sum over links that "
            "are parts of bodies"
        )
        warnings.warn(told, UnsupportedWarning, stacklevel=2)
    sensors = Sensors()
    variables = _numbered(variables, sensors, simulation.model)
    identifier = re.sub(r"\W", "_", path.stem, flags=re.ASCII)
    identifier = identifier if identifier[:1].isalpha() else f"unit_{identifier}"
    model, unit = model_to_json(simulation.model), json.dumps(_unit(simulation, variables, frames, sensors))
    token = hashlib.sha256((model + unit).encode()).hexdigest()[:32]
    entries = {
        "modelDescription.xml": description(
            variables, fmi=fmi, name=path.stem, identifier=identifier, token=f"{{{token}}}",
            dt=simulation.dt, tool="amontons",
        ),
        "resources/model.json": model.encode(),
        "resources/fmu.json": unit.encode(),
    }  # fmt: skip
    for place, library in _libraries(wheels):
        two, three, suffix = FOLDERS[place]
        if fmi == "2.0" and not two:
            raise InputError(f'FMI 2.0 has no name for {three}; give fmi="3.0"')
        entries[f"binaries/{two if fmi == '2.0' else three}/{identifier}{suffix}"] = library
    write_whole({path: _zipped(entries)})


def _require_unique(variables: Sequence[Variable]) -> None:
    seen: set[str] = set()
    for variable in variables:
        if variable.name in seen:
            raise InputError(f"two variables have the name {variable.name!r}; name the parts of the model")
        seen.add(variable.name)


def _numbered(variables: Sequence[Variable], sensors: Sensors, model: Model) -> list[Variable]:
    """The same with the places of sensors in the unit, which has those that are chosen."""
    places = {i: -1 for i in sorted({v.index for v in variables if v.kind == "sensor"})}
    for i in places:
        places[i] = sensors.add(model, model.sensors[i])
    return [replace(v, index=places[v.index]) if v.kind == "sensor" else v for v in variables]


def _unit(
    simulation: Simulation, variables: Sequence[Variable], frames: Frames, sensors: Sensors
) -> dict[str, Any]:
    """The file beside the model, for the library (fmu/instance.cpp)."""
    state = simulation.state
    return {
        "version": 1,
        "options": _options(simulation),
        "start": {name: getattr(state, name).tolist() for name in START},
        "frames": frames.plain(),
        "variables": [[v.kind, v.index, v.part] for v in variables],
        **sensors.plain(),
    }


def _options(simulation: Simulation) -> dict[str, Any]:
    given = dict(simulation.options)
    if callable(given["method"]) or given["device"] != "cpu" or given["budget"] is not None:
        raise InputError(
            "a unit has no device, no budget and no method of Python; drop device= and budget=, name a method"
        )
    for name in ("device", "device_contacts", "budget", "on_failure"):
        given.pop(name)
    return {name: value for name, value in given.items() if value is not None}


def _libraries(wheels: Sequence[str | PathLike[str]]) -> Iterable[tuple[tuple[str, str], bytes]]:
    """The library of this system, and those of wheels, with their places in FOLDERS."""
    system = {"linux": "linux", "darwin": "macosx", "win32": "win"}.get(sys.platform, sys.platform)
    place = (system, platform.machine().lower())
    here = Path(_core.__file__).parent
    files = [here / f"{LIBRARY}{suffix}" for suffix in (".so", ".dll", ".dylib")]
    library = next((file for file in files if file.is_file()), None)
    if library is None or place not in FOLDERS:
        raise FileError(
            f"{here / LIBRARY}: this installation has no library for units, which the wheels for Linux, "
            "macOS and Windows have; reinstall amontons"
        )
    yield place, library.read_bytes()
    for wheel in map(Path, wheels):
        tags = re.search(r"(linux|macosx|win)_(?:\d+_)*(x86_64|aarch64|arm64|amd64)\.whl$", wheel.name)
        try:
            with zipfile.ZipFile(wheel) as archive:
                (name,) = (n for n in archive.namelist() if n.startswith(f"amontons/{LIBRARY}."))
                data = archive.read(name)
        except (OSError, ValueError, zipfile.BadZipFile) as error:
            raise FileError(f"{wheel}: is no wheel of amontons with a library for units ({error})") from None
        if tags is None:
            raise FileError(f"{wheel}: its name says no system that units are for")
        yield (tags[1], tags[2]), data


def _zipped(entries: dict[str, bytes]) -> bytes:
    """The same entries give the same bytes."""
    text = io.BytesIO()
    with zipfile.ZipFile(text, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in entries.items():
            entry = zipfile.ZipInfo(name, (1980, 1, 1, 0, 0, 0))
            entry.external_attr, entry.compress_type = 0o644 << 16, zipfile.ZIP_DEFLATED
            archive.writestr(entry, data)
    return text.getvalue()
