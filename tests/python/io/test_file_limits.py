"""Files that ask for more than they hold, or for more than is sensible, are refused before memory is taken.

Each test frees the reader from the limit that it meets, where there is one, to show that it is the limit that
refuses. The amount of memory is measured where that is the point.
"""

import io
import itertools
import os
import resource
import zipfile

import amontons
import h5py
import numpy as np
import pytest
from amontons import Limits
from amontons.io.object_header import is_virtual


def refused(read, path, message, **options):
    with pytest.raises(amontons.FileError, match=message) as caught:
        read(path, **options)
    assert str(path) in str(caught.value)


@pytest.fixture
def fclib(tmp_path):
    path = tmp_path / "p.hdf5"
    amontons.vi.Problem(np.eye(6), np.ones(6), "friction", mu=0.3).write(path)
    return path


def put(path, name, make):
    with h5py.File(path, "a") as file:
        del file[name]
        make(file, name)


# Breaks when a dataset is read although the values that it declares are not in the file: of zeros that were
# never written, behind links, in other files.
@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda f, n: f.create_dataset(n, shape=(10**9,), dtype="f8", chunks=(1000,)), "more than the limit"),
        (lambda f, n: f.create_dataset(n, shape=(2 * 10**8,), dtype="f8", chunks=(1000,)), "cannot hold"),
        (lambda f, n: f.create_dataset(n, shape=(2**62,), dtype="f8", chunks=(1000,)), "more than the limit"),
        (lambda f, n: f.create_dataset(n, shape=(6,), dtype="f8", chunks=(10**8,), maxshape=(None,)), "hold"),
        (lambda f, n: f.__setitem__(n, h5py.SoftLink("/fclib_local/vectors/mu")), "is a link"),
        (lambda f, n: f.__setitem__(n, h5py.ExternalLink("/dev/zero", "/x")), "is a link"),
        (lambda f, n: f.create_dataset(n, data=h5py.Empty("f8")), "declares no values"),
        (lambda f, n: f.create_dataset(n, data=np.ones(6), scaleoffset=3), "packed by a filter"),
        (lambda f, n: f.create_dataset(n, shape=(6,), dtype=h5py.ref_dtype), "must hold real numbers"),
        (lambda f, n: f.create_dataset(n, data=np.array([b"x"] * 6)), "must hold real numbers"),
    ],
)
def test_hdf5_that_holds_less_than_it_declares(make, message, fclib):
    put(fclib, "fclib_local/vectors/q", make)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    refused(amontons.vi.read_problem, fclib, message)
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 64_000  # kB


# Breaks when values of other files are read, for which nobody asked.
def test_hdf5_of_other_files(fclib):
    def virtual(file, name):
        layout = h5py.VirtualLayout((6,), dtype="f8")
        layout[:] = h5py.VirtualSource("other.h5", "x", shape=(6,))
        file.create_virtual_dataset(name, layout)

    put(fclib, "fclib_local/vectors/q", virtual)
    refused(amontons.vi.read_problem, fclib, "lie in other files; store them in this one")


# Breaks when the header of an object is not found or not followed over its continuations, in any version of
# the format, or ordinary datasets are taken for virtual ones, which the library must not open where damaged.
@pytest.mark.parametrize("userblock", [0, 512])
@pytest.mark.parametrize("libver", ["earliest", "v110", "latest"])
def test_virtual_datasets_are_known_by_their_headers(tmp_path, libver, userblock):
    path = tmp_path / "x.h5"
    with h5py.File(path, "w", libver=libver, userblock_size=userblock) as file:
        file["plain"] = np.arange(5.0)
        file.create_dataset("chunked", data=np.zeros((100, 3)), chunks=(10, 3), compression="gzip")
        layout = h5py.VirtualLayout((5,), "f8")
        layout[:] = h5py.VirtualSource("other.h5", "x", (5,))
        file.create_virtual_dataset("virtual", layout)
        file.create_group("group")
        for name, k in itertools.product(("plain", "virtual"), range(20)):
            file[name].attrs[f"note {k}"] = 50 * "-"  # the header goes on elsewhere
    with h5py.File(path) as file:
        found = {name: is_virtual(path, file, name) for name in (*file, "none")}
    assert found == {"chunked": False, "group": False, "none": False, "plain": False, "virtual": True}


