"""Rolling and elliptic friction in files: FCLIB's rolling problems, archives, two files of other engines."""

import amontons
import h5py
import numpy as np
import pytest
import scipy.sparse as sp
from amontons import cli
from problems import assert_same, matrix_of, random_spd, read_quietly, real_file
from rolling import check_laws, random_problem
from typer.testing import CliRunner

CHUTE, ROCKFALL = "fclib-rolling/Chute-ndof-768-nc-4-3.hdf5", "fclib-rolling/rockfall_14_25792.npz"


# Breaks when writing or reading loses a coefficient or takes five rows for three, in any form and storage.
@pytest.mark.parametrize("joints", [0, 2])
@pytest.mark.parametrize("storage", ["csc", "csr", "triplet"])
@pytest.mark.parametrize("form", ["global", "local"])
def test_rolling_problems_round_trip_through_fclib(form, storage, joints, tmp_path):
    problem = random_problem("rolling", 4, joints=joints)
    x = np.arange(problem.rows) / 10
    stored = amontons.vi.Problem(problem.A, problem.b, problem.cones, guesses=[x])
    path = tmp_path / "p.hdf5"
    stored.write(path, form=form, storage=storage)
    with h5py.File(path) as file:
        (group,) = (name for name in file if name.startswith("fclib"))
        assert group == f"fclib_{form}_rolling"
        assert file[group]["spacedim"][0] == 5
        assert np.array_equal(file[group]["vectors/mu_r"][:], problem.cones[0].rolling)
    again = amontons.vi.read_problem(path)
    assert isinstance(again.A, amontons.vi.Factored) == (form == "global")
    assert_same(stored, again)
    # A solution is stored in the user's units and comes back as a guess that solves.
    solution = again.solve(tolerance=1e-8)
    again.write(path, solution=solution)
    final = amontons.vi.read_problem(path)
    assert final.residual(final.guesses[-1]) <= 2e-8


# Breaks when FCLIB is given what it cannot hold, or the message has no remedy.
def test_fclib_refuses_what_it_cannot_hold(tmp_path):
    elliptic = random_problem("elliptic-6", 1)
    with pytest.raises(amontons.FileError, match=r"cannot hold EllipticFriction rows; write .* as .npz"):
        elliptic.write(tmp_path / "p.hdf5")
    mixed = amontons.vi.Problem(
        random_spd(8), np.ones(8), [amontons.vi.Friction(0.2), amontons.vi.RollingFriction(0.2, 0.1)]
    )
    with pytest.raises(amontons.FileError, match="with rolling friction or without, not both"):
        mixed.write(tmp_path / "p.hdf5")
    assert list(tmp_path.iterdir()) == []


# Breaks when a coefficient of one kind of cone is taken for one of another.
@pytest.mark.parametrize("suffix", [".npz", ".mtx"])
def test_all_cones_round_trip_through_archives(suffix, tmp_path):
    cones = [
        amontons.vi.RollingFriction([0.1, 0.2], [0.01, 0.02]),
        amontons.vi.EllipticFriction([[0.3, 0.4]], torsion=0.03),
        amontons.vi.Friction(0.5),
        amontons.vi.EllipticFriction([[0.6, 0.7], [0.8, 0.9]]),
        amontons.vi.Bilateral(1),
        amontons.vi.EllipticFriction(0.11, torsion=0.12, rolling=[[0.13, 0.14]]),
        amontons.vi.Interval(-1, 1),
        amontons.vi.RollingFriction(0.15, 0.16),
    ]
    m = sum(cone.rows for cone in cones)
    b = np.random.default_rng(0).normal(size=m)
    problem = amontons.vi.Problem(random_spd(m), b, cones, guesses=[b])
    problem.write(tmp_path / f"p{suffix}")
    again = amontons.vi.read_problem(tmp_path / f"p{suffix}")
    assert np.array_equal(again.b, b)
    assert_same(problem, again)
    factored = random_problem("elliptic-4", 2)
    factored.write(tmp_path / "f.npz")
    assert_same(factored, amontons.vi.read_problem(tmp_path / "f.npz"))


