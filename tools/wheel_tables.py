"""What the tables of `make wheels` and `make wheels-test` say below them; RELEASING.md has copies."""

from __future__ import annotations

import datetime
import os
import re
import subprocess
from pathlib import Path


def made_by(command: str, zig: Path) -> str:
    """Command, date, compiler and processor in a sentence."""
    today = datetime.datetime.now(datetime.UTC).date()
    date = f"{today.day} {today:%B %Y}"
    return f"Made by `{command}` on {date} with {compiler(zig)}, on {processor()}."


def compiler(zig: Path) -> str:
    """The version of Clang and of the package that brings it."""
    return f"Clang {clang_version(zig)} of ziglang {_told(zig, 'version').strip()}"


def clang_version(zig: Path) -> str:
    found = re.search(r"clang version (\d[\d.]*)", _told(zig, "c++", "--version"))
    return found[1] if found else "unknown"


def processor() -> str:
    cpu = Path("/proc/cpuinfo")
    names = re.findall(r"model name\s*:\s*(.+)", cpu.read_text()) if cpu.is_file() else []
    return f"{os.cpu_count()} cores, {names[0] if names else 'an unnamed processor'}"


def _told(*command: object) -> str:
    return subprocess.run([str(c) for c in command], capture_output=True, text=True, check=False).stdout