# Breaks when rows that nothing in the file fills take memory: 8 GB here.
def test_hdf5_of_too_many_rows(fclib):
    with h5py.File(fclib, "a") as file:
        for name, value in (("m", 10**9), ("n", 10**9), ("nz", 0)):
            file[f"fclib_local/W/{name}"][...] = value
    refused(amontons.vi.read_problem, fclib, "1000000000 x 1000000000, but the file can hold vectors of")


def archive(path, **changes):
    arrays = dict(
        A_data=np.ones(6), A_indices=np.arange(6), A_indptr=np.arange(7), b=np.ones(6),
        cone_kinds=["friction", "bilateral"], cone_counts=[1, 3], mu=[0.1],
    )  # fmt: skip
    np.savez_compressed(path, **(arrays | changes))


# Breaks when an archive is read whose arrays do not fit each other: all of these were accepted once.
@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"A_indptr": -np.arange(7)}, "A_indptr must ascend from 0"),
        ({"A_indptr": np.arange(1, 8)}, "A_indptr must ascend from 0"),
        ({"A_indptr": [0, 1, 2, 3, 4, 5, 7]}, "A_indptr must ascend from 0"),
        ({"A_indices": np.full(6, 10**12)}, "whose entries must be 0 to 5"),
        ({"A_indices": -np.arange(6)}, "whose entries must be 0 to 5"),
        ({"cone_counts": [1]}, "'cone_counts' has 1 entries; it must have 2"),
        ({"cone_counts": [-1, 3]}, "cone_counts must be 0 to 6"),
        ({"cone_counts": [1, 2**62]}, "cone_counts must be 0 to 6"),
        ({"cone_counts": [1.0, 3.0]}, "must be a vector of integers"),
        ({"mu": [0.1, 0.2]}, "mu has 2 entries but the cones ask for 1"),
        ({"lo": [0.1]}, "lo has 1 entries but the cones ask for 0"),
        ({"mu": [np.nan]}, r"mu\[0\] is not finite"),
        ({"guesses": np.full((1, 6), np.nan)}, r"guesses\[0, 0\] is not finite"),
        ({"guesses": 3.0}, "guesses.0. has 1 entries but A has 6 rows"),
        ({"f": np.full(6, np.inf)}, r"f\[0\] is not finite"),
        ({"b": "text"}, "must hold real numbers"),
        ({"b": np.ones(6, complex)}, "has no header of an array of numbers"),
        ({"name": ["a", "b"]}, "'name' must be one text"),
    ],
)
def test_archive_whose_arrays_do_not_fit(changes, message, tmp_path):
    archive(tmp_path / "p.npz")
    amontons.vi.read_problem(tmp_path / "p.npz")
    archive(tmp_path / "p.npz", **changes)
    refused(amontons.vi.read_problem, tmp_path / "p.npz", message)


def with_member(path, data, name="b.npy", **options):
    archive(path)
    with zipfile.ZipFile(path) as file:
        members = {n: file.read(n) for n in file.namelist()}
    with zipfile.ZipFile(path, "w", **{"compression": zipfile.ZIP_DEFLATED, **options}) as file:
        for key, value in (members | {name: data}).items():
            file.writestr(key, value)


def npy(header, body=b"\0" * 48):
    text = header.encode() + b"\n"
    return b"\x93NUMPY\x01\0" + len(text).to_bytes(2, "little") + text + body


