"""Problems in files: FCLIB HDF5, Matrix Market, NumPy archives. Each format is imported when it is used."""

from __future__ import annotations

from os import PathLike
from typing import TYPE_CHECKING

from ...errors import FileError
from ...limits import DEFAULT, Limits
from ..files import existing, writable

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from ...problem.problem import Problem
    from ...problem.solution import Solution

HDF5 = (".hdf5", ".h5", ".hdf")
SUFFIXES = (*HDF5, ".mtx", ".npz")


def read_problem(path: str | PathLike[str], *, limits: Limits = DEFAULT) -> Problem:
    """Read a problem from a file, in the row order and frame of the file.

    path: FCLIB (.hdf5, .h5), local (W q mu) or global (M H f w mu, bilateral G b), stored as triplet, CSC or
        CSR, with rolling friction (mu_r) or without; Matrix Market (x.mtx with b, cones and mu in x.npz
        beside it); or x.npz alone, that of `Problem.write` or one of arrays W, q, mu (and mu_r).
    limits: what the file may ask for.

    Rows of FCLIB are three per contact (normal, tangent 1, tangent 2; u_n > 0 separates), five with rolling
    friction (moments about both tangents, N m s), then the bilateral rows. A
    global problem in which every contact joins at most two bodies of six velocities becomes `Factored`; else
    W = H' M^-1 H is formed. A W that is unsymmetric by up to 1e-2 is symmetrised,
    with a SymmetrisedWarning and a note.

    Raises FileNotFoundError, or FileError naming the file and what is missing, malformed or unsupported.

    >>> problem = vi.read_problem(examples.path("wall_impact.hdf5"))
    >>> problem.law
    'coulomb'
    """
    path = existing(path, "a problem file")
    if path.suffix.lower() in HDF5:
        from .fclib_reader import read_fclib

        return read_fclib(path, limits)
    if path.suffix.lower() in (".mtx", ".npz"):
        from .archive import read_archive

        return read_archive(path, limits)
    raise FileError(f"{path}: unknown kind of file; known suffixes are {', '.join(SUFFIXES)}")


def write_problem(
    problem: Problem,
    path: str | PathLike[str],
    *,
    solution: Solution | ArrayLike | None = None,
    storage: str = "csc",
    form: str = "auto",
) -> None:
    """See `Problem.write`."""
    path = writable(path)
    suffix = path.suffix.lower()
    if suffix in HDF5:
        from .fclib_writer import write_fclib

        write_fclib(problem, path, solution=solution, storage=storage, form=form)
    elif suffix in (".mtx", ".npz"):
        from .archive import write_archive

        if solution is not None:
            raise FileError(f"{path}: only FCLIB files hold a solution; write .hdf5, or leave solution out")
        write_archive(problem, path)
    else:
        raise FileError(f"{path}: unknown kind of file; known suffixes are {', '.join(SUFFIXES)}")
