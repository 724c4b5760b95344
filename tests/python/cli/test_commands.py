"""The command: what it prints, and its exit codes."""

import csv
import json
import subprocess
import sys
from pathlib import Path

import amontons
import h5py
import numpy as np
import pytest
from amontons import cli
from amontons.problem.solution import HISTORY
from amontons.report.comparison import CSV_ROWS, thinned
from problems import EXAMPLES, real_file
from typer.testing import CliRunner

WALL, BLOCK, LATTICE = (
    str(EXAMPLES / f"{name}.hdf5") for name in ("wall_impact", "block_on_incline", "lattice")
)


def run(*arguments):
    return CliRunner().invoke(cli.app, [str(a) for a in arguments])


@pytest.fixture
def bad(tmp_path):
    path = tmp_path / "bad.hdf5"
    path.write_text("no HDF5")
    return path


# Breaks when scripts can no longer tell success from failure.
def test_exit_codes(bad):
    assert run("solve", BLOCK).exit_code == 0
    assert run("solve", BLOCK, WALL, "--tolerance", "1e-13", "--max-iterations", "3").exit_code == 1
    assert run("solve", BLOCK, bad).exit_code == 2
    assert run("solve", bad, WALL, "--max-iterations", "1").exit_code == 2
    assert run("info", bad).exit_code == 2
    assert run("solve").exit_code == 2


# Breaks when a method that does not apply to one file keeps the others from being solved.
def test_method_that_does_not_apply():
    result = run("solve", WALL, LATTICE, "--method", "cg")
    assert result.exit_code == 2
    assert f"error: {WALL}: cg" in result.stderr
    assert "lattice.hdf5" in result.stdout


# Breaks when the table lacks a file or a column.
def test_solve_prints_a_table():
    result = run("solve", BLOCK, LATTICE, "--law", "coulomb")
    assert result.exit_code == 0
    for word in ("law coulomb", "block_on_incline.hdf5", "lattice.hdf5", "converged", "residual", "products"):
        assert word in result.stdout


# Breaks when the JSON is mixed with other output, or a field is lost. Bad files do not keep others from it.
def test_json(bad):
    result = run("solve", bad, BLOCK, "--json", "--tolerance", "1e-9")
    (entry,) = json.loads(result.stdout)
    assert entry["status"] == "converged"
    assert entry["converged"] is True
    assert entry["residual"] <= 1e-9
    assert entry["rows"] == 12
    assert entry["contacts"] == 4
    assert set(entry) >= {"file", "method", "reason", "objective", "iterations", "products", "time", "notes"}
    assert result.exit_code == 2


