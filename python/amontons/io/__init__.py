"""Files: problems (FCLIB HDF5, Matrix Market, NumPy archives), recordings, saved simulations, models."""

from __future__ import annotations

from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import FileError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from ..problem import Problem
    from ..simulation import Simulation
    from ..solution import Solution
    from .recording import Recorder
    from .recording_reader import Recording

HDF5 = (".hdf5", ".h5", ".hdf")
SUFFIXES = (*HDF5, ".mtx", ".npz")


def read_problem(path: str | PathLike[str]) -> Problem:
    """Read a problem from a file, in the row order and frame of the file.

    path: FCLIB (.hdf5, .h5), local (W q mu) or global (M H f w mu, bilateral G b), stored as triplet, CSC or
        CSR; Matrix Market (x.mtx with b, cones and mu in x.npz beside it); or x.npz alone.

    Rows are three per contact (normal, tangent 1, tangent 2; u_n > 0 separates), then the bilateral rows. A
    global problem in which every contact joins at most two bodies of six velocities becomes `Factored`; else
    W = H' M^-1 H is formed. A W that is unsymmetric by up to 1e-2 is symmetrised,
    with a SymmetrisedWarning and a note.

    Raises FileNotFoundError, or FileError naming the file and what is missing, malformed or unsupported.
    """
    path = Path(path)
    if path.is_dir():
        raise FileError(f"{path}: is a directory; give a problem file")
    if not path.exists():
        raise FileNotFoundError(f"{path}: no such file")
    if path.suffix.lower() in HDF5:
        from .fclib import read_fclib

        return read_fclib(path)
    if path.suffix.lower() in (".mtx", ".npz"):
        from .matrix_market import read_archive

        return read_archive(path)
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
    path = Path(path)
    if not path.parent.is_dir():
        raise FileError(f"{path}: the folder {path.parent} does not exist; make it first")
    suffix = path.suffix.lower()
    if suffix in HDF5:
        from .fclib_writer import write_fclib

        write_fclib(problem, path, solution=solution, storage=storage, form=form)
    elif suffix in (".mtx", ".npz"):
        from .matrix_market import write_archive

        if solution is not None:
            raise FileError(f"{path}: only FCLIB files hold a solution; write .hdf5, or leave solution out")
        write_archive(problem, path)
    else:
        raise FileError(f"{path}: unknown kind of file; known suffixes are {', '.join(SUFFIXES)}")


def record(
    path: str | PathLike[str],
    simulation: Simulation,
    *,
    every: int = 1,
    contacts: bool = True,
    source: str = "",
) -> Recorder:
    """Begin a recording of a simulation; `read_recording` reads it.

    with amontons.record("run.h5", sim) as recorder:
        while sim.time < 2:
            recorder.add(sim.step())

    path: appears when the block ends, whole; until then the frames go to a hidden file beside it, which only
        a killed process leaves behind. An exception ends the recording with what came before it, marked as
        not complete.
    every: states and contacts are recorded every so many steps, beginning with the state that the simulation
        is in now; reports of every step.
    contacts: whether contact tables are recorded, which take by far the most room.
    source: free text, where the model came from.

    Raises InputError, FileError if the file cannot be written.
    """
    from .recording import Recorder

    return Recorder(path, simulation, every=every, contacts=contacts, source=source)


def read_recording(path: str | PathLike[str]) -> Recording:
    """Open a recording; its arrays are read as they are indexed.

    Raises FileNotFoundError, or FileError naming the file and what is missing or damaged.
    """
    from .recording_reader import open_recording

    return open_recording(path)
