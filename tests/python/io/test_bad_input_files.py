"""Every bad file has a message that names the file and what is wrong in it."""

import shutil
from collections import Counter
from pathlib import Path

import amontons
import h5py
import numpy as np
import pytest
import scipy.sparse as sp
from problems import EXAMPLES, one_contact, random_spd

GLOBAL = "fclib_global"


@pytest.fixture
def local(tmp_path):
    """A good local file with bilateral rows, to be spoilt."""
    path = tmp_path / "local.hdf5"
    cones = [amontons.vi.Friction([0.3, 0.5]), amontons.vi.Bilateral(2)]
    amontons.vi.Problem(random_spd(8), np.ones(8), cones).write(path, storage="csr")
    return path


@pytest.fixture
def body(tmp_path):
    """A good global file, to be spoilt."""
    return Path(shutil.copy(EXAMPLES / "wall_impact.hdf5", tmp_path / "body.hdf5"))


def replace(path, changes):
    with h5py.File(path, "a") as file:
        for name, value in changes.items():
            if name in file:
                del file[name]
            if value is not None:
                file[name] = value


def fails(path, message):
    with pytest.raises(amontons.FileError, match=message) as caught:
        amontons.vi.read_problem(path)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


# Breaks when a dataset is assumed to be there, to be of the right type, or to hold sensible numbers.
@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"spacedim": None}, "the dataset /fclib_local/spacedim is missing"),
        ({"spacedim": [2]}, "spacedim = 2 is not supported; only three-dimensional"),
        ({"spacedim": [3.0]}, "/fclib_local/spacedim must be one integer"),
        ({"W": None}, "the group /fclib_local/W is missing"),
        ({"W/x": None}, "the dataset /fclib_local/W/x is missing"),
        ({"W/nz": [-3]}, "/fclib_local/W/nz = -3 is no known storage; nz is the number of triplets, -1"),
        ({"W/nz": [10**6]}, r"/fclib_local/W/i has \d+ entries but nz = 1000000"),
        ({"W/m": [9]}, "/fclib_local/W/p must hold 10 ascending pointers"),
        ({"W/n": [5]}, r"/fclib_local/W/i\[5\] = 5 is outside 0..4|W is 6 x 5"),
        ({"W/m": [-6]}, "has a negative size"),
        ({"W/i": np.zeros(2, dtype=np.int32)}, "/fclib_local/W/i has 2 entries but .*/p ends at 36"),
        ({"W/i": np.full(36, 6, dtype=np.int32)}, r"/fclib_local/W/i\[0\] = 6 is outside 0..5"),
        ({"W/i": np.full(36, 0.5)}, "must hold integers, not float64"),
        ({"W/x": np.full(36, np.nan)}, "/fclib_local/W/x: an entry is not finite"),
        ({"W/x": np.array([b"a"] * 36)}, "/fclib_local/W/x must hold real numbers"),
        ({"W/x": -np.eye(6).ravel()}, "is negative: A must be positive semidefinite"),
        ({"W/x": np.arange(36.0)}, "W is unsymmetric by .*more than 0.01: the file is wrong"),
        ({"vectors": None}, "the group /fclib_local/vectors is missing"),
        ({"vectors/q": None}, "the dataset /fclib_local/vectors/q is missing"),
        ({"vectors/q": np.ones(5)}, "/fclib_local/vectors/q has 5 entries; the matrices ask for 6"),
        ({"vectors/q": [1, 2, np.inf, 4, 5, 6]}, r"/fclib_local/vectors/q\[2\] is not finite"),
        ({"vectors/mu": np.ones(1)}, "/fclib_local/vectors/mu has 1 entries; the matrices ask for 2"),
        ({"vectors/mu": [0.1, -0.1]}, r"/fclib_local/vectors/mu\[1\] = -0.1; it must not be negative"),
        ({"vectors/mu_r": np.ones(2)}, "mu_r: rolling friction belongs in the group /fclib_local_rolling"),
        ({"R": None}, "the group /fclib_local/R is missing"),
        ({"V/m": [5]}, "/fclib_local/V/p must hold 6 ascending pointers|do not fit together"),
        ({"vectors/s": None}, "the dataset /fclib_local/vectors/s is missing"),
    ],
)
def test_local_file(changes, message, local):
    replace(local, {f"fclib_local/{name}": value for name, value in changes.items()})
    fails(local, message)


