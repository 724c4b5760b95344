"""Tools that make, read and compare what is built for other systems; `make wheels-test` runs the results."""

import base64
import hashlib
import json
import struct
import sys
import zipfile
from pathlib import Path

import amontons
import binaries
import import_library
import inspect_wheel
import pytest
import same_bits
from pack_wheel import pack
from wheel_targets import PYTHONS, TARGETS, tag


def macho(*libraries: bytes, machine: int = 0x0100000C, oldest: int = 12 << 16, signed: bool = True) -> bytes:
    """A file of load commands alone."""
    commands = [struct.pack("<IIIIII", 0x32, 24, 1, oldest, oldest, 0)]
    for name in libraries:
        text = name + b"\0" * (8 - len(name) % 8)
        commands.append(struct.pack("<IIIIII", 0xC, 24 + len(text), 24, 0, 0, 0) + text)
    if signed:
        commands.append(struct.pack("<IIII", 0x1D, 16, 0, 0))
    body = b"".join(commands)
    head = struct.pack("<IIIIIIII", 0xFEEDFACF, machine, 0, 8, len(commands), len(body), 0, 0)
    return head + body + b"\0_PyInit__core\0"


def pe(*libraries: bytes, machine: int = 0x8664) -> bytes:
    """A file of headers, one section and a table of imports."""
    section = 0x1000
    rows, names = b"", b""
    first = section + 20 * (len(libraries) + 1)
    for name in libraries:
        rows += struct.pack("<IIIII", 0, 0, 0, first + len(names), 0)
        names += name + b"\0"
    data = rows + b"\0" * 20 + names + b"PyInit__core\0"
    optional = bytearray(240)
    struct.pack_into("<H", optional, 0, 0x20B)
    struct.pack_into("<III", optional, 108, 16, 0, 0)
    struct.pack_into("<II", optional, 112 + 8, section, len(data))
    head = bytearray(b"MZ" + b"\0" * 62)
    struct.pack_into("<I", head, 0x3C, 64)
    head += b"PE\0\0" + struct.pack("<HHIIIHH", machine, 1, 0, 0, 0, len(optional), 0) + optional
    place = len(head) + 40
    return (
        bytes(head)
        + struct.pack("<8sIIIIIIHHI", b".rdata", len(data), section, len(data), place, 0, 0, 0, 0, 0)
        + data
    )


def faults(data: bytes, name: str, python: str = "abi3") -> str:
    return "; ".join(inspect_wheel.module_faults(data, TARGETS[name], python))


# Fails if the readers lose a library, the machine or the oldest system: a wheel would be named wrongly.
def test_binaries_are_read():
    own = binaries.read(Path(amontons._core.__file__).read_bytes())
    assert own.system == sys.platform
    assert any(name.startswith("libc.so") for name in own.libraries)
    assert own.oldest.startswith("2.")
    mac = binaries.read(macho(b"/usr/lib/libSystem.B.dylib", b"@rpath/libomp.dylib"))
    assert (mac.system, mac.machine, mac.oldest, mac.signed) == ("macos", "aarch64", "12.0", True)
    assert mac.libraries == ["/usr/lib/libSystem.B.dylib", "@rpath/libomp.dylib"]
    windows = binaries.read(pe(b"KERNEL32.dll", b"python3.dll"))
    assert (windows.system, windows.machine) == ("windows", "x86_64")
    assert windows.libraries == ["KERNEL32.dll", "python3.dll"]
    with pytest.raises(ValueError, match="no ELF"):
        binaries.read(b"\x7fELF\x01")


# Fails if one of the faults that keeps a module from loading elsewhere passes.
def test_faults_of_modules():
    good = b"/usr/lib/libSystem.B.dylib"
    assert faults(macho(good), "macos-arm64") == ""
    assert "for macos on aarch64" in faults(macho(good), "macos-x86_64")
    assert "loads /opt/homebrew/lib/libomp.dylib" in faults(
        macho(good, b"/opt/homebrew/lib/libomp.dylib"), "macos-arm64"
    )
    assert "macOS 14.0, newer than 12.0" in faults(macho(good, oldest=14 << 16), "macos-arm64")
    assert "no signature" in faults(macho(good, signed=False), "macos-arm64")
    assert faults(pe(b"KERNEL32.dll", b"python3.dll"), "windows-x86_64") == ""
    assert "does not load python311.dll" in faults(pe(b"python3.dll"), "windows-x86_64", "cp311")
    assert "loads libstdc++-6.dll" in faults(pe(b"python3.dll", b"libstdc++-6.dll"), "windows-x86_64")
    built = pe(b"python3.dll") + b"/home/somebody/amontons/src/base/isa.cpp\0"
    assert "names /home/somebody/amontons/src/base/isa.cpp" in faults(built, "windows-x86_64")
    assert "is no ELF" in faults(b"text", "linux-x86_64")


BILL = {
    "metadata": {"component": {"bom-ref": "amontons"}},
    "components": [{"name": "eigen", "bom-ref": "eigen"}, {"name": "libstdc++", "bom-ref": "libstdc++"}],
}


def base_wheel(folder: Path) -> Path:
    """A wheel as scikit-build-core makes them, with one text and one module."""
    path = folder / "amontons-1.2.3-cp312-abi3-linux_x86_64.whl"
    info = "amontons-1.2.3.dist-info"
    files = {
        "amontons/__init__.py": b"",
        "amontons/_core.abi3.so": b"module",
        "amontons/amontons_fmu.so": b"library",
        f"{info}/METADATA": b"Name: amontons\n",
        f"{info}/sboms/amontons.cdx.json": json.dumps(BILL).encode(),
        f"{info}/WHEEL": b"Wheel-Version: 1.0\nRoot-Is-Purelib: false\nTag: cp312-abi3-linux_x86_64\n\n",
    }
    with zipfile.ZipFile(path, "w") as wheel:
        for name, data in files.items():
            wheel.writestr(name, data)
        wheel.writestr(f"{info}/RECORD", "")
    return path


