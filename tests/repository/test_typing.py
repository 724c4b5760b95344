"""Programs of users pass the type checkers: strict mypy, and pyright."""

import json
import subprocess
import sys

import pytest

# Without the code: whether SciPy has stubs is not ours to say.
STRICT = [
    "--strict",
    "--disable-error-code=import-untyped",
    "--python-executable",
    sys.executable,
    "--cache-dir",
]


@pytest.fixture(scope="module")
def cache(tmp_path_factory):
    """What mypy knows of NumPy and of the package, for all runs of this file."""
    return str(tmp_path_factory.mktemp("mypy"))


def programs(root):
    return [root / "tests" / "support" / "typed_programs.py", *sorted((root / "examples").glob("*.py"))]


# Breaks when a program that runs is refused by mypy: an array where one is taken, a result without type.
def test_mypy(root, tmp_path, cache):
    pytest.importorskip("mypy")
    command = [sys.executable, "-m", "mypy", *STRICT, cache, *map(str, programs(root))]
    result = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path)
    assert result.returncode == 0, result.stdout + result.stderr


# Breaks when pyright refuses it, or a function of the package has types that it cannot know.
def test_pyright(root, tmp_path):
    pytest.importorskip("pyright")
    settings = {
        "include": [str(path) for path in programs(root)],
        "extraPaths": [
            str(root / "python")
        ],  # an editable install is found by an import hook, which only runs
        "typeCheckingMode": "standard",
    }
    (tmp_path / "pyrightconfig.json").write_text(json.dumps(settings))
    command = [
        sys.executable,
        "-m",
        "pyright",
        "--project",
        str(tmp_path),
        "--pythonpath",
        sys.executable,
        "--outputjson",
    ]
    result = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path)
    try:
        told = json.loads(result.stdout)
    except json.JSONDecodeError:  # it needs node, which it fetches where there is none
        pytest.skip(f"pyright does not run here: {result.stderr[-200:]}")
    faults = [d for d in told["generalDiagnostics"] if d["severity"] == "error"]
    shown = [f"{d['file']}:{d['range']['start']['line'] + 1}: {d['message']}" for d in faults]
    assert not shown, "\n".join(shown)


# Breaks when a mistake in a program of a user is not seen: then the tests above prove nothing.
def test_mistakes_are_seen(tmp_path, cache):
    pytest.importorskip("mypy")
    bad = ['amontons.Simulation("model")', "amontons.scenes.arch(mu='much')", "amontons.sweep(1, {}).no_such"]
    (tmp_path / "bad.py").write_text("\n".join(["import amontons", *bad]))
    command = [sys.executable, "-m", "mypy", *STRICT, cache, "bad.py"]
    result = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path)
    assert result.returncode == 1
    for line in range(2, 2 + len(bad)):
        assert f"bad.py:{line}: error" in result.stdout, result.stdout
