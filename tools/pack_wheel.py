"""A wheel for another system: one made here, with another module in it, its bill and other tags."""

from __future__ import annotations

import base64
import hashlib
import json
import zipfile
from pathlib import Path

import make_sbom
from wheel_targets import Target, tag

MODULE, UNIT = "amontons/_core.", "amontons/amontons_fmu."
SYSTEMS = {"linux": "Linux", "macos": "Darwin", "windows": "Windows"}
"""as CMake calls them"""


def pack(
    base: Path, module: bytes, unit: bytes, target: Target, python: str, folder: Path, compiler: str
) -> Path:
    """The wheel of `base`, its module replaced, for "abi3" or "cp311" on a target; its path in a folder.

    `unit` is the library of functional mock-up units, which is replaced too.

    `compiler` is the name and version of the one that compiled the module, for the bill of materials.
    The same input gives the same bytes: entries have the dates and the order of the base.
    """
    name, version = base.name.split("-")[:2]
    path = folder / f"{name}-{version}-{tag(target, python)}.whl"
    info = f"{name}-{version}.dist-info"
    rows = []
    with (
        zipfile.ZipFile(base) as old,
        zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as new,
    ):
        for entry in old.infolist():
            if entry.filename == f"{info}/RECORD":
                continue
            data = old.read(entry)
            made = zipfile.ZipInfo(entry.filename, entry.date_time)
            made.external_attr = entry.external_attr
            if entry.filename.startswith(UNIT):
                made.filename = f"amontons/{target.unit}"
                data = unit
            elif entry.filename.startswith(MODULE) and entry.filename.endswith((".so", ".pyd")):
                made.filename = f"amontons/{target.module(python)}"
                data = module
            elif entry.filename == f"{info}/WHEEL":
                data = _tagged(data.decode(), tag(target, python)).encode()
            elif entry.filename.endswith(".cdx.json"):
                data = _bill(data, module, target, compiler)
            rows.append(f"{made.filename},sha256={_digest(data)},{len(data)}")
            _add(new, made, data)
        record = zipfile.ZipInfo(f"{info}/RECORD", old.infolist()[0].date_time)
        record.external_attr = 0o644 << 16
        _add(new, record, "\n".join([*rows, f"{info}/RECORD,,", ""]).encode())
    return path


def _add(wheel: zipfile.ZipFile, entry: zipfile.ZipInfo, data: bytes) -> None:
    entry.compress_type = zipfile.ZIP_DEFLATED
    entry.create_system = 3  # modes are those of Unix
    wheel.writestr(entry, data, compresslevel=9)


def _bill(data: bytes, module: bytes, target: Target, compiler: str) -> bytes:
    """The bill of materials of the base, with what the other compiler adds."""
    made = make_sbom.with_other_module(json.loads(data), module, "libc++", compiler, SYSTEMS[target.system])
    return (json.dumps(made, indent=2) + "\n").encode()


def _tagged(text: str, tags: str) -> str:
    """The file WHEEL with these tags."""
    lines = [line for line in text.splitlines() if line and not line.startswith("Tag:")]
    return "\n".join([*lines, f"Tag: {tags}", ""])


def _digest(data: bytes) -> str:
    return base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()
