"""FCLIB files: reading what other engines wrote, and writing what they can read."""

import amontons
import h5py
import numpy as np
import pytest
import scipy.sparse as sp
import scipy.sparse.linalg
from amontons.io.hdf5 import write_matrix
from problems import (
    EXAMPLES,
    assert_same,
    one_contact,
    pile,
    random_spd,
    read_quietly,
    read_raw,
    real_file,
    real_files,
    references,
)

STORAGES = ("csc", "csr", "triplet")


def as_function(raw):
    """A x and b of a file by the definitions of the format, from its raw arrays."""
    if "W" in raw:
        A = (raw["W"] + raw["W"].T) / 2
        return lambda x: A @ x, raw["q"]
    D = raw["H"] if "G" not in raw else sp.csc_array(sp.hstack([raw["H"], raw["G"]]))
    constant = raw["w"] if "G" not in raw else np.concatenate([raw["w"], raw["b"]])
    solve = scipy.sparse.linalg.splu(sp.csc_array(raw["M"])).solve
    return lambda x: D.T @ solve(D @ x), constant + D.T @ solve(raw["f"])


# Breaks when a trap of real files is misread (triplets, nz, zeros, signs), or the factored form is inexact.
@pytest.mark.parametrize("path", real_files())
def test_real_file_equals_its_definition(path):
    problem = read_quietly(path)
    _, raw = read_raw(path)
    product, b = as_function(raw)
    x = np.random.default_rng(0).normal(size=problem.rows)
    expected = product(x)
    difference = np.abs(problem.A @ x - expected).max()
    # CubeH8 has a mass matrix whose upper triangle only is filled: W is symmetric but for 1e-12.
    assert difference <= 3e-12 * np.abs(expected).max()
    assert np.abs(problem.b - b).max() <= 1e-13 * np.abs(b).max()
    assert np.array_equal(problem.mu, raw["mu"])


# Breaks when body structure is no longer found: the fast operator silently becomes a matrix.
@pytest.mark.parametrize("path", real_files())
def test_global_problems_are_factored(path):
    form, raw = read_raw(path)
    problem = read_quietly(path)
    bodies = form == "fclib_global" and "CubeH8" not in path.stem
    assert isinstance(problem.A, amontons.vi.Factored) == bodies
    if bodies:
        assert problem.A.bodies * 6 == raw["M"].shape[0]


# Breaks when writing loses or permutes something that reading needs; storage must not matter.
@pytest.mark.parametrize("path", real_files())
def test_real_file_round_trips(path, tmp_path):
    problem = read_quietly(path)
    storage = STORAGES[len(path.stem) % 3]
    again = tmp_path / "again.hdf5"
    problem.write(again, storage=storage)
    assert read_raw(again)[0] == (
        "fclib_global" if isinstance(problem.A, amontons.vi.Factored) else "fclib_local"
    )
    other = amontons.vi.read_problem(again)
    assert_same(problem, other)
    for name in ("name", "description", "source"):
        assert getattr(other, name) == getattr(problem, name)


# Breaks when sizes or coefficients are attributed to the wrong file, or references.json goes out of step.
@pytest.mark.parametrize("folder", ["fclib", "chrono"])
def test_sizes_agree_with_the_references(folder):
    known = references(folder)
    if not known:
        pytest.skip("no real problem files; set AMONTONS_DATA to their folder")
    for name, reference in known.items():
        problem = read_quietly(real_file(f"{folder}/{name}"))
        assert problem.contacts == reference["contacts"], name
        if folder == "chrono":
            assert problem.rows - 3 * problem.contacts == reference["bilateral_rows"], name


# Breaks when a sign of the format is misread: the optimal objective is then another one.
@pytest.mark.parametrize("path", real_files())
def test_objective_is_that_of_the_reference(path):
    reference = references(path.parent.name)[path.name]
    error = reference.get("associated_error", reference.get("natural_map_over_b"))
    if error > 1e-8 or reference["contacts"] > 1000:
        pytest.skip("the reference is not accurate enough, or the problem is large")
    solution = read_quietly(path).solve(law="associated", tolerance=1e-8, deadline=20)
    assert solution.objective == pytest.approx(reference["associated_objective"], rel=1e-6)


