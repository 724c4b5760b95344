"""Writing FCLIB files."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import h5py
import numpy as np
import scipy.sparse as sp

from ...checks import Array, vector
from ...errors import FileError, InputError
from ...problem.cones import Bilateral, Friction, RollingFriction
from ...problem.operators import Contacts, Factored, block_diagonal
from ...problem.problem import Problem
from ...problem.solution import Solution
from ..files import write_whole
from ..hdf5 import hdf5_image, write_integer, write_matrix, write_text

STORAGES = ("csc", "csr", "triplet")
FORMS = ("auto", "global", "local")
REMEDY = "write the problem as .npz, which holds any product of cones"


def write_fclib(
    problem: Problem, path: Path, *, solution: Solution | Any | None, storage: str, form: str
) -> None:
    """Write the problem as an FCLIB file; see `Problem.write`."""
    if storage not in STORAGES:
        raise FileError(f"{path}: unknown storage {storage!r}; known are {', '.join(STORAGES)}")
    if form not in FORMS:
        raise FileError(f"{path}: unknown form {form!r}; known are {', '.join(FORMS)}")
    contact_rows = _contact_rows(problem, path)
    x = _impulses(problem, solution)
    A = problem.A.stored() if isinstance(problem.A, Contacts) else problem.A
    body_space = isinstance(A, Factored) and not A.compliance.any()
    if form == "global" and not body_space:
        raise FileError(
            f"{path}: the global form needs a factored operator without compliance; use form='local'"
        )
    with hdf5_image() as (file, image):
        if body_space and form != "local":
            _write_global(file, problem, A, contact_rows, storage, x)
        else:
            _write_local(file, problem, _matrix(A, path), contact_rows, storage, x)
    write_whole({path: image()})


def _contact_rows(problem: Problem, path: Path) -> int:
    """The number of rows in friction cones, which must be of one kind and come before the bilateral rows."""
    rows, bilateral = 0, False
    kinds = set()
    for cone in problem.cones:
        if cone.rows == 0:
            continue
        if isinstance(cone, Friction | RollingFriction):
            if bilateral:
                raise FileError(f"{path}: FCLIB holds friction cones before bilateral rows; {REMEDY}")
            kinds.add(cone.kind)
            rows += cone.rows
        elif isinstance(cone, Bilateral):
            bilateral = True
        else:
            raise FileError(f"{path}: FCLIB cannot hold {type(cone).__name__} rows; {REMEDY}")
    if len(kinds) > 1:
        raise FileError(f"{path}: FCLIB holds contacts with rolling friction or without, not both; {REMEDY}")
    return rows


def _group(file: h5py.File, problem: Problem, form: str) -> tuple[h5py.Group, h5py.Group]:
    """The group of the problem and its vectors, with what is the same in both forms."""
    rolling = [cone.rolling for cone in problem.cones if isinstance(cone, RollingFriction) and cone.n]
    g = file.create_group(f"fclib_{form}_rolling" if rolling else f"fclib_{form}")
    write_integer(g, "spacedim", 5 if rolling else 3)
    vectors = g.create_group("vectors")
    vectors.create_dataset("mu", data=problem.mu)
    if rolling:
        vectors.create_dataset("mu_r", data=np.concatenate(rolling))
    return g, vectors


def _impulses(problem: Problem, solution: Any) -> Array | None:
    if solution is None:
        return None
    x = solution.x if isinstance(solution, Solution) else vector("solution", solution)
    if len(x) != problem.rows:
        raise InputError(f"solution has {len(x)} entries but the problem has {problem.rows} rows")
    return x


def _matrix(A: Any, path: Path) -> sp.csr_array:
    if isinstance(A, Factored):
        return A.to_sparse()
    if isinstance(A, np.ndarray) or sp.issparse(A):
        return sp.csr_array(A)
    raise FileError(
        f"{path}: A is a function without a matrix; form the matrix, or use Factored, to write it"
    )


def _write_global(
    file: h5py.File, problem: Problem, A: Factored, contact_rows: int, storage: str, x: Array | None
) -> None:
    mass, scaling = _mass_matrix(A)
    D = sp.csr_array(A.jacobian() @ scaling)
    f = np.zeros(D.shape[1]) if problem.f is None else scaling.T @ problem.f
    # w and b are what is left of u at x = 0 without the free motion: D M^-1 f is part of problem.b.
    free = A.jacobian() @ (A.inverse_mass_matrix() @ problem.f) if problem.f is not None else 0.0
    w = problem.b - free
    g, vectors = _group(file, problem, "global")
    write_matrix(g, "M", mass, storage)
    write_matrix(g, "H", sp.csc_array(D[:contact_rows].T), storage)
    vectors.create_dataset("f", data=f)
    vectors.create_dataset("w", data=w[:contact_rows])
    if problem.rows > contact_rows:
        write_matrix(g, "G", sp.csc_array(D[contact_rows:].T), storage)
        vectors.create_dataset("b", data=w[contact_rows:])
    _write_info(g, problem)

    def velocity(impulses: Array) -> Array:
        return sp.linalg.spsolve(sp.csc_array(mass), D.T @ impulses + f) if len(f) else f

    _write_solutions(file, problem, contact_rows, x, velocity)


def _mass_matrix(A: Factored) -> tuple[sp.csr_array, sp.csr_array]:
    """M, and the change of coordinates S with D M^-1 D' = (D S) M_new^-1 (D S)'.

    S is the identity where the inverse mass of a body can be inverted. A body that is fixed in some direction
    has no finite mass: with M^-1 = S S' it gets unit masses and the rows D S, which vanish there.
    """
    n = A.bodies
    inverse = np.zeros((n, 6, 6))
    inverse[:] = _blocks(A.inverse_mass_matrix(), n)
    values, vectors = np.linalg.eigh(inverse) if n else (np.empty((0, 6)), np.empty((0, 6, 6)))
    translation, rotation = A.inverse_mass, np.linalg.eigvalsh(inverse[:, 3:, 3:]) if n else np.empty((0, 3))
    singular = (translation <= 0) | (rotation[:, 0] <= 1e-14 * rotation[:, -1])
    mass, scaling = np.tile(np.eye(6), (n, 1, 1)), np.tile(np.eye(6), (n, 1, 1))
    movable = ~singular
    diagonal = movable & ~np.any(inverse - inverse * np.eye(6), axis=(1, 2))
    mass[movable] = np.linalg.inv(inverse[movable])
    mass[movable] = (mass[movable] + mass[movable].transpose(0, 2, 1)) / 2
    mass[diagonal] = np.eye(6) / inverse[diagonal][:, range(6), range(6)][:, :, None]
    scaling[singular] = vectors[singular] * np.sqrt(np.maximum(values[singular], 0.0))[:, None, :]
    return block_diagonal(mass), block_diagonal(scaling)


def _blocks(matrix: sp.csr_array, n: int) -> Array:
    coo = sp.coo_array(matrix)
    blocks = np.zeros((n, 6, 6))
    blocks[coo.coords[0] // 6, coo.coords[0] % 6, coo.coords[1] % 6] = coo.data
    return blocks


def _write_local(
    file: h5py.File, problem: Problem, A: sp.csr_array, contact_rows: int, storage: str, x: Array | None
) -> None:
    c = contact_rows
    g, vectors = _group(file, problem, "local")
    write_matrix(g, "W", A[:c, :c], storage)
    vectors.create_dataset("q", data=problem.b[:c])
    if problem.rows > c:
        write_matrix(g, "V", A[:c, c:], storage)
        write_matrix(g, "R", A[c:, c:], storage)
        vectors.create_dataset("s", data=problem.b[c:])
    _write_info(g, problem)
    _write_solutions(file, problem, c, x, None)


def _write_info(g: h5py.Group, problem: Problem) -> None:
    info = g.create_group("info")
    write_text(info, "title", problem.name)
    write_text(info, "description", problem.description)
    write_text(info, "math_info", "")
    # Additions of ours, which other readers skip: without a law the problem of FCLIB is Coulomb's.
    write_text(info, "source", problem.source)
    write_text(info, "law", problem.law)


def _write_solutions(
    file: h5py.File, problem: Problem, contact_rows: int, x: Array | None, velocity: Any
) -> None:
    def write(group: h5py.Group, impulses: Array) -> None:
        u = problem._product(impulses) + problem.b
        if velocity is not None:
            group.create_dataset("v", data=velocity(impulses))
        group.create_dataset("u", data=u[:contact_rows])
        group.create_dataset("r", data=impulses[:contact_rows])
        if problem.rows > contact_rows:
            group.create_dataset("l", data=impulses[contact_rows:])

    if x is not None:
        write(file.create_group("solution"), x)
    if problem.guesses:
        guesses = file.create_group("guesses")
        write_integer(guesses, "number_of_guesses", len(problem.guesses))
        for k, guess in enumerate(problem.guesses):
            write(guesses.create_group(str(k + 1)), guess)
