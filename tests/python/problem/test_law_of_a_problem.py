"""A problem carries its law, and everything that solves or judges it takes that law."""

import json
import shutil

import amontons
import numpy as np
import pytest
from amontons.cli import app
from typer.testing import CliRunner

LAWS = ("coulomb", "associated")
OTHER = dict(zip(LAWS, LAWS[::-1], strict=True))


def sliding(law):
    """A step of a cube that slides: the laws differ."""
    simulation = amontons.Simulation(amontons.scenes.sliding_cube(), dt=5e-3, law=law)
    report = simulation.step()
    assert report.status == "converged"
    return simulation, simulation.problem()


def run(*arguments):
    return CliRunner().invoke(app, [str(a) for a in arguments])


# Breaks when the problem of a step is judged by another law than that by which it was solved.
@pytest.mark.parametrize("law", LAWS)
def test_problem_of_a_step(law):
    simulation, problem = sliding(law)
    assert problem.law == law
    assert problem.residual(simulation.forces.impulses) <= simulation.options["tolerance"]
    assert problem.residual(simulation.forces.impulses, law=OTHER[law]) > 0.1
    assert amontons.vi.residual(problem, simulation.forces.impulses) <= 1e-6
    assert np.linalg.norm(problem.natural_map(simulation.forces.impulses)) < 1e-8
    assert np.allclose(problem.solve(tolerance=1e-10).x, simulation.forces.impulses, atol=1e-5)
    assert np.allclose(amontons.vi.violations(problem, simulation.forces.impulses)[1:3], 0, atol=1e-6)
    # The law of the problem stays when that of the simulation changes.
    simulation.change_options(law=OTHER[law])
    assert problem.law == law
    simulation.step()
    assert simulation.problem().law == OTHER[law]


# p.solve() of a sliding cube must not make it jump.
def test_solving_a_step_again_does_not_lift():
    _, problem = sliding("coulomb")
    assert problem.solve(tolerance=1e-10).u[::3].max() < 1e-6
    assert problem.solve(law="associated", tolerance=1e-10).u[::3].max() > 0.1


# Breaks when arrays have another default, or the law by name is not that of the solve.
def test_arrays_are_coulomb():
    A, b = np.eye(3), [-1.0, 2.0, 0.0]
    assert amontons.vi.Problem(A, b, "friction", mu=0.5).law == "coulomb"
    assert np.allclose(amontons.vi.solve(A, b, "friction", mu=0.5, tolerance=1e-10).x, [1, -0.5, 0])
    relaxed = amontons.vi.Problem(A, b, "friction", mu=0.5, law="associated")
    assert relaxed.law == "associated"
    assert np.allclose(relaxed.solve(tolerance=1e-10).x, [1.6, -0.8, 0])
    assert np.allclose(relaxed.solve(law="coulomb", tolerance=1e-10).x, [1, -0.5, 0])
    assert relaxed.residual([1.6, -0.8, 0]) == pytest.approx(0, abs=1e-12)
    with pytest.raises(amontons.InputError, match="unknown law 'hooke'"):
        amontons.vi.Problem(A, b, "friction", mu=0.5, law="hooke")
    with pytest.raises(AttributeError):
        relaxed.law = "coulomb"


# Breaks when a format drops the law, or a file that says nothing is not Coulomb's.
@pytest.mark.parametrize("name", ["p.npz", "p.mtx", "p.hdf5"])
@pytest.mark.parametrize("law", LAWS)
def test_files_keep_the_law(tmp_path, name, law):
    simulation, problem = sliding(law)
    problem.write(tmp_path / name)
    again = amontons.vi.read_problem(tmp_path / name)
    assert again.law == law
    assert again.residual(simulation.forces.impulses) <= 1e-6


def test_files_that_say_nothing_are_coulomb(tmp_path, root):
    np.savez(tmp_path / "p.npz", A_dense=np.eye(3), b=[-1.0, 2.0, 0.0], mu=[0.5])
    assert amontons.vi.read_problem(tmp_path / "p.npz").law == "coulomb"
    assert amontons.vi.read_problem(root / "examples/problems/wall_impact.hdf5").law == "coulomb"
    np.savez(tmp_path / "q.npz", A_dense=np.eye(3), b=[-1.0, 2.0, 0.0], mu=[0.5], law="hooke")
    with pytest.raises(amontons.FileError, match="q.npz: unknown law 'hooke'; known are"):
        amontons.vi.read_problem(tmp_path / "q.npz")


# Breaks when a command has a law of its own, or does not say which it took.
def test_commands_take_the_law_of_the_file(tmp_path, root):
    _, problem = sliding("associated")
    problem.write(tmp_path / "relaxed.npz")
    shutil.copy(root / "examples/problems/block_on_incline.hdf5", tmp_path / "block.hdf5")
    out = run("solve", tmp_path / "relaxed.npz").stdout
    assert "law associated" in out
    out = run("solve", tmp_path / "relaxed.npz", "--json", "--law", "coulomb").stdout
    by_name = json.loads(out)[0]["objective"]
    own = json.loads(run("solve", tmp_path / "relaxed.npz", "--json").stdout)[0]["objective"]
    assert own < by_name - 1e-3  # the relaxation has the minimum
    assert "law coulomb" in run("solve", tmp_path / "block.hdf5").stdout
    both = run("solve", tmp_path / "block.hdf5", tmp_path / "relaxed.npz").stdout
    assert "law associated or coulomb" in both
    told = run(
        "compare", tmp_path / "relaxed.npz", "--methods", "auto,apgd", "--out", tmp_path / "out", "--json"
    )
    told = json.loads(told.stdout)
    assert told["law"] == "associated"
    assert [r["objective"] for r in told["runs"]] == pytest.approx([own, own], rel=1e-4)
    assert "associated" in run("info", tmp_path / "relaxed.npz").stdout