# Breaks when a header is believed or evaluated, or a member is unpacked without bound.
@pytest.mark.parametrize(
    ("header", "message"),
    [
        (
            "{'descr': '<f8', 'fortran_order': False, 'shape': (1000000000,), }",
            "which is not what its 48 bytes",
        ),
        (
            "{'descr': '<f8', 'fortran_order': False, 'shape': (2147483648, 2147483648, 4), }",
            "not what its 48",
        ),
        ("{'descr': '<f8', 'fortran_order': False, 'shape': (-6,), }", "has no header"),
        ("{'descr': '|O', 'fortran_order': False, 'shape': (6,), }", "has no header"),
        ("{'descr': '<f8', 'fortran_order': False, 'shape': (6,), 'x': " + "(" * 5000, "has no header"),
        ("-" * 9000 + "1", "has no header"),
    ],
)
def test_archive_of_forged_headers(header, message, tmp_path):
    with_member(tmp_path / "p.npz", npy("{'descr': '<f8', 'fortran_order': False, 'shape': (6,), }"))
    assert not amontons.vi.read_problem(tmp_path / "p.npz").b.any()
    with_member(tmp_path / "p.npz", npy(header))
    refused(amontons.vi.read_problem, tmp_path / "p.npz", message)


# Breaks when half a megabyte unpacks to half a gigabyte; when it stays refused to those who allow it.
def test_archive_that_is_a_bomb(tmp_path):
    buffer = io.BytesIO()
    np.save(buffer, np.zeros(4 * 10**7))
    with_member(tmp_path / "p.npz", buffer.getvalue())
    del buffer
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    refused(amontons.vi.read_problem, tmp_path / "p.npz", "declares 320 MB and stores 31")
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 64_000  # kB
    archive(tmp_path / "p.npz", b=np.zeros(10**6))
    refused(
        amontons.vi.read_problem, tmp_path / "p.npz", "beyond the limit of 1 MB", limits=Limits(memory=10**6)
    )


# Breaks when SciPy's reader comes back: it reads behind the end, and takes 4 GB for the second of these.
@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("coordinate real general\n6 6 1\n1 1 1.0e", "could not convert"),
        (
            "coordinate real general\n1000000000 1000000000 1\n1 1 1.0\n",
            "the archive beside it asks for 6 x 6",
        ),
        ("coordinate real general\n6 6 900000000\n1 1 1.0\n", "cannot be 2700000000 numbers"),
        ("coordinate real general\n6 6 1\n1 1 1.0 1\n", "has more numbers than the 3"),
        ("coordinate real general\n6 6 1\n0 1 1.0\n", "rows and columns count from 1 to 6"),
        ("coordinate real general\n6 6 1\n1.5 1 1.0\n", "rows and columns count from 1 to 6"),
        ("coordinate real general\n6 6 1\n1 1 nan\n", "is not finite"),
        ("coordinate real general\n6 6 1\n1 1 1_0\n", "is no number"),
        ("coordinate real general\n6 6\n", "must hold 3 integers"),
        ("coordinate complex general\n6 6 0\n", "must be real, integer or pattern"),
        ("coordinate real skew-symmetric\n6 6 0\n", "must be general or symmetric"),
        ("array real general\n6 6\n1\n", "cannot be 36 numbers"),
        ("spiral real general\n6 6\n1\n", "known are coordinate and array"),
    ],
)
def test_matrix_market_is_not_trusted(text, message, tmp_path):
    archive(tmp_path / "p.npz")
    path = tmp_path / "p.mtx"
    path.write_text("%%MatrixMarket matrix coordinate integer symmetric\n% x\n\n6 6 2\n1 1 2\n2 1 1\n")
    A = amontons.vi.read_problem(path).A.toarray()
    assert A[:2, :2].tolist() == [[2, 1], [1, 0]]
    path.write_text(f"%%MatrixMarket matrix {text}")
    refused(amontons.vi.read_problem, path, message)


# Breaks when a reader waits for the writer of a pipe, or reads a device that has no end.
@pytest.mark.parametrize(
    "read", [amontons.vi.read_problem, amontons.load_model, amontons.read_recording, amontons.Simulation.load]
)
def test_pipes_and_devices(read, tmp_path):
    suffix = ".xml" if read is amontons.load_model else ".h5"
    os.mkfifo(tmp_path / f"pipe{suffix}")
    refused(read, tmp_path / f"pipe{suffix}", "is no regular file")


# Breaks when a limit is something else than a positive integer.
@pytest.mark.parametrize("value", [0, -1, 1.5, "1", None, 2**70])
def test_limits_are_checked(value):
    with pytest.raises(amontons.InputError, match="limits: memory"):
        Limits(memory=value)
