"""The checker of the layers of ARCHITECTURE.md sees each kind of violation in Python.

Those in C++ are in test_layers_cpp.py. That the sources have none is what `make lint` checks.
"""

import check_layers
import pytest


def tree(folder, files):
    for name, text in files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    offered = {"problem.problem": ["write_file"]}
    return check_layers.violations(folder, offered=offered, core_users=["amontons.io"])


PYTHON = {
    "python/amontons/__init__.py": "from .io import read\nfrom .problem.problem import Problem\n",
    "python/amontons/errors.py": "from . import _core\n",
    "python/amontons/shapes.py": "from .model.shapes import *\n",
    "python/amontons/model/__init__.py": "",
    "python/amontons/model/shapes.py": "from ..errors import InputError\n",
    "python/amontons/problem/__init__.py": "",
    "python/amontons/problem/problem.py": (
        "from .. import _core\n"
        "class Problem:\n    def solve(self):\n        from ..errors import InputError\n"
    ),
    "python/amontons/simulation/__init__.py": "from ..model import shapes\nfrom ..problem import problem\n",
    "python/amontons/io/__init__.py": (
        "from .. import _core\nfrom ..problem.problem import Problem, write_file\n"
    ),
    "python/amontons/report.py": "from .io import read\n",
    "python/amontons/cli.py": "from amontons import Problem\nfrom .report import plot\n",
}


# Breaks when the checker refuses what ARCHITECTURE.md allows.
def test_allowed_tree_passes(tmp_path):
    assert tree(tmp_path, PYTHON) == []


# Breaks when the checker misses a violation of that kind: then the first test proves nothing.
@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("python/amontons/problem/x.py", "from ..io import read\n", "problem.x may not import amontons.io"),
        (
            "python/amontons/problem/x.py",
            "def f():\n    from ..io import g\n",
            "may not import amontons.io.g",
        ),
        (
            "python/amontons/problem/x.py",
            "from ..model import parts\n",
            "may not import amontons.model.parts",
        ),
        ("python/amontons/model/x.py", "import amontons.problem\n", "may not import amontons.problem"),
        ("python/amontons/errors.py", "from .model import x\n", "errors may not import amontons.model.x"),
        ("python/amontons/io/x.py", "from .. import report\n", "io.x may not import amontons.report"),
        ("python/amontons/__init__.py", "from . import cli\n", "amontons may not import amontons.cli"),
        (
            "python/amontons/io/x.py",
            "from ..problem.problem import y\n",
            "problem.y, which is no public",
        ),
        ("python/amontons/io/x.py", "from .. import _core\n", "io.x may not use _core"),
        (
            "python/amontons/io/__init__.py",
            "from .. import _core\n",
            "problem.write_file has no use for its entry",
        ),
        (
            "python/amontons/problem/x.py",
            "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from ..report import plot\n",
            "problem.x may not import amontons.report.plot",
        ),
    ],
)
def test_violation_is_found(tmp_path, name, text, message):
    found = tree(tmp_path, PYTHON | {name: text})
    assert any(message in line for line in found), found


# Breaks when a cycle stays unseen because one of its imports stands in a function or below
# `if TYPE_CHECKING:`, or because it lies in a tool or a benchmark.
@pytest.mark.parametrize(
    "text",
    [
        "from {package}two import y\n",
        "def f():\n    from {package}two import y\n",
        "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from {package}two import y\n",
    ],
)
@pytest.mark.parametrize(
    ("folder", "package", "names"),
    [
        ("python/amontons/io", ".", ("amontons.io.one", "amontons.io.two")),
        ("tools/soak", ".", ("soak.one", "soak.two")),
        ("tools", "", ("one", "two")),
        ("benchmarks", "", ("one", "two")),
    ],
)
def test_cycle_is_found(tmp_path, folder, package, names, text):
    back = "from .one import x\n" if package else "import one\n"
    files = {f"{folder}/one.py": text.format(package=package), f"{folder}/two.py": back}
    one, two = names
    (fault,) = tree(tmp_path, PYTHON | files)
    assert fault.startswith(f"import cycle {one} -> {two} -> {one}: {folder}/one.py:")
