"""`amontons sweep`: studies written as TOML files."""

import json

import amontons
import pytest
from amontons import cli
from typer.testing import CliRunner

pq = pytest.importorskip("pyarrow.parquet")


def run(*arguments):
    return CliRunner().invoke(cli.app, ["sweep", *map(str, arguments)])


@pytest.fixture
def study(tmp_path):
    """A writer of study files, beside a file with functions."""
    (tmp_path / "helper.py").write_text("def double(x):\n    return 2 * x\n")
    (tmp_path / "mine.py").write_text(
        "from helper import double\n"
        "def run(x, y=0):\n    if x == 3:\n        raise ValueError('three')\n"
        "    return {'double': double(x) + y}\n"
    )

    def write(text):
        path = tmp_path / "study.toml"
        path.write_text(text)
        return path

    return write


# Breaks when a scene by name is not run at the points of its grid, or the summary is not that of the rows.
def test_scene(study, tmp_path):
    path = study('run = "arch"\n[grid]\nmu = [0.2, 0.6]\n[fixed]\nstones = 5\nduration = 0.1\n')
    result = run(path, "--processes", 1)
    assert result.exit_code == 0, result.output
    rows = pq.read_table(tmp_path / "study.parquet").to_pylist()
    assert [(row["mu"], row["stones"], row["duration"]) for row in rows] == [(0.2, 5, 0.1), (0.6, 5, 0.1)]
    assert rows[0]["moved"] > 1e-3 > 1e-9 > rows[1]["moved"]
    again = run(path, "--json")
    told = json.loads(again.stdout)
    assert (told["runs"], told["done"]) == (2, 2)
    assert told["worst_residual"] == max(row["worst_residual"] for row in rows)
    assert told["wall"] == sum(row["wall"] for row in rows)  # those of the first time: nothing was run again


# Breaks when a function in a file, with a module beside it, cannot be run by worker processes; when ranges
# lack their ends; when a run that failed goes unnoticed.
def test_function_in_a_file(study, tmp_path):
    path = study(
        'run = "mine.py:run"\nout = "rows.parquet"\nprocesses = 2\n'
        "[grid]\nx = {from = 1, to = 4, count = 4}\ny = {from = 0.01, to = 1, count = 3, scale = 'log'}\n"
    )
    result = run(path)
    assert result.exit_code == 1
    assert result.stderr.count("ValueError: three") == 3
    table = pq.read_table(tmp_path / "rows.parquet")
    assert table["x"].to_pylist() == [x for x in (1, 2, 3, 4) for _ in range(3)]
    assert table["y"].to_pylist() == 4 * [0.01, 0.1, 1]
    expected = [None if x == 3 else 2 * x + y for x in (1, 2, 3, 4) for y in (0.01, 0.1, 1)]
    assert table["double"].to_pylist() == expected


# Breaks when points one by one, or the choice of the output, are ignored.
def test_points(study, tmp_path):
    path = study('run = "mine.py:run"\nprocesses = 0\n[[points]]\nx = 1\ny = 5\n[[points]]\nx = 7\ny = 1\n')
    assert run(path, "-o", tmp_path / "other.parquet").exit_code == 0
    assert pq.read_table(tmp_path / "other.parquet")["double"].to_pylist() == [7, 15]