# Breaks when an error is more than one line, has a traceback, or does not name the file.
@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["solve", "gone.hdf5"], "error: gone.hdf5: no such file"),
        (["info", "gone.hdf5"], "error: gone.hdf5: no such file"),
        (["compare", "gone.hdf5"], "error: gone.hdf5: no such file"),
        (["solve", WALL, "--method", "simplex"], "error: unknown method 'simplex'; known are auto"),
        (["solve", WALL, "--method", "cg"], f"error: {WALL}: cg"),
        (["solve", WALL, "--law", "hooke"], "unknown law 'hooke'; known are associated, coulomb"),
        (["solve", WALL, "--tolerance", "-1"], "tolerance = -1.0; it must be zero or positive"),
        (["compare", WALL, "--methods", "p-spg-fb,foo"], "error: unknown method 'foo'"),
        (["compare", WALL, "--law", "hooke"], "unknown law 'hooke'"),
    ],
)
def test_one_line_errors(arguments, message, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = run(*arguments)
    assert result.exit_code == 2
    assert message in result.stderr
    assert len(result.stderr.strip().splitlines()) == 1
    assert "Traceback" not in result.output


# Breaks when the real command differs from the functions: started as a process, with a truncated file.
def test_as_a_process(tmp_path):
    truncated = tmp_path / "truncated.hdf5"
    truncated.write_bytes(Path(WALL).read_bytes()[:20000])
    command = [sys.executable, "-m", "amontons", "solve", truncated, BLOCK]
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    assert result.returncode == 2
    assert "truncated.hdf5" in result.stderr
    assert "Traceback" not in result.stderr
    assert "block_on_incline" in result.stdout
    version = subprocess.run(
        [sys.executable, "-m", "amontons", "--version"], capture_output=True, text=True, check=True
    )
    assert version.stdout.strip() == f"amontons {amontons.__version__}"


# Breaks when the note about a symmetrised matrix is lost or becomes an error.
def test_symmetrised_file_is_noted():
    path = real_file("fclib/faf-Capsules-i97-269.hdf5")
    result = run("solve", path, "--max-iterations", "5", "--json", "--method", "p-spg-fb")
    assert "note:" in result.stderr
    assert "symmetrised" in result.stderr
    assert "symmetrised" in json.loads(result.stdout)[0]["notes"][0]


# Breaks when a method is left out silently, or the figure or a CSV is missing or empty.
def test_compare(tmp_path):
    folder = tmp_path / "deep" / "out"
    result = run("compare", BLOCK, LATTICE, "--out", folder, "--deadline", "0.5")
    assert result.exit_code == 0, result.output
    assert "cg does not apply to block_on_incline" in result.stdout
    assert "convergence.png" in result.stdout
    with open(folder / "summary.csv") as file:
        summary = list(csv.DictReader(file))
    expected = set(amontons.vi.methods())
    for problem in ("block_on_incline", "lattice"):
        assert {row["method"] for row in summary if row["problem"] == problem} == expected
    refused = {row["method"] for row in summary if row["status"] == "not applicable"}
    assert refused == {"cg", "minres"}
    assert all(row["reason"] for row in summary if row["status"] == "not applicable")
    with open(folder / "curves.csv") as file:
        curves = list(csv.DictReader(file))
    assert {row["method"] for row in curves} == expected
    assert set(curves[0]) == {"problem", "method", *HISTORY.names}
    assert (folder / "convergence.png").read_bytes().startswith(b"\x89PNG")
    assert (folder / "convergence.png").stat().st_size > 20000


# Breaks when an unsolved problem counts as a success, or the choice of methods is ignored.
def test_compare_chosen_methods(tmp_path):
    result = run("compare", WALL, "--methods", "jacobi, p-spg-fb", "--out", tmp_path, "--deadline", "0.05",
                 "--tolerance", "1e-14", "--law", "associated")  # fmt: skip
    assert result.exit_code == 1
    with open(tmp_path / "summary.csv") as file:
        assert [row["method"] for row in csv.DictReader(file)] == ["jacobi", "p-spg-fb"]


# Breaks when the output folder cannot be made and a traceback follows minutes of work.
def test_compare_into_a_file(tmp_path):
    (tmp_path / "taken").write_text("")
    result = run("compare", BLOCK, "--methods", "p-spg-fb", "--out", tmp_path / "taken")
    assert result.exit_code == 2
    assert "cannot be made" in result.stderr


# Breaks when a long history makes a CSV of gigabytes, or thinning loses the ends.
def test_thinning_keeps_the_ends():
    history = np.zeros(10 * CSV_ROWS, dtype=HISTORY)
    history["iteration"] = np.arange(len(history))
    few = thinned(history)
    assert len(few) <= CSV_ROWS
    assert few["iteration"][0] == 0
    assert few["iteration"][-1] == len(history) - 1
    assert len(thinned(history[:10])) == 10


# Breaks when info counts wrongly. The wall: 43 bodies of 6, so rank <= 258; b from the ball's speed.
def test_info():
    result = run("info", WALL)
    assert result.exit_code == 0
    lines = dict(line.split(None, 1) for line in result.stdout.splitlines() if len(line.split()) > 1)
    assert lines["rows"].strip() == "868"
    assert lines["contacts"].strip() == "289"
    assert lines["mu"].strip() == "0.6 to 0.6"
    assert lines["symmetry"].strip() == "symmetric"
    assert "43 bodies" in lines["operator"]
    assert lines["rank"].split()[2] == "868"
    assert int(lines["rank"].split()[0]) <= 258


# Breaks when rank, eigenvalues or conditioning are wrong, for matrices of known spectrum.
def test_spectrum():
    from amontons.report.spectrum import spectrum

    Q = np.linalg.qr(np.random.default_rng(0).normal(size=(30, 30)))[0]
    values = np.r_[np.zeros(10), np.linspace(1e-3, 5, 20)]
    A = (Q * values) @ Q.T
    s = spectrum(amontons.vi.Problem((A + A.T) / 2, np.zeros(30), "bilateral"))
    assert s.exact
    assert s.rank == 20
    assert s.largest == pytest.approx(5)
    assert s.smallest_nonzero == pytest.approx(1e-3, rel=1e-6)
    assert s.condition == pytest.approx(5e3, rel=1e-6)
    # Both sides of D M^-1 D' have the same nonzero eigenvalues.
    problem = amontons.vi.read_problem(WALL)
    dense = np.linalg.eigvalsh(problem.A.to_sparse().toarray())
    found = spectrum(problem)
    assert found.largest == pytest.approx(dense[-1])
    assert found.rank == np.sum(dense > 1e-12 * dense[-1])


# Breaks when the estimate for large matrices leaves the order of magnitude. diag(1 .. 3000) and 1500 zeros.
def test_spectrum_of_large_matrices():
    import scipy.sparse as sp
    from amontons.report.spectrum import spectrum

    values = np.r_[np.zeros(1500), np.linspace(1, 100, 3000)]
    s = spectrum(amontons.vi.Problem(sp.diags_array(values), np.zeros(4500), "bilateral"))
    assert not s.exact
    assert s.rank == pytest.approx(3000, rel=0.05)
    assert s.largest == pytest.approx(100, rel=0.01)


# Breaks when a file with nothing in it cannot be described.
def test_info_of_the_smallest_problems(tmp_path):
    for n in (0, 3):
        path = tmp_path / "p.hdf5"
        amontons.vi.Problem(np.eye(n), np.ones(n), "friction", mu=0.1).write(path)
        assert run("info", path).exit_code == 0
    with h5py.File(path, "a") as file:
        del file["fclib_local/info"]
    assert run("info", path).exit_code == 0