# Breaks when an archive of W, q, mu and mu_r needs more, or its five rows are taken for three.
def test_archive_of_a_local_problem(tmp_path):
    W, q = random_spd(10), np.ones(10)
    np.savez(tmp_path / "p.npz", W=W, q=q, mu=[0.3, 0.4], mu_r=[0.1, 0.2])
    rolling = amontons.vi.Problem(W, q, amontons.vi.RollingFriction([0.3, 0.4], [0.1, 0.2]))
    assert_same(rolling, amontons.vi.read_problem(tmp_path / "p.npz"))
    np.savez(tmp_path / "q.npz", W=W[:9, :9], q=q[:9], mu=0.3)
    assert amontons.vi.read_problem(tmp_path / "q.npz").contacts == 3
    np.savez(tmp_path / "r.npz", W=W, q=q, mu=[0.3, 0.4, 0.5], mu_r=[0.1, 0.2])
    with pytest.raises(amontons.FileError, match=r"r\.npz: RollingFriction: mu has 3 entries"):
        amontons.vi.read_problem(tmp_path / "r.npz")


# Breaks when the matrices of a rolling file are read wrongly: A and b by the definition of the format.
def test_rolling_file_of_siconos_equals_its_definition():
    path = real_file(CHUTE)
    problem = read_quietly(path)
    with h5py.File(path) as file:
        g = file["fclib_global_rolling"]
        M, H = matrix_of(g["M"]), sp.csc_array(matrix_of(g["H"]))
        f, w = g["vectors/f"][:], g["vectors/w"][:]
        u = file["solution/u"][:]
    solve = sp.linalg.splu(sp.csc_array(M)).solve
    W = (H.T @ solve(H.toarray()) + (H.T @ solve(H.toarray())).T) / 2
    x = np.random.default_rng(0).normal(size=20)
    assert np.allclose(problem.A @ x, W @ x, rtol=0, atol=1e-12 * np.abs(W @ x).max())
    assert np.allclose(problem.b, w + H.T @ solve(f), rtol=0, atol=1e-14)
    assert problem.contacts == 4
    # Siconos stopped at 1e-3; its velocities are those of Coulomb's law.
    assert np.allclose(problem.solve(law="coulomb", tolerance=1e-9).u, u, atol=2e-4)


METHODS = (
    "p-spg-fb",
    "p-spg-fb-literal",
    "apgd",
    "jacobi",
    "gauss-seidel",
    "interior-point",
    "newton",
)


# Breaks when a method no longer takes a real rolling problem to 1e-6, or x is no solution of the law.
@pytest.mark.parametrize("method", ["auto", *METHODS])
@pytest.mark.parametrize("law", ["associated", "coulomb"])
@pytest.mark.parametrize("name", [CHUTE, ROCKFALL])
def test_rolling_files_are_solved(name, law, method):
    problem = read_quietly(real_file(name))
    s = problem.solve(law=law, method=method)
    assert s.converged, (s.status, s.residual, s.reason)
    assert problem.residual(s.x, law=law) <= 1e-6
    check_laws(problem, s, law)


# Breaks when a command stumbles over five rows per contact.
@pytest.mark.filterwarnings("ignore::amontons.vi.SymmetrisedWarning")
def test_commands_take_rolling_files(tmp_path):
    path = tmp_path / "p.hdf5"
    random_problem("rolling", 4).write(path)
    run = lambda *arguments: CliRunner().invoke(cli.app, [str(a) for a in arguments])  # noqa: E731
    info = run("info", path)
    assert info.exit_code == 0
    assert "RollingFriction" in info.stdout
    for law in ("associated", "coulomb"):
        assert run("solve", path, "--law", law).exit_code == 0
    compared = run("compare", path, "--deadline", "5", "--output", tmp_path / "out")
    assert compared.exit_code == 0, compared.output
