"""Damage to NumPy archives: to arrays, to the headers of arrays, to the directory of the archive."""

from __future__ import annotations

import io
import zipfile
from pathlib import Path

import numpy as np

from . import arrays
from .raw import BINARY, Rng, damage, pick

DESCRIPTIONS = [
    "<f8", ">f8", "|O", "<U3", "|S3", "<i4", "<M8[s]", "|V8", "<c16", "|b1", "<f16", "<U999999999", "f8,i4",
]  # fmt: skip
SHAPES = [
    "()", "(1,)", "(3,)", "(0,)", "(-1,)", "(10**9,)", "(1000000000,)", "(99999999999999999999,)", "(3, 3)",
    "(2147483648, 2147483648, 2147483648)", "(3.0,)", "(True,)", "('3',)", "3", "(1, 1, 1, 1, 1, 1, 1, 1)",
]  # fmt: skip


def members(path: Path) -> dict[str, bytes]:
    with zipfile.ZipFile(path) as file:
        return {info.filename: file.read(info) for info in file.infolist()}


def write(path: Path, found: dict[str, bytes], method: int = zipfile.ZIP_DEFLATED) -> None:
    with zipfile.ZipFile(path, "w", method) as file:
        for name, data in found.items():
            file.writestr(name, data)


def damage_arrays(rng: Rng, path: Path) -> None:
    """One array of the archive changes, is missing, or is there under another name."""
    found = members(path)
    name = str(pick(rng, list(found)))
    array = np.load(io.BytesIO(found[name]), allow_pickle=False)
    match int(rng.integers(8)):
        case 0:
            del found[name]
        case 1:
            found[str(pick(rng, list(found)))] = found[name]
        case _:
            buffer = io.BytesIO()
            np.save(buffer, arrays.other(rng, array))
            found[name] = buffer.getvalue()
    write(path, found)


def damage_header(rng: Rng, path: Path) -> None:
    """The header of one array declares something else, or is damaged."""
    found = members(path)
    name = str(pick(rng, list(found)))
    data = found[name]
    body = data[10 + int.from_bytes(data[8:10], "little") :]
    order = pick(rng, ["True", "False", "1", "None"])
    header = (
        f"{{'descr': '{pick(rng, DESCRIPTIONS)}', 'fortran_order': {order}, 'shape': {pick(rng, SHAPES)}, }}"
    )
    odd = ["-" * 9000 + "1", "(" * 9000, "{" * 80, "[" * 3000 + "]" * 3000, "__import__('os')", "1" * 9000]
    if rng.random() < 0.2:
        header = str(pick(rng, odd))
    text = header.encode() + b"\n"
    version = pick(rng, [b"\x01\x00", b"\x01\x00", b"\x01\x00", b"\x02\x00", b"\x03\x00", b"\x09\x00"])
    length = len(text).to_bytes(2 if version == b"\x01\x00" else 4, "little")
    if rng.random() < 0.1:
        length = b"\xff" * len(length)
    found[name] = b"\x93NUMPY" + version + length + text + body
    if rng.random() < 0.1:
        found[name] = damage(rng, data, BINARY)
    write(path, found)


def damage_zip(rng: Rng, path: Path) -> None:
    """What only an archive can have wrong: doubled names, bombs, other methods, sizes that are forged."""
    found = members(path)
    name = str(pick(rng, list(found)))
    match int(rng.integers(6)):
        case 0:  # far more than the file is large
            zeros = np.zeros(int(pick(rng, [10**6, 10**7])))
            buffer = io.BytesIO()
            np.save(buffer, zeros)
            found[name] = buffer.getvalue()
            write(path, found)
        case 1:
            write(path, found, int(pick(rng, [zipfile.ZIP_STORED, zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA])))
        case 2:
            write(path, {**found, **{f"x{k}.npy": b"" for k in range(3000)}})
        case 3:
            write(path, {f"{'a/' * int(rng.integers(1, 40))}{n}": d for n, d in found.items()})
        case 4:
            with zipfile.ZipFile(path, "a") as file:
                file.writestr(name, found[name])
        case 5:
            data = bytearray(path.read_bytes())
            at = [k for k in range(len(data) - 4) if data[k : k + 4] in (b"PK\x01\x02", b"PK\x03\x04")]
            start = int(pick(rng, at)) + int(rng.integers(4, 46))
            data[start : start + 4] = pick(rng, [b"\xff" * 4, b"\0" * 4, rng.bytes(4)])
            path.write_bytes(data)