# Breaks when the symmetric part is taken silently, or not at all.
def test_unsymmetric_file_is_symmetrised_and_says_so():
    path = real_file("fclib/faf-Capsules-i97-269.hdf5")
    with pytest.warns(
        amontons.vi.SymmetrisedWarning, match=r"Capsules-i97.*unsymmetric by 1\.8e-03"
    ) as caught:
        problem = amontons.vi.read_problem(path)
    assert caught[0].filename == __file__  # points at the caller
    assert "symmetrised" in problem.notes[0]
    W = read_raw(path)[1]["W"]
    assert abs(problem.A - (W + W.T) / 2).max() == 0


# Breaks when a storage is written or read with rows and columns exchanged.
@pytest.mark.parametrize("form", ["global", "local"])
@pytest.mark.parametrize("storage", STORAGES)
def test_storages_and_forms(storage, form, tmp_path):
    problem = amontons.vi.read_problem(EXAMPLES / "wall_impact.hdf5")
    path = tmp_path / "p.hdf5"
    problem.write(path, storage=storage, form=form)
    again = amontons.vi.read_problem(path)
    x = np.random.default_rng(1).normal(size=problem.rows)
    assert np.allclose(again.A @ x, problem.A @ x, rtol=0, atol=1e-12)
    assert np.allclose(again.b, problem.b, rtol=0, atol=1e-13)
    nz = {"csc": -1, "csr": -2}.get(storage)
    with h5py.File(path) as file:
        g = file["fclib_" + form]
        for key in ("M", "H", "G") if form == "global" else ("W", "V", "R"):
            assert int(g[key]["nz"][0]) == (len(g[key]["x"]) if nz is None else nz)


def write_global(path, M, H, f, w, mu, G=None, b=None):
    with h5py.File(path, "w") as file:
        g = file.create_group("fclib_global")
        g.create_dataset("spacedim", data=np.array([3], dtype=np.int32))
        vectors = {"f": f, "w": w, "mu": mu} | ({"b": b} if G is not None else {})
        for key, matrix in {"M": M, "H": H, "G": G}.items():
            if matrix is not None:
                write_matrix(g, key, sp.csr_array(matrix), "csr")
        for key, value in vectors.items():
            g.create_dataset(f"vectors/{key}", data=value)


def global_problem(path, M, bodies_of_contact, seed=3):
    """Random H with each contact on the given bodies, one bilateral row; returns A and b by dense algebra."""
    rng = np.random.default_rng(seed)
    n = len(M)
    H = np.zeros((n, 3 * len(bodies_of_contact)))
    for c, bodies in enumerate(bodies_of_contact):
        for body in bodies:
            H[6 * body : 6 * body + 6, 3 * c : 3 * c + 3] = rng.normal(size=(6, 3))
    G = np.zeros((n, 1))
    G[:6, 0] = rng.normal(size=6)
    f, w, b = rng.normal(size=n), rng.normal(size=H.shape[1]), rng.normal(size=1)
    write_global(path, M, H, f, w, np.full(len(bodies_of_contact), 0.5), G, b)
    D = np.hstack([H, G])
    return D.T @ np.linalg.solve(M, D), np.concatenate([w, b]) + D.T @ np.linalg.solve(M, f)


def blocks(*matrices):
    return sp.block_diag(matrices).toarray()


def body_mass(seed):
    return blocks(np.eye(3) * (1 + seed), random_spd(3, seed))


