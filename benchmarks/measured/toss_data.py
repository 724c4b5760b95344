"""The tosses of a real cube, as they were measured.

Data: dair_pll (ContactNets), archives of torch with one tensor (n, 13) of float64 each.
"""

from __future__ import annotations

import pickle
import zipfile
from collections import OrderedDict
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import amontons
import numpy as np
from scipy.spatial.transform import Rotation

Array = np.ndarray[Any, Any]
EDGE, MASS, INERTIA = 0.1048, 0.37, 8.1e-4  # m, kg, kg m^2
RATE = 148.0
"""Samples per second (Hz)."""
GIVEN = (0.18, 0.125)
"""Friction and restitution that the data come with."""


@dataclass(frozen=True)
class Toss:
    """One toss: rows of quaternion (w, x, y, z), position (m), angular velocity (rad/s, body axes), velocity
    (m/s)."""

    name: str
    rows: Array

    def scaled(self, by: float) -> Toss:
        rows = self.rows.copy()
        rows[:, 4:7] *= by
        rows[:, 10:13] *= by
        return replace(self, rows=rows)


class _TensorReader(pickle.Unpickler):
    """Reads the description of one tensor and nothing else: (storage, offset, shape, strides)."""

    def find_class(self, module: str, name: str) -> Any:
        if (module, name) == ("torch._utils", "_rebuild_tensor_v2"):
            return lambda storage, offset, shape, strides, *_: (storage, offset, shape, strides)
        if (module, name) == ("torch", "DoubleStorage"):
            return np.float64
        if (module, name) == ("collections", "OrderedDict"):
            return OrderedDict
        raise amontons.FileError(f"{module}.{name} is no part of a tensor of float64")

    def persistent_load(self, pid: Any) -> Any:
        return pid[2]  # ("storage", type, key, device, size)


def read_tensor(path: Path) -> Array:
    """The array of a torch archive that holds one tensor of float64."""
    with zipfile.ZipFile(path) as archive:
        (description,) = [name for name in archive.namelist() if name.endswith("/data.pkl")]
        with archive.open(description) as file:
            key, offset, shape, strides = _TensorReader(file).load()
        data = np.frombuffer(archive.read(f"{description[:-4]}/{key}"), np.float64)
    steps = [8 * s for s in strides]
    return np.lib.stride_tricks.as_strided(data[offset:], shape, steps, writeable=False).copy()


def read_tosses(folder: Path) -> list[Toss]:
    paths = sorted(folder.glob("*.pt"), key=lambda p: (len(p.stem), p.stem))
    return [Toss(path.stem, read_tensor(path)) for path in paths]


def world_spin(row: Array) -> Array:
    """The angular velocity of a row in world axes (rad/s)."""
    spin: Array = Rotation.from_quat(row[[1, 2, 3, 0]]).apply(row[7:10])
    return spin


def add_cube(builder: amontons.ModelBuilder, name: str, row: Array, along: float = 0.0) -> int:
    """The cube without its shape at a row of a toss, moved along x."""
    return builder.add_body(
        name, mass=MASS, inertia=(INERTIA,) * 3, position=tuple(row[4:7] + (along, 0.0, 0.0)),
        orientation=tuple(row[:4] / np.linalg.norm(row[:4])), linear_velocity=tuple(row[10:13]),
        angular_velocity=tuple(world_spin(row)),
    )  # fmt: skip