# Breaks when a mistake in a study file is found late, or by a message that does not name it.
@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("run = ", "is not TOML"),
        ("[grid]\nx = [1]", 'run is missing: write run = "SCENE"'),
        ('run = "arch"', "give one of [grid]"),
        ('run = "arch"\ngird = 1', "unknown key 'gird' (did you mean 'grid'?)"),
        ('run = "arhc"\n[grid]\nmu = [1]', "no scene or model file 'arhc' (did you mean 'arch'?)"),
        ('run = "arch"\n[grid]\nnu = [1]', "arch takes no argument 'nu'"),
        ('run = "mine.py:rnu"\n[grid]\nx = [1]', "has no function 'rnu' (did you mean 'run'?); it has "),
        ('run = "gone.py:run"\n[grid]\nx = [1]', "gone.py: no such file"),
        ('run = "gone.module:run"\n[grid]\nx = [1]', "gone.module cannot be imported"),
        ('run = "arch"\n[grid]\nmu = {from = 1, to = 2}', "grid.mu: count is missing"),
        ('run = "arch"\n[grid]\nmu = {from = 1, to = 2, step = 3}', "grid.mu: unknown key 'step'"),
        ('run = "arch"\n[grid]\nmu = {from = 0, to = 2, count = 3, scale = "log"}', "must be positive"),
        (
            'run = "arch"\n[grid]\nmu = {from = 1, to = 2, count = 3, scale = "cubic"}',
            'must be "linear" or "log"',
        ),
        ('run = "arch"\n[grid]\nmu = [1]\n[fixed]\nmu = 1', "'mu' stands in [fixed] and is varied too"),
        ('run = "arch"\nout = 5\n[grid]\nmu = [1]', "out = 5"),
        ('run = "arch"\nout = "x.csv"\n[grid]\nmu = [1]', "ends in .parquet"),
        ('run = "arch"\nprocesses = "all"\n[grid]\nmu = [1]', "processes = 'all'"),
        ('run = "arch"\nfixed = 1\n[grid]\nmu = [1]', "fixed must be a table"),
        ('run = "arch"\npoints = 1', "points must be a list of tables"),
        ('run = "arch"\ngrid = 1', "grid must be a table"),
    ],
)
def test_bad_study(study, tmp_path, text, message):
    result = run(study(text))
    assert result.exit_code == 2, result.output
    assert message in result.stderr
    assert len(result.stderr.strip().splitlines()) == 1
    assert not list(tmp_path.glob("*.parquet"))


# Breaks when options that exclude each other, or a scheduler that does not answer, give a traceback.
def test_bad_options(study, tmp_path, monkeypatch):
    pytest.importorskip("distributed")
    path = study('run = "arch"\n[grid]\nmu = [1]\n')
    both = run(path, "--dask", "tcp://127.0.0.1:1", "--processes", 1)
    assert both.exit_code == 2
    assert "one of --processes and --dask" in both.stderr
    assert run(tmp_path / "gone.toml").exit_code == 2
    assert run(path, "--redo", "all").exit_code == 2


# Breaks when the studies of the examples no longer run as they stand.
def test_study_of_the_examples(root, tmp_path):
    out = tmp_path / "arch.parquet"
    result = run(root / "examples" / "studies" / "arch.toml", "-o", out, "--json")
    assert result.exit_code == 0, result.output
    rows = pq.read_table(out).to_pylist()
    fell = {row["mu"]: row["moved"] > 0.02 for row in rows}
    assert fell[min(fell)]
    assert not fell[max(fell)]
    assert amontons.__version__ == rows[0]["amontons"]


# Breaks when a study that is held to one module runs anything else: a file, another module, a function that
# the module only imported, a private one, a model file; when something is imported before it is refused; when
# its rows go to another folder. Scenes and functions of the module are allowed.
def test_functions_of_one_module(study, tmp_path, monkeypatch):
    (tmp_path / "allowed.py").write_text(
        "from os import system\nfrom helper import double\n"
        "def run(x):\n    return {'y': x}\ndef _own(x):\n    return {'y': x}\nclass Made:\n    pass\n"
    )
    (tmp_path / "trap.py").write_text("raise SystemExit('imported')\n")
    (tmp_path / "model.xml").write_text("<mujoco/>")
    monkeypatch.syspath_prepend(tmp_path)
    grid = "processes = 0\n[grid]\nx = [1, 2]\n"
    for name in (
        "trap:run", "trap.py:run", "mine.py:run", "allowed.py:run", "os:system", "allowed:system",
        "allowed:double", "allowed:_own", "allowed:Made", "model.xml", "allowed.run:x", "allowed:",
        "helper:double",
    ):  # fmt: skip
        result = run(study(f'run = "{name}"\n{grid}'), "--module", "allowed")
        assert result.exit_code == 2, name
        assert "allowed are scenes and functions of allowed" in " ".join(result.stderr.split()), name
    for out in ("../x.parquet", str(tmp_path.parent / "x.parquet")):
        result = run(study(f'run = "allowed:run"\nout = "{out}"\n{grid}'), "--module", "allowed")
        assert result.exit_code == 2
        assert "lies outside of its folder" in result.stderr
    assert run(study(f'run = "allowed:run"\n{grid}'), "--module", "allowed").exit_code == 0
    assert pq.read_table(tmp_path / "study.parquet")["y"].to_pylist() == [1, 2]
    scene = (
        'run = "arch"\nout = "arch.parquet"\nprocesses = 0\n[grid]\nmu = [0.5]\n[fixed]\nduration = 0.01\n'
    )
    assert run(study(scene), "--module", "allowed").exit_code == 0
