"""What a run of the tests left out is told by group, with the command that adds it."""

import os
import subprocess
import sys

import pytest
from skipped import GROUPS, group_of

SKIPS = """
import pytest
def test_page(): pytest.skip("needs Chromium: install it, or name it in AMONTONS_BROWSER")
def test_packages(): pytest.importorskip("a_package_that_is_absent")
@pytest.mark.parametrize("case", [1, 2])
def test_nothing_to_test(case): pytest.skip("these have no length for MuJoCo")
def test_passes(): pass
"""


def run(tmp_path, root, **environment):
    (tmp_path / "test_skips.py").write_text(SKIPS)
    (tmp_path / "conftest.py").write_text("from skipped import pytest_sessionfinish, pytest_terminal_summary")
    words = ["-q", "-p", "no:cacheprovider", "-n", "1", "--rootdir", str(tmp_path), "-c", os.devnull]
    environ = {k: v for k, v in os.environ.items() if k != "CI" and not k.startswith("PYTEST")}
    path = os.pathsep.join([str(root / "tests" / "support"), environ.get("PYTHONPATH", "")])
    return subprocess.run(
        [sys.executable, "-m", "pytest", *words, str(tmp_path)],
        cwd=tmp_path, env={**environ, "PYTHONPATH": path, **environment}, capture_output=True, text=True,
    )  # fmt: skip


# Breaks when a group is not told, told without its command, or a case without anything to test is told.
def test_groups_are_told(tmp_path, root):
    done = run(tmp_path, root)
    assert done.returncode == 0, done.stdout + done.stderr
    lines = [line for line in done.stdout.splitlines() if " skipped for want of " in line]
    assert lines == [
        "1 skipped for want of a browser: apt-get install chromium (as root), or make browser",
        "1 skipped for want of packages of tests: .venv/bin/python -m pip install -e '.[test]'",
    ]


# Breaks when CI passes although tests that the machine could run were left out.
def test_ci_fails_on_what_the_machine_could_run(tmp_path, root):
    done = run(tmp_path, root, CI="true")
    assert done.returncode == 1
    assert (
        "packages of tests: .venv/bin/python -m pip install -e '.[test]'; this machine could run them"
        in done.stdout
    )


# Breaks when a reason of the tests is taken for one of another group.
@pytest.mark.parametrize(
    ("reason", "name"),
    [
        ("no browser: playwright install chromium", "a browser"),
        ("pyopencl is not installed; make test installs it with pocl", "OpenCL on the processor"),
        ("could not import 'griffe': No module named 'griffe'", "the site"),
        ("pip install amontons[docs]", "notebooks"),
        ("the program that valgrind runs is not built", "counts of instructions"),
        ("needs JAX: pip install jax", "PyTorch and JAX"),
        ("no real problem files in /x; set AMONTONS_DATA to their folder", "files of other projects"),
        ("could not import 'mujoco': No module named 'mujoco'", "packages of tests"),
        ("the processor has no avx512", None),
        ("nothing moves, or too much", None),
    ],
)
def test_groups_of_reasons(reason, name):
    found = group_of(reason)
    assert (found and found.name) == name
    assert found is None or found in GROUPS