# Breaks when a general inertia tensor or a coupled 6 x 6 mass is inverted or transformed wrongly.
@pytest.mark.parametrize("coupled", [False, True])
def test_mass_blocks_become_bodies_exactly(coupled, tmp_path):
    M = blocks(body_mass(0), body_mass(1), random_spd(6, 9) if coupled else body_mass(2))
    A, b = global_problem(tmp_path / "p.hdf5", M, [(0, 1), (2, 1), (2,)])
    problem = amontons.vi.read_problem(tmp_path / "p.hdf5")
    assert isinstance(problem.A, amontons.vi.Factored)
    assert ("unit masses" in " ".join(problem.notes)) == coupled
    assert np.allclose(problem.A.to_sparse().toarray(), A, rtol=0, atol=1e-12 * np.abs(A).max())
    assert np.allclose(problem.b, b, rtol=0, atol=1e-12 * np.abs(b).max())
    problem.write(tmp_path / "q.hdf5")
    assert_same(problem, amontons.vi.read_problem(tmp_path / "q.hdf5"))


# Breaks when a contact of three bodies, or a mass that couples bodies, is forced into pairs of bodies.
@pytest.mark.parametrize("case", ["three bodies", "coupled bodies", "not six"])
def test_other_layouts_form_the_matrix(case, tmp_path):
    M = blocks(body_mass(0), body_mass(1), body_mass(2))
    if case == "coupled bodies":
        M[0, 6] = M[6, 0] = 0.1
    if case == "not six":
        M = blocks(M, np.array([[2.0]]))
    pairs = [(0, 1, 2), (1,)] if case == "three bodies" else [(0, 1), (1,)]
    A, b = global_problem(tmp_path / "p.hdf5", M, pairs)
    problem = amontons.vi.read_problem(tmp_path / "p.hdf5")
    assert not isinstance(problem.A, amontons.vi.Factored)
    assert "was formed" in problem.notes[0]
    x = np.arange(problem.rows, dtype=float)
    assert np.allclose(problem.A @ x, A @ x, rtol=0, atol=1e-11 * np.abs(A @ x).max())
    assert np.allclose(problem.b, b, rtol=0, atol=1e-12 * np.abs(b).max())


# Breaks when explicit zeros in H make two bodies out of one, or hide that a column touches fewer.
def test_explicit_zeros_do_not_count_as_bodies(tmp_path):
    M = blocks(body_mass(0), body_mass(1), body_mass(2))
    H = np.zeros((18, 3))
    H[:12] = np.random.default_rng(0).normal(size=(12, 3))
    stored = sp.coo_array(np.where(H == 0, 1.0, H))
    stored.data[stored.coords[0] >= 12] = 0.0  # an entry for every position of the third body, all zero
    write_global(tmp_path / "p.hdf5", M, stored, np.zeros(18), np.zeros(3), np.array([0.3]))
    problem = amontons.vi.read_problem(tmp_path / "p.hdf5")
    assert isinstance(problem.A, amontons.vi.Factored)
    assert set(problem.A.body_a) == {0}
    assert set(problem.A.body_b) == {1}


# Breaks when a fixed body (no finite mass) or a compliance is lost on the way to a file.
def test_what_has_no_mass_matrix_is_written_exactly(tmp_path):
    contacts, b, cones = pile()
    names = {"name": "n", "source": "s"}
    problem = amontons.vi.Problem(contacts, b, [*cones[:1], amontons.vi.Bilateral(2)], **names)
    problem.write(tmp_path / "compliant.hdf5")
    assert read_raw(tmp_path / "compliant.hdf5")[0] == "fclib_local"
    assert_same(problem, amontons.vi.read_problem(tmp_path / "compliant.hdf5"))
    A = contacts.stored()
    rigid = amontons.vi.Factored(
        np.where(np.arange(6) == 2, 0.0, A.inverse_mass),
        np.where(np.arange(6)[:, None] == 2, 0.0, A.inverse_inertia[:, :3]),
        A.body_a,
        A.body_b,
        A.jacobian_a,
        A.jacobian_b,
    )
    problem = amontons.vi.Problem(
        rigid, b, [*cones[:1], amontons.vi.Bilateral(2)], f=np.arange(36.0), **names
    )
    problem.write(tmp_path / "fixed.hdf5")
    assert read_raw(tmp_path / "fixed.hdf5")[0] == "fclib_global"
    assert_same(problem, amontons.vi.read_problem(tmp_path / "fixed.hdf5"))


