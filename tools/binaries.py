"""What an extension module says of itself: the three formats of programs, read without their tools.

`read` tells of an ELF, Mach-O or PE file for 64 bits: the machine, the libraries that it loads, the oldest
system that it runs on, and where else it looks for libraries. Formats: System V ABI, chapters 4 and 5, with
the symbol versions of Linux Standard Base; mach-o/loader.h; Microsoft's "PE Format".
"""

from __future__ import annotations

import re
import struct
from collections.abc import Iterator
from dataclasses import dataclass, field

ELF_MACHINES = {62: "x86_64", 183: "aarch64"}
MACHO_MACHINES = {0x01000007: "x86_64", 0x0100000C: "aarch64"}
PE_MACHINES = {0x8664: "x86_64", 0xAA64: "aarch64"}


@dataclass
class Binary:
    """An extension module."""

    system: str
    machine: str
    libraries: list[str] = field(default_factory=list)
    oldest: str = ""
    """newest symbol version of glibc that it asks for, or oldest macOS; empty on Windows"""
    search: list[str] = field(default_factory=list)
    """folders in which it would look for libraries"""
    signed: bool = False
    """macOS: has a signature, without which Apple silicon loads nothing"""


def read(data: bytes) -> Binary:
    """Of the bytes of a file; ValueError if it is none of the three."""
    if data[:5] == b"\x7fELF\x02":
        return _elf(data)
    if data[:4] == b"\xcf\xfa\xed\xfe":
        return _macho(data)
    if data[:2] == b"MZ":
        return _pe(data)
    raise ValueError("is no ELF, Mach-O or PE file for 64 bits")


def _text(data: bytes, at: int) -> str:
    return data[at : data.index(b"\0", at)].decode()


def _elf(data: bytes) -> Binary:
    machine = struct.unpack_from("<H", data, 18)[0]
    binary = Binary("linux", ELF_MACHINES.get(machine, str(machine)))
    first, size, count = *struct.unpack_from("<Q", data, 32), *struct.unpack_from("<HH", data, 54)
    headers = [struct.unpack_from("<IIQQQQQQ", data, first + k * size) for k in range(count)]
    loads = [(h[3], h[2], h[5]) for h in headers if h[0] == 1]  # address, place in the file, length

    def place(address: int) -> int:
        return next(at + address - start for start, at, length in loads if start <= address < start + length)

    (dynamic,) = (h for h in headers if h[0] == 2)
    entries: list[tuple[int, int]] = list(
        struct.iter_unpack("<QQ", data[dynamic[2] : dynamic[2] + dynamic[5]])
    )
    entries = entries[: [tag for tag, _ in entries].index(0)]
    value = dict(entries)
    strings = place(value[5])
    needed, rpath, runpath, versions, how_many = 1, 15, 29, 0x6FFFFFFE, 0x6FFFFFFF
    for tag, offset in entries:
        if tag == needed:
            binary.libraries.append(_text(data, strings + offset))
        if tag in (rpath, runpath):
            binary.search.append(_text(data, strings + offset))
    if versions in value:
        names = _needed_versions(data, place(value[versions]), value[how_many], strings)
        glibc = [tuple(map(int, n[6:].split("."))) for n in names if re.fullmatch(r"GLIBC_[\d.]+", n)]
        binary.oldest = ".".join(map(str, max(glibc, default=())))
    return binary


def _needed_versions(data: bytes, at: int, count: int, strings: int) -> Iterator[str]:
    for _ in range(count):
        _, entries, _, first, following = struct.unpack_from("<HHIII", data, at)
        entry = at + first
        for _ in range(entries):
            _, _, _, name, step = struct.unpack_from("<IHHII", data, entry)
            yield _text(data, strings + name)
            entry += step
        at += following


def _macho(data: bytes) -> Binary:
    machine, _, _, count = struct.unpack_from("<IIII", data, 4)
    binary = Binary("macos", MACHO_MACHINES.get(machine, str(machine)))
    loads_library = (0xC, 0x80000018, 0x8000001F, 0x80000023)
    runs_from, runs_from_before, looks_in, signature = 0x32, 0x24, 0x8000001C, 0x1D
    at = 32
    for _ in range(count):
        command, size = struct.unpack_from("<II", data, at)
        offset = struct.unpack_from("<I", data, at + 8)[0]
        if command in loads_library:
            binary.libraries.append(_text(data, at + offset))
        elif command == looks_in:
            binary.search.append(_text(data, at + offset))
        elif command in (runs_from, runs_from_before):
            packed = struct.unpack_from("<I", data, at + (12 if command == runs_from else 8))[0]
            binary.oldest = f"{packed >> 16}.{packed >> 8 & 255}"
        elif command == signature:
            binary.signed = True
        at += size
    return binary


def _pe(data: bytes) -> Binary:
    header = struct.unpack_from("<I", data, 0x3C)[0]
    machine, sections = struct.unpack_from("<HH", data, header + 4)
    optional_size = struct.unpack_from("<H", data, header + 20)[0]
    optional = header + 24
    binary = Binary("windows", PE_MACHINES.get(machine, str(machine)))
    table = [
        struct.unpack_from("<IIII", data, optional + optional_size + 40 * k + 8) for k in range(sections)
    ]  # size, address, size in the file, place in the file

    def place(address: int) -> int:
        return next(
            at + address - start for _, start, length, at in table if start <= address < start + length
        )

    imports = struct.unpack_from("<I", data, optional + 112 + 8)[0]  # the second of the directories
    at = place(imports) if imports else 0
    while imports and (name := struct.unpack_from("<I", data, at + 12)[0]):
        binary.libraries.append(_text(data, place(name)))
        at += 20
    return binary
