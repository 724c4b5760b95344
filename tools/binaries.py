"""What an extension module says of itself: LIEF reads the three formats of programs without their tools."""

from __future__ import annotations

import re
from dataclasses import dataclass, field

import lief

lief.logging.disable()
SYSTEMS = {
    lief.Binary.FORMATS.ELF: "linux", lief.Binary.FORMATS.MACHO: "macos", lief.Binary.FORMATS.PE: "windows",
}  # fmt: skip
MACHINES = {lief.Header.ARCHITECTURES.X86_64: "x86_64", lief.Header.ARCHITECTURES.ARM64: "aarch64"}


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
    made = lief.parse(list(data))
    if made is None or made.format not in SYSTEMS or not made.abstract.header.is_64:
        raise ValueError("is no ELF, Mach-O or PE file for 64 bits")
    machine = MACHINES.get(made.abstract.header.architecture, str(made.abstract.header.architecture))
    found = Binary(SYSTEMS[made.format], machine, list(made.abstract.libraries))
    if isinstance(made, lief.ELF.Binary):
        names = [
            version.name
            for part in made.symbols_version_requirement
            for version in part.get_auxiliary_symbols()
        ]
        glibc = [tuple(map(int, n[6:].split("."))) for n in names if re.fullmatch(r"GLIBC_[\d.]+", n)]
        found.oldest = ".".join(map(str, max(glibc, default=())))
        tags = (lief.ELF.DynamicEntry.TAG.RPATH, lief.ELF.DynamicEntry.TAG.RUNPATH)
        found.search = [path for entry in made.dynamic_entries if entry.tag in tags for path in entry.paths]
    elif isinstance(made, lief.MachO.Binary):
        version = made.build_version.minos if made.has_build_version else made.version_min.version
        found.oldest = ".".join(map(str, version[:2]))
        found.search = [path.path for path in made.rpaths]
        found.signed = made.has_code_signature
    return found
