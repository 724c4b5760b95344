"""Matrix Market with a NumPy archive beside it, or the archive alone: any product of cones round-trips."""

from __future__ import annotations

import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import scipy.io
import scipy.sparse as sp

from ...errors import FileError, InputError
from ...problem.cones import Cone, Free, Friction, Interval, NonNegative
from ...problem.operators import Contacts, Factored
from ...problem.problem import Problem
from ..files import replacing

KINDS: tuple[type[Cone], ...] = (Free, NonNegative, Interval, Friction)
FACTORED = (
    "inverse_mass",
    "inverse_inertia",
    "body_a",
    "body_b",
    "jacobian_a",
    "jacobian_b",
    "compliance",
)


def read_archive(path: Path) -> Problem:
    """The problem of x.npz, or of x.mtx with the rest in x.npz beside it."""
    archive = path.with_suffix(".npz")
    if not archive.exists():
        raise FileError(
            f"{path}: b and the cones are expected in {archive.name} beside it, which does not exist"
        )
    entries = _load(archive)
    try:
        A = _read_matrix(path) if path.suffix.lower() == ".mtx" else _stored_matrix(archive, entries)
        return Problem(
            A,
            _entry(archive, entries, "b"),
            _stored_cones(archive, entries, A.shape[0]),
            name=_text(entries, "name") or path.stem,
            description=_text(entries, "description"),
            source=_text(entries, "source"),
            f=entries.get("f"),
            guesses=list(entries["guesses"]) if "guesses" in entries else (),
        )
    except FileError:
        raise
    except InputError as error:
        raise FileError(f"{path}: {error}") from None


def _load(archive: Path) -> dict[str, np.ndarray]:
    try:
        with np.load(archive, allow_pickle=False) as file:
            if isinstance(file, np.ndarray):
                raise ValueError("it holds one array without a name")
            return {key: file[key] for key in file.files}
    except (OSError, ValueError, zipfile.BadZipFile, EOFError, AttributeError) as error:
        raise FileError(f"{archive}: is no NumPy archive of a problem, or is truncated ({error})") from None


def _entry(archive: Path, entries: dict[str, np.ndarray], key: str) -> np.ndarray:
    if key not in entries:
        found = ", ".join(entries) or "nothing"
        raise FileError(f"{archive}: the array {key!r} is missing; it holds {found}")
    return entries[key]


def _text(entries: dict[str, np.ndarray], key: str) -> str:
    return str(entries[key]) if key in entries else ""


def _read_matrix(path: Path) -> Any:
    try:
        matrix = scipy.io.mmread(path, spmatrix=False)
    except (OSError, ValueError, TypeError, OverflowError) as error:
        raise FileError(f"{path}: is no Matrix Market file, or is truncated ({error})") from None
    return matrix


def _stored_matrix(archive: Path, entries: dict[str, np.ndarray]) -> Any:
    if "A_dense" in entries:
        return entries["A_dense"]
    if "inverse_mass" in entries:
        arrays = {key: _entry(archive, entries, key) for key in FACTORED}
        return Factored(**{**arrays, "inverse_inertia": _unpacked(arrays["inverse_inertia"])})
    data, indices, indptr = (_entry(archive, entries, f"A_{key}") for key in ("data", "indices", "indptr"))
    m = len(indptr) - 1
    try:
        matrix = sp.csr_array((data, indices, indptr), shape=(m, m))
        matrix.check_format(full_check=True)
    except ValueError as error:
        raise FileError(
            f"{archive}: A_data, A_indices, A_indptr are no matrix of {m} rows ({error})"
        ) from None
    return matrix


def _unpacked(six: np.ndarray) -> np.ndarray:
    if six.ndim != 2 or six.shape[1] != 6:
        return six
    return six[:, [0, 3, 4, 3, 1, 5, 4, 5, 2]].reshape(-1, 3, 3)


def _stored_cones(archive: Path, entries: dict[str, np.ndarray], rows: int) -> list[Cone]:
    """The runs of cones; an archive without them but with mu holds friction cones only."""
    mu = entries.get("mu", np.empty(0))
    if "cone_kinds" not in entries:
        if "mu" not in entries:
            raise FileError(
                f"{archive}: neither 'cone_kinds' and 'cone_counts' nor 'mu' says what the cones are"
            )
        return [Friction(np.full(rows // 3, mu) if mu.ndim == 0 else mu)]
    cones: list[Cone] = []
    contacts = bounded = 0
    counts = _entry(archive, entries, "cone_counts")
    for kind, count in zip(entries["cone_kinds"].tolist(), counts.tolist(), strict=False):
        if kind == "friction":
            cones.append(Friction(mu[contacts : contacts + count]))
            contacts += count
        elif kind == "interval":
            lo, hi = _entry(archive, entries, "lo"), _entry(archive, entries, "hi")
            cones.append(Interval(lo[bounded : bounded + count], hi[bounded : bounded + count]))
            bounded += count
        elif kind in ("free", "nonnegative"):
            cones.append(Free(count) if kind == "free" else NonNegative(count))
        else:
            raise FileError(
                f"{archive}: unknown cone {kind!r}; known are free, nonnegative, interval, friction"
            )
    return cones


def write_archive(problem: Problem, path: Path) -> None:
    """Write x.npz, and with a path x.mtx the matrix there."""
    entries = _cone_entries(problem)
    entries["b"] = problem.b
    for key in ("name", "description", "source"):
        entries[key] = np.array(getattr(problem, key))
    if problem.f is not None:
        entries["f"] = problem.f
    if problem.guesses:
        entries["guesses"] = np.array(problem.guesses)
    archive = path.with_suffix(".npz")
    if path.suffix.lower() == ".npz":
        with replacing(archive) as (new,):
            np.savez_compressed(new, **entries, **_matrix_entries(problem.A, path))
        return
    matrix = _explicit(problem.A, path)
    with replacing(archive, path) as (new_archive, new_matrix):
        np.savez_compressed(new_archive, **entries)
        scipy.io.mmwrite(new_matrix, matrix, symmetry="symmetric", precision=17)


def _cone_entries(problem: Problem) -> dict[str, Any]:
    cones = problem.cones
    names = {Free: "free", NonNegative: "nonnegative", Interval: "interval", Friction: "friction"}
    bounded = [cone for cone in cones if isinstance(cone, Interval)]
    empty = [np.empty(0)]
    return {
        "cone_kinds": np.array([names[type(cone)] for cone in cones], dtype="U11"),
        "cone_counts": np.array(
            [cone.n if isinstance(cone, Friction) else cone.rows for cone in cones], dtype=np.int64
        ),
        "mu": problem.mu,
        "lo": np.concatenate(empty + [np.asarray(cone.lo) for cone in bounded]),
        "hi": np.concatenate(empty + [np.asarray(cone.hi) for cone in bounded]),
    }


def _matrix_entries(A: Any, path: Path) -> dict[str, Any]:
    if isinstance(A, Contacts):
        A = A.stored()
    if isinstance(A, Factored):
        return {key: getattr(A, key) for key in FACTORED}
    if isinstance(A, np.ndarray):
        return {"A_dense": A}
    matrix = _explicit(A, path)
    return {"A_data": matrix.data, "A_indices": matrix.indices, "A_indptr": matrix.indptr}


def _explicit(A: Any, path: Path) -> Any:
    if isinstance(A, Factored | Contacts):
        return A.to_sparse()
    if isinstance(A, np.ndarray) or sp.issparse(A):
        return A if sp.issparse(A) else sp.coo_array(A)
    raise FileError(
        f"{path}: A is a function without a matrix; form the matrix, or use Factored, to write it"
    )
