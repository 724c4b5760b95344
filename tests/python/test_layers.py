"""The layers of ARCHITECTURE.md, and that the checker sees each kind of violation in Python.

Those in C++ are in test_layers_cpp.py.
"""

import check_layers
import pytest


# Breaks when a file uses a folder above its own, in C++ or in Python, or closes a cycle.
def test_layers_hold(root):
    assert check_layers.violations(root) == []


def tree(folder, files):
    for name, text in files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    return check_layers.violations(folder)


PYTHON = {
    "python/amontons/__init__.py": "from .io import read\nfrom .problem.problem import Problem\n",
    "python/amontons/errors.py": "from . import _core\n",
    "python/amontons/shapes.py": "from .model.shapes import *\n",
    "python/amontons/model/__init__.py": "",
    "python/amontons/model/shapes.py": "from ..errors import InputError\n",
    "python/amontons/problem/__init__.py": "",
    "python/amontons/problem/problem.py": (
        "from typing import TYPE_CHECKING\nfrom .. import _core\n"
        "if TYPE_CHECKING:\n    from ..report import plot\n"
        "class Problem:\n    def solve(self):\n        from ..errors import InputError\n"
    ),
    "python/amontons/simulation/__init__.py": "from ..model import shapes\nfrom ..problem import problem\n",
    "python/amontons/io/__init__.py": "from ..problem.problem import Problem\n",
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
        ("python/amontons/io/a.py", "from .a2 import y\n", "import cycle"),
        ("python/amontons/io/a.py", "def f():\n    from .a2 import y\n", "import cycle"),
    ],
)
def test_violation_is_found(tmp_path, name, text, message):
    extra = {"python/amontons/io/a2.py": "from . import a\n"} if message == "import cycle" else {}
    found = tree(tmp_path, PYTHON | {name: text} | extra)
    assert any(message in line for line in found), found