# Breaks when the solution of a file is not that of its problem: r, l, u = H'v + w, M v = H r + G l + f.
def test_solution_and_guesses_are_stored(tmp_path):
    problem = amontons.vi.read_problem(EXAMPLES / "wall_impact.hdf5")
    solution = problem.solve(tolerance=1e-3, deadline=5)
    problem.write(tmp_path / "p.hdf5", solution=solution)
    _, raw = read_raw(tmp_path / "p.hdf5")
    with h5py.File(tmp_path / "p.hdf5") as file:
        r, impulses, u, v = (file["solution"][key][:] for key in ("r", "l", "u", "v"))
    assert np.array_equal(np.concatenate([r, impulses]), solution.x)
    assert np.allclose(raw["M"] @ v, raw["H"] @ r + raw["G"] @ impulses + raw["f"], atol=1e-12)
    assert np.allclose(raw["H"].T @ v + raw["w"], u, atol=1e-10)
    again = amontons.vi.read_problem(tmp_path / "p.hdf5")
    assert np.array_equal(again.guesses[-1], solution.x)
    assert again.residual(again.guesses[-1]) == pytest.approx(solution.residual, rel=1e-6)


# Breaks when strings lose their NUL (the C library reads past them) or scalars their shape (1,).
def test_file_layout_is_that_of_the_c_library(tmp_path):
    amontons.vi.Problem(*one_contact(), name="a contact").write(tmp_path / "p.hdf5")
    with h5py.File(tmp_path / "p.hdf5") as file:
        g = file["fclib_local"]
        kind = g["info/title"].id.get_type()
        assert (kind.get_strpad(), kind.get_size()) == (h5py.h5t.STR_NULLTERM, len("a contact") + 1)
        assert all(g[key].shape == (1,) for key in ("spacedim", "W/m", "W/n", "W/nz", "W/nzmax"))
        assert g["W/p"].dtype == g["W/i"].dtype == np.int32


# Breaks when a scalar of shape () or a variable-length string, as other writers make them, is refused.
def test_other_spellings_of_scalars_and_strings(tmp_path):
    amontons.vi.Problem(*one_contact()).write(tmp_path / "p.hdf5")
    with h5py.File(tmp_path / "p.hdf5", "a") as file:
        g = file["fclib_local"]
        del g["spacedim"], g["info/title"], g["W/nz"]
        g["spacedim"], g["W/nz"] = 3, np.int64(-1)
        g["info/title"] = "variable"
    assert amontons.vi.read_problem(tmp_path / "p.hdf5").name == "variable"


# Breaks when a failed write leaves a partial file, or destroys the one that was there.
def test_no_partial_file(tmp_path, monkeypatch):
    problem = amontons.vi.Problem(*one_contact())
    path = tmp_path / "p.hdf5"
    problem.write(path)
    before = path.read_bytes()
    monkeypatch.setattr(
        "amontons.io.problems.fclib_writer._write_info", lambda *_: (_ for _ in ()).throw(OSError("full"))
    )
    with pytest.raises(OSError, match="full"):
        problem.write(path)
    assert path.read_bytes() == before
    assert [p.name for p in tmp_path.iterdir()] == ["p.hdf5"]


# Breaks when a problem without contacts, without bilateral rows, or without anything cannot be stored.
@pytest.mark.parametrize("suffix", [".hdf5", ".npz", ".mtx"])
@pytest.mark.parametrize(
    ("A", "cones"),
    [
        (np.zeros((0, 0)), []),
        (np.eye(2), [amontons.vi.Bilateral(2)]),
        (np.eye(3), [amontons.vi.Friction(0.3)]),
        (amontons.vi.Factored([], np.empty((0, 3)), [], [], [], []), []),
    ],
    ids=["nothing", "bilateral", "contact", "no-bodies"],
)
def test_smallest_problems(A, cones, suffix, tmp_path):
    problem = amontons.vi.Problem(A, np.ones(A.shape[0]), cones)
    problem.write(tmp_path / f"p{suffix}")
    again = amontons.vi.read_problem(tmp_path / f"p{suffix}")
    assert again.rows == problem.rows
    assert np.array_equal(again.solve().x, problem.solve().x)
