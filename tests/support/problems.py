"""Problems for the tests: real files where they are present, and small ones with known answers."""

import json
import os
import warnings
from pathlib import Path

import amontons
import h5py
import numpy as np
import pytest
import scipy.sparse as sp

ROOT = Path(__file__).resolve().parents[2]
DATA = Path(os.environ.get("AMONTONS_DATA", ROOT.parent / "shared" / "data"))
EXAMPLES = ROOT / "examples" / "problems"


def real_files():
    """Parameters for pytest: every real file, or one skipped case that says how to get them."""
    found = sorted(DATA.glob("fclib/*.hdf5")) + sorted(DATA.glob("chrono/*.hdf5"))
    if not found:
        reason = f"no real problem files in {DATA}; set AMONTONS_DATA to their folder"
        return [pytest.param(None, marks=pytest.mark.skip(reason=reason), id="no-data")]
    return [pytest.param(path, id=path.stem) for path in found]


def real_file(name):
    path = DATA / name
    if not path.exists():
        pytest.skip(f"{path} is absent; set AMONTONS_DATA to the folder of the real problem files")
    return path


def robot_file(name):
    """The first model of that name among those of others, e.g. "dm_suite/humanoid" of humanoid.xml."""
    found = sorted((DATA / "robots").glob(f"**/{name}.xml"))
    if not found:
        pytest.skip(f"no {name}.xml in {DATA / 'robots'}; set AMONTONS_DATA to the folder that holds robots")
    return found[0]


def references(folder):
    path = DATA / folder / "references.json"
    return json.loads(path.read_text()) if path.exists() else {}


def quiet(function, *arguments, **options):
    """What a function returns, without its warnings."""
    with warnings.catch_warnings(action="ignore"):
        return function(*arguments, **options)


def silent(function, *arguments, **options):
    """What a function returns that must not warn."""
    with warnings.catch_warnings(action="error"):
        return function(*arguments, **options)


def read_quietly(path):
    with warnings.catch_warnings(action="ignore", category=amontons.vi.SymmetrisedWarning):
        return amontons.vi.read_problem(path)


def matrix_of(group):
    """An FCLIB matrix read by other code than the package's: the documented traps, nothing else."""
    m, n, nz = (int(group[key][0]) for key in ("m", "n", "nz"))
    p, i, x = (group[key][:] for key in ("p", "i", "x"))
    if nz == -1:
        return sp.csc_array((x, i, p), shape=(m, n))
    if nz == -2:
        return sp.csr_array((x, i, p), shape=(m, n))
    return sp.coo_array((x[:nz], (i[:nz], p[:nz])), shape=(m, n)).tocsc()


def read_raw(path):
    """The matrices and vectors of an FCLIB file by name."""
    with h5py.File(path) as file:
        form = "fclib_global" if "fclib_global" in file else "fclib_local"
        g = file[form]
        raw = {key: matrix_of(g[key]) for key in ("M", "H", "G", "W", "V", "R") if key in g}
        raw |= {key: value[:] for key, value in g["vectors"].items()}
    return form, raw


def random_spd(n, seed=0, rank=None):
    rng = np.random.default_rng(seed)
    B = rng.normal(size=(n, rank or n + 2))
    return B @ B.T


def pile(bodies=6, seed=1):
    """A random chain of bodies as Contacts with every kind of row, its b, and the cones."""
    rng = np.random.default_rng(seed)
    normals = rng.normal(size=(bodies, 3))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    inertias = np.array([random_spd(3, seed + i, 5) for i in range(bodies)])
    A = amontons.vi.Contacts(
        rng.uniform(0.1, 2, bodies),
        inertias,
        np.arange(bodies),
        np.arange(bodies) - 1,
        rng.normal(size=(bodies, 3)),
        rng.normal(size=(bodies, 3)),
        normals,
        compliance=rng.uniform(0, 0.1, bodies),
        joint_body_a=[0, 2],
        joint_body_b=[1, -1],
        joint_jacobian_a=rng.normal(size=(2, 6)),
        joint_jacobian_b=rng.normal(size=(2, 6)),
        joint_compliance=[0.0, 0.2],
    )
    cones = [
        amontons.vi.Friction(rng.uniform(0, 1, bodies)),
        amontons.vi.Bilateral(1),
        amontons.vi.NonNegative(1),
    ]
    return A, rng.normal(size=A.shape[0]), cones


def one_contact(mu=0.5, normal_velocity=-1.0, tangential_velocity=0.3):
    """A unit mass (point) on a plane: A = I. Sticks if |v_t| <= mu |v_n|."""
    return np.eye(3), np.array([normal_velocity, tangential_velocity, 0.0]), [amontons.vi.Friction(mu)]


def assert_same(problem, other):
    """That a file gives back a problem that was written, but for rounding of the operator and of b."""
    x = np.random.default_rng(1).normal(size=problem.rows)
    for wanted, found in ((problem.A @ x, other.A @ x), (problem.b, other.b)):
        assert np.abs(found - wanted).max(initial=0) <= 2e-13 * np.abs(wanted).max(initial=1e-300)
    ours, theirs = ([cone for cone in p.cones if cone.rows] for p in (problem, other))
    assert [(cone.kind, cone.n) for cone in ours] == [(cone.kind, cone.n) for cone in theirs]
    for one, two in zip(ours, theirs, strict=True):
        assert all(np.array_equal(a, b) for a, b in zip(one.parameters, two.parameters, strict=True))
    for law in ("associated", "coulomb"):
        assert other.residual(x, law=law) == pytest.approx(problem.residual(x, law=law), rel=1e-9)
    assert len(other.guesses) == len(problem.guesses)
    assert all(np.array_equal(a, b) for a, b in zip(other.guesses, problem.guesses, strict=True))
