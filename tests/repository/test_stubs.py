"""The committed stub of the compiled module."""

import importlib.util
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("nanobind")


# Breaks when a binding changes and the committed stub does not: `make stubs` renews it.
def test_stub_is_current(root, tmp_path):
    binary = Path(importlib.util.find_spec("amontons._core").origin)
    command = [sys.executable, "-m", "nanobind.stubgen", "-q", "-m", "_core", "-i", binary.parent]
    subprocess.run([*command, "-o", tmp_path / "_core.pyi"], check=True, cwd=tmp_path)
    committed = root / "python" / "amontons" / "_core.pyi"
    assert committed.read_text() == (tmp_path / "_core.pyi").read_text(), (
        "run make stubs and commit the result"
    )


# Breaks when type checkers stop seeing the annotations of the package.
def test_package_is_typed(root):
    assert (root / "python" / "amontons" / "py.typed").is_file()