# Breaks when a rolling file without its coefficients, or with rows for other contacts, is read.
@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"spacedim": [3]}, "spacedim = 3 is not supported; .* whose spacedim is 5 with rolling friction"),
        ({"vectors/mu_r": None}, "the dataset /fclib_local_rolling/vectors/mu_r is missing"),
        ({"vectors/mu_r": [0.1, -0.1]}, r"/fclib_local_rolling/vectors/mu_r\[1\] = -0.1; it must not be neg"),
        ({"vectors/mu": np.ones(3)}, "/fclib_local_rolling/vectors/mu has 3 entries; the matrices ask for 2"),
    ],
)
def test_rolling_file(changes, message, tmp_path):
    path = tmp_path / "rolling.hdf5"
    amontons.vi.Problem(random_spd(10), np.ones(10), amontons.vi.RollingFriction(0.3, 0.1, n=2)).write(path)
    replace(path, {f"fclib_local_rolling/{name}": value for name, value in changes.items()})
    fails(path, message)


# Breaks when rows of three are cut into contacts of five.
def test_rolling_file_of_other_rows(tmp_path):
    path = tmp_path / "rolling.hdf5"
    amontons.vi.Problem(random_spd(9), np.ones(9), "friction", mu=0.3).write(path)
    with h5py.File(path, "a") as file:
        file.move("fclib_local", "fclib_local_rolling")
    replace(path, {"fclib_local_rolling/spacedim": [5]})
    fails(path, "W has 9 rows, which is no multiple of five")


# Breaks when a global problem of mismatched or singular parts is read.
@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"M": None}, "the group /fclib_global/M is missing"),
        ({"H": None}, "the group /fclib_global/H is missing"),
        ({"vectors/f": np.ones(3)}, "/fclib_global/vectors/f has 3 entries; the matrices ask for 258"),
        ({"vectors/b": None}, "the dataset /fclib_global/vectors/b is missing"),
        ({"vectors/w": None}, "the dataset /fclib_global/vectors/w is missing"),
        ({"H/m": [600]}, "H has 600 rows but M has 258"),
        ({"M/x": np.zeros(258)}, r"M is not positive definite: its block of body 0 \(rows 0 to 5\)"),
        ({"M/x": -np.ones(258)}, "M is not positive definite"),
    ],
)
def test_global_file(changes, message, body):
    replace(body, {f"{GLOBAL}/{name}": value for name, value in changes.items()})
    fails(body, message)


