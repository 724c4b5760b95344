"""Damage to HDF5 files by way of the library: objects that are other ones, links that lead elsewhere."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np

from . import arrays
from .raw import Rng, pick


def names(file: h5py.File) -> list[str]:
    found: list[str] = []
    file.visit(found.append)
    return found


def damage(rng: Rng, path: Path) -> None:
    """Change one object of the file."""
    with h5py.File(path, "a") as file:
        listed = names(file)
        name = str(pick(rng, listed)) if listed else "fclib_local"
        datasets = [n for n in listed if isinstance(file.get(n), h5py.Dataset)]
        if datasets and rng.random() < 0.7:
            name = str(pick(rng, datasets))
        kinds = [values, values, values, values, missing, group, link, stored, typed, virtual, attribute]
        pick(rng, kinds)(rng, file, name)


def _read(file: h5py.File, name: str) -> np.ndarray:
    item = file.get(name)
    if isinstance(item, h5py.Dataset):
        try:
            read = np.asarray(item[()])
            return read if read.dtype.kind in "iufSU" else np.zeros(3)
        except (OSError, RuntimeError, TypeError, ValueError, MemoryError):
            pass
    return np.zeros(3)


def _put(file: h5py.File, name: str, **what: object) -> None:
    if name in file:
        del file[name]
    file.create_dataset(name, **what)


def values(rng: Rng, file: h5py.File, name: str) -> None:
    changed = arrays.other(rng, _read(file, name))
    if changed.dtype.kind == "U":
        changed = np.char.encode(changed, "utf-8") if changed.size else np.zeros(changed.shape, "S1")
    if changed.dtype.kind != "M":
        _put(file, name, data=changed)


def missing(rng: Rng, file: h5py.File, name: str) -> None:
    if name in file:
        del file[name]


def group(rng: Rng, file: h5py.File, name: str) -> None:
    """A group where a dataset was, a dataset where a group was."""
    was_group = isinstance(file.get(name), h5py.Group)
    missing(rng, file, name)
    if was_group:
        file[name] = np.ones(3)
    else:
        file.create_group(name)


def link(rng: Rng, file: h5py.File, name: str) -> None:
    targets = [
        h5py.SoftLink("/" + str(pick(rng, [*names(file), "nowhere", name]))),
        h5py.SoftLink(f"/{name}"),
        h5py.ExternalLink("other.h5", "/x"),
        h5py.ExternalLink(Path(file.filename).name, "/"),
        h5py.ExternalLink("/dev/zero", "/"),
    ]
    missing(rng, file, name)
    file[name] = pick(rng, targets)


def stored(rng: Rng, file: h5py.File, name: str) -> None:
    """The same, or far more of it, stored in another way."""
    old = _read(file, name)
    if old.dtype.kind not in "iuf":
        old = np.zeros(3)
    most = [10**6, 10**8, 10**10, 2**40, 2**62]
    match int(rng.integers(6)):
        case 0:  # declared and never written
            _put(file, name, shape=(pick(rng, most),), dtype=old.dtype, chunks=(1024,))
        case 1:
            _put(file, name, shape=(pick(rng, most),), dtype=old.dtype, chunks=(65536,), compression="gzip")
        case 2:  # one chunk of gigabytes that is all zeros
            _put(file, name, data=np.zeros(3 * 10**6), chunks=(10**6,), compression="gzip")
        case 3:
            _put(file, name, data=np.atleast_1d(old), chunks=True, compression="lzf", shuffle=True)
        case 4:
            _put(file, name, shape=(3, pick(rng, most[:3])), dtype=old.dtype, chunks=(1, 64), fillvalue=1)
        case 5:
            space = h5py.h5s.create_simple((int(pick(rng, most[:3])),))
            properties = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
            properties.set_external(b"/dev/zero", 0, h5py.h5f.UNLIMITED)
            missing(rng, file, name)
            h5py.h5d.create(file.id, name.encode(), h5py.h5t.NATIVE_DOUBLE, space, properties)


def typed(rng: Rng, file: h5py.File, name: str) -> None:
    """Of a type that the reader does not expect."""
    kinds = [
        h5py.string_dtype(), h5py.string_dtype("ascii", 8), h5py.vlen_dtype(np.float64), h5py.ref_dtype,
        h5py.enum_dtype({"A": 1, "B": 2}), np.dtype([("a", "f8"), ("b", "i4", (3,))]), np.dtype("V16"),
        np.dtype("c16"), np.dtype("f2"), np.dtype("?"), np.dtype(("f8", (3,))), h5py.regionref_dtype,
    ]  # fmt: skip
    _put(file, name, shape=pick(rng, [(), (0,), (1,), (3,), (2, 3)]), dtype=pick(rng, kinds))
    if rng.random() < 0.3:
        missing(rng, file, name)
        file.create_dataset(name, data=h5py.Empty("f8"))


def virtual(rng: Rng, file: h5py.File, name: str) -> None:
    size = int(pick(rng, [10, 10**6, 10**9, 10**12]))
    layout = h5py.VirtualLayout((size,), dtype="f8")
    layout[: min(size, 10)] = h5py.VirtualSource("other.h5", "x", shape=(min(size, 10),))
    missing(rng, file, name)
    file.create_virtual_dataset(name, layout, fillvalue=0.0)


def attribute(rng: Rng, file: h5py.File, name: str) -> None:
    if name in file:
        file[name].attrs["x"] = arrays.other(rng, np.ones(3)).astype("S3")