# Fails if a wheel has other tags within than in its name, a wrong RECORD, the bill of materials of the wheel
# made here, or other bytes the second time.
@pytest.mark.parametrize("python", sorted(PYTHONS))
@pytest.mark.parametrize("name", sorted(TARGETS))
def test_wheels_are_packed(tmp_path, name, python):
    target = TARGETS[name]
    machine = 0x01000007 if target.machine == "x86_64" else 0x0100000C
    modules = {
        "linux": Path(amontons._core.__file__).read_bytes(),
        "macos": macho(b"/usr/lib/libSystem.B.dylib", machine=machine),
        "windows": pe(b"python3.dll" if python == "abi3" else b"python311.dll"),
    }
    base, module = base_wheel(tmp_path), modules[target.system]
    unit = modules[target.system]
    made = pack(base, module, unit, target, python, tmp_path, "Clang 22.1.8")
    assert made.name == f"amontons-1.2.3-{tag(target, python)}.whl"
    before = made.read_bytes()
    assert pack(base, module, unit, target, python, tmp_path, "Clang 22.1.8").read_bytes() == before
    found = list(inspect_wheel.faults(made))
    if target.system != "linux":  # our own module links against libstdc++ and names the folder of the build
        assert found == []
    assert not any("RECORD" in fault or "tags" in fault or "modules" in fault for fault in found)
    with zipfile.ZipFile(made) as wheel:
        assert wheel.read(f"amontons/{target.module(python)}") == module
        assert wheel.read(f"amontons/{target.unit}") == unit
        bill = json.loads(wheel.read("amontons-1.2.3.dist-info/sboms/amontons.cdx.json"))
    parts = [part["name"] for part in bill["components"]]
    assert parts == ["eigen", "libc++", "mingw-w64"][: 3 if target.system == "windows" else 2]
    assert bill["metadata"]["properties"][0]["value"] == "Clang 22.1.8"


# Fails if a file that was changed after packing passes.
def test_changed_wheels_are_found(tmp_path):
    module, target = pe(b"python3.dll"), TARGETS["windows-x86_64"]
    made = pack(base_wheel(tmp_path), module, module, target, "abi3", tmp_path, "Clang 22.1.8")
    with zipfile.ZipFile(made) as old:
        entries = {name: old.read(name) for name in old.namelist()}
    entries["amontons/__init__.py"] = b"import os"
    with zipfile.ZipFile(made, "w") as new:
        for name, data in entries.items():
            new.writestr(name, data)
    assert [f for f in inspect_wheel.faults(made) if "another hash" in f]
    other = made.rename(tmp_path / "amontons-1.2.3-cp312-abi3-linux_riscv64.whl")
    assert "none of the table" in next(iter(inspect_wheel.faults(other)))
    digest = base64.urlsafe_b64encode(hashlib.sha256(b"").digest()).rstrip(b"=").decode()
    assert digest in entries["amontons-1.2.3.dist-info/RECORD"].decode()


# Fails if a function or a variable of Python's headers is not in the import library, or one as the other.
def test_names_of_python(tmp_path):
    (tmp_path / "cpython").mkdir()
    (tmp_path / "object.h").write_text(
        "PyAPI_FUNC(PyObject *) PyObject_Call(PyObject *callable);\nPyAPI_DATA(PyTypeObject) PyType_Type;\n"
        "PyAPI_FUNC(int)\nPyType_Ready(PyTypeObject *);\n"
    )
    (tmp_path / "cpython" / "more.h").write_text("PyAPI_DATA(PyObject *) PyExc_ValueError;\n")
    functions, data = import_library.declared(tmp_path)
    assert functions == ["PyObject_Call", "PyType_Ready"]
    assert data == ["PyExc_ValueError", "PyType_Type"]
    text = import_library.definition("python3", functions, data)
    assert text.startswith("LIBRARY python3.dll\nEXPORTS\n")
    assert "PyType_Type DATA\n" in text
    assert "\nPyObject_Call\n" in text
    text = import_library.forwarding("python3", "python312", functions, data)
    assert "\nPyObject_Call = python312.PyObject_Call\n" in text
    assert "\nPyType_Type = python312.PyType_Type DATA\n" in text


# Fails if two systems that differ in one scene pass, or one that lacks a scene.
def test_bits_are_compared(tmp_path):
    one, two, three = (tmp_path / f"{name}.txt" for name in ("one", "two", "three"))
    one.write_text("wall coulomb 1 avx2 00aa\nwall coulomb 3 avx2 00aa\nchain coulomb 1 avx2 00bb\n")
    two.write_text("wall coulomb 1 baseline 00aa\nchain coulomb 1 baseline 00bb\n")
    three.write_text("wall coulomb 1 baseline 00aa\nwall coulomb 3 baseline 00ab\n")
    lines, same = same_bits.table(same_bits.columns([one, two]))
    assert same
    assert lines[0] == "| Scene | Law | one, avx2 | two, baseline |"
    rows = same_bits.summary(same_bits.columns([one, two, three]))
    assert rows[2:] == [
        "| one | avx2 | 2 | yes |", "| two | baseline | 2 | yes |", "| three | baseline | 1 | **no** |",
    ]  # fmt: skip
    lines, same = same_bits.table(same_bits.columns([one, three]))
    assert not same
    assert "differs" in lines[-1]
    assert "missing" in "".join(lines)