# Breaks when a singular mass of no bodies divides by zero, or H of two thirds of a contact is read.
def test_global_file_without_bodies(tmp_path):
    path = tmp_path / "p.hdf5"
    for size, columns, message in (
        (4, 3, "M is singular"),
        (6, 2, "H has 2 columns, which is no multiple of three"),
    ):
        with h5py.File(path, "w") as file:
            g = file.create_group(GLOBAL)
            g["spacedim"] = [3]
            from amontons.io.hdf5 import write_matrix

            write_matrix(g, "M", sp.csr_array(np.ones((size, size))), "csc")
            write_matrix(g, "H", sp.csr_array(np.ones((size, columns))), "csc")
            g["vectors/f"], g["vectors/w"], g["vectors/mu"] = (
                np.ones(size),
                np.ones(columns),
                np.ones(columns // 3),
            )
        fails(path, message)


# Breaks when a file that is no FCLIB file gives a traceback of the HDF5 library.
def test_foreign_files(tmp_path):
    path = tmp_path / "p.hdf5"
    path.write_bytes(b"")
    fails(path, "is not an HDF5 file")
    path.write_text("just text")
    fails(path, "is not an HDF5 file")
    with h5py.File(path, "w") as file:
        file["pressure"] = np.ones(3)
    fails(path, "is no FCLIB file: it has neither /fclib_global nor /fclib_local but /pressure")
    with h5py.File(path, "w"):
        pass
    fails(path, "nor /fclib_local but nothing")
    with h5py.File(path, "w") as file:
        file["fclib_local"] = 3
    fails(path, "the group /fclib_local is missing")


def numbers(path):
    """(start, end) of the bytes in which the file keeps the values of its datasets."""
    found = []

    def visit(_, item):
        if isinstance(item, h5py.Dataset) and item.id.get_offset() is not None:
            found.append((item.id.get_offset(), item.id.get_offset() + item.id.get_storage_size()))

    with h5py.File(path) as file:
        file.visititems(visit)
    return found


def equal(p, q):
    parts = [(p.b, q.b), (p.mu, q.mu), *((getattr(p.A, name), getattr(q.A, name)) for name in vars(q.A))]
    return all(np.array_equal(x, y) for x, y in parts)


# Breaks when a file whose structure was overwritten gives another exception, or a problem that is not the one
# that was written. (Padding and the title may be hit without harm. Numbers carry no mark and are left alone.)
def test_damaged_file(body):
    good, data, values = amontons.vi.read_problem(body), body.read_bytes(), numbers(body)
    rng = np.random.default_rng(0)
    outcomes = Counter()
    while outcomes.total() < 60:
        start = int(rng.integers(8, len(data) - 64))
        if any(first < start + 64 and start < end for first, end in values):
            continue
        body.write_bytes(data[:start] + rng.bytes(64) + data[start + 64 :])
        try:
            outcomes["equal" if equal(amontons.vi.read_problem(body), good) else f"other {start}"] += 1
        except amontons.FileError:
            fails(body, r"body\.hdf5: \S")
            outcomes["refused"] += 1
    assert set(outcomes) == {"equal", "refused"}


# Breaks when a path that cannot be a problem gives something else than a short sentence.
def test_paths(tmp_path):
    with pytest.raises(FileNotFoundError, match=r"gone\.hdf5: no such file"):
        amontons.vi.read_problem(tmp_path / "gone.hdf5")
    with pytest.raises(amontons.FileError, match="is a directory"):
        amontons.vi.read_problem(tmp_path)
    (tmp_path / "p.xml").write_text("")
    fails(tmp_path / "p.xml", "unknown kind of file; known suffixes are .hdf5")
    problem = amontons.vi.Problem(*one_contact())
    with pytest.raises(amontons.FileError, match="unknown kind of file"):
        problem.write(tmp_path / "p.xml")
    with pytest.raises(amontons.FileError, match=r"the folder .* does not exist; make it first"):
        problem.write(tmp_path / "no" / "p.hdf5")


# Breaks when FCLIB is given what it cannot hold, or an option that does not exist.
@pytest.mark.parametrize(
    ("cones", "options", "message"),
    [
        ([amontons.vi.NonNegative(3)], {}, "FCLIB cannot hold NonNegative rows; write the problem as .npz"),
        (
            [amontons.vi.Interval([0] * 3, 1)],
            {},
            "FCLIB cannot hold Interval rows; write the problem as .npz",
        ),
        (
            [amontons.vi.Bilateral(3), amontons.vi.Friction(0.1)],
            {},
            "friction cones before bilateral rows; .*npz",
        ),
        (
            [amontons.vi.Friction(0.1)],
            {"storage": "bsr"},
            "unknown storage 'bsr'; known are csc, csr, triplet",
        ),
        ([amontons.vi.Friction(0.1)], {"form": "dual"}, "unknown form 'dual'; known are auto, global, local"),
        ([amontons.vi.Friction(0.1)], {"form": "global"}, "global form needs a factored operator"),
        (
            [amontons.vi.Friction(0.1)],
            {"solution": [1.0]},
            "solution has 1 entries but the problem has 3 rows",
        ),
    ],
)
def test_what_fclib_cannot_hold(cones, options, message, tmp_path):
    n = sum(cone.rows for cone in cones)
    problem = amontons.vi.Problem(np.eye(n), np.ones(n), cones)
    with pytest.raises(amontons.InputError, match=message):
        problem.write(tmp_path / "p.hdf5", **options)
    assert list(tmp_path.iterdir()) == []


# Breaks when a function is written as if it were a matrix.
@pytest.mark.parametrize("suffix", [".hdf5", ".npz", ".mtx"])
def test_a_function_cannot_be_written(suffix, tmp_path):
    from scipy.sparse.linalg import aslinearoperator

    problem = amontons.vi.Problem(aslinearoperator(np.eye(3)), np.ones(3), "friction", mu=0.1)
    with pytest.raises(amontons.FileError, match="A is a function without a matrix; form the matrix"):
        problem.write(tmp_path / f"p{suffix}")
    assert list(tmp_path.iterdir()) == []


def archive(path, **changes):
    A = sp.csr_array(random_spd(3))
    entries = {"A_data": A.data, "A_indices": A.indices, "A_indptr": A.indptr, "b": np.ones(3), "mu": [0.1]}
    np.savez(path, **{key: value for key, value in (entries | changes).items() if value is not None})


# Breaks when an archive is trusted.
@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"b": None}, "the array 'b' is missing; it holds A_data"),
        ({"b": np.ones(4)}, "b has 4 entries but A has 3 rows"),
        ({"b": [1, np.nan, 1]}, r"b\[1\] is not finite"),
        ({"mu": None}, "neither 'cone_kinds' and 'cone_counts' nor 'mu' says what the cones are"),
        ({"mu": [-1.0]}, r"mu\[0\] = -1.*not negative"),
        ({"mu": [0.1, 0.1]}, "the cones have 6 rows in all but A has 3"),
        ({"A_data": None}, "the array 'A_data' is missing"),
        ({"A_indices": np.full(9, 7)}, "are no matrix of 3 rows"),
        ({"A_data": np.arange(9.0)}, "A is not symmetric"),
        ({"cone_kinds": ["round"], "cone_counts": [1]}, "unknown cone 'round'; known are bilateral"),
        ({"cone_kinds": ["bilateral"]}, "the array 'cone_counts' is missing"),
        ({"cone_kinds": ["interval"], "cone_counts": [3]}, "the array 'lo' is missing"),
        ({"cone_kinds": ["friction"], "cone_counts": [1], "mu": []}, "mu|rows in all"),
    ],
)
def test_archive(changes, message, tmp_path):
    archive(tmp_path / "p.npz", **changes)
    fails(tmp_path / "p.npz", message)


# Breaks when a foreign, truncated or missing archive or matrix gives a traceback.
def test_foreign_archives(tmp_path):
    path = tmp_path / "p.npz"
    path.write_text("no archive")
    fails(path, "is no NumPy archive of a problem, or is truncated")
    archive(path)
    path.write_bytes(path.read_bytes()[:200])
    fails(path, "is no NumPy archive of a problem, or is truncated")
    np.savez(path, objects=np.array([{}], dtype=object))
    fails(path, "the array 'b' is missing; it holds objects")
    np.savez(path, b=np.array([{}], dtype=object))
    fails(
        path, "is no NumPy archive of a problem, or is damaged: the array 'b' has no header of an array of n"
    )
    matrix = tmp_path / "q.mtx"
    matrix.write_text("%%MatrixMarket matrix coordinate real symmetric\n3 3 3\n1 1 1.00000000000000000\n")
    fails(matrix, "q.npz beside it, which does not exist")
    archive(tmp_path / "q.npz")
    fails(matrix, "is truncated: it has 3 of the 9 numbers that its size line says")
    matrix.write_text("nonsense")
    fails(matrix, "is no Matrix Market file")
