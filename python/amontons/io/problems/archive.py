"""Matrix Market with a NumPy archive beside it, or the archive alone: any product of cones round-trips.

Read as well: archives of W, q, mu, and mu_r of rolling friction, the names of a local FCLIB problem.
"""

from __future__ import annotations

import io
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import scipy.io
import scipy.sparse as sp

from ...checks import finite, reals
from ...errors import FileError
from ...limits import Limits
from ...problem.cones import (
    Bilateral,
    Cone,
    EllipticFriction,
    Friction,
    Interval,
    NonNegative,
    PlanarFriction,
    RollingFriction,
)
from ...problem.operators import Contacts, Factored
from ...problem.problem import Problem
from ..files import told_at, write_whole
from . import matrix_market
from .npz import Archive

ELLIPTIC = {"elliptic-3": 2, "elliptic-4": 3, "elliptic-6": 5}
"""How many of the columns of `elliptic` a cone of a kind has: mu, mu across, torsion, rolling about both."""
FACTORED = (
    "inverse_mass",
    "inverse_inertia",
    "body_a",
    "body_b",
    "jacobian_a",
    "jacobian_b",
    "compliance",
)


def read_archive(path: Path, limits: Limits) -> Problem:
    """The problem of x.npz, or of x.mtx with the rest in x.npz beside it."""
    beside = path.with_suffix(".npz")
    if not beside.is_file():
        raise FileError(
            f"{path}: b and the cones are expected in {beside.name} beside it, which does not exist"
        )
    entries = Archive(beside, limits)
    with told_at(path):
        b = entries.real("q" if _is_local(entries) else "b")
        matrix = path.suffix.lower() == ".mtx"
        A = matrix_market.read(path, b.size, limits) if matrix else _stored_matrix(beside, entries)
        return Problem(
            A,
            b,
            _stored_cones(beside, entries, A.shape[0]),
            name=entries.text("name") or path.stem,
            description=entries.text("description"),
            source=entries.text("source"),
            f=_finite(entries, "f") if "f" in entries else None,
            guesses=list(np.atleast_2d(_finite(entries, "guesses"))) if "guesses" in entries else (),
            law=entries.text("law") or "coulomb",
        )


def _is_local(entries: Archive) -> bool:
    return "W" in entries and "q" in entries and "b" not in entries


def _finite(entries: Archive, key: str) -> np.ndarray:
    return finite(key, reals(key, entries.real(key)))


def _stored_matrix(archive: Path, entries: Archive) -> Any:
    if "A_dense" in entries or _is_local(entries):
        name = "A_dense" if "A_dense" in entries else "W"
        matrix = entries.real(name)
        if matrix.ndim != 2:
            raise FileError(
                f"{archive}: the array {name!r} has the shape {matrix.shape}; it must be a matrix"
            )
        return matrix
    if "inverse_mass" in entries:
        arrays = {key: entries.real(key) for key in FACTORED}
        return Factored(**{**arrays, "inverse_inertia": _unpacked(arrays["inverse_inertia"])})
    data, indices, indptr = (
        entries.real("A_data"),
        *(entries.integers(f"A_{k}") for k in ("indices", "indptr")),
    )
    m = len(indptr) - 1
    if m < 0 or indptr[0] != 0 or np.any(indptr[1:] < indptr[:-1]) or indptr[-1] != len(indices):
        raise FileError(
            f"{archive}: A_data, A_indices, A_indptr are no matrix of {m} rows: A_indptr must ascend from 0 "
            f"to the number of entries, {len(indices)}"
        )
    if data.shape != indices.shape or np.any((indices < 0) | (indices >= m)):
        raise FileError(
            f"{archive}: A_data, A_indices, A_indptr are no matrix of {m} rows: A_data has the shape "
            f"{data.shape}, A_indices {indices.shape}, whose entries must be 0 to {m - 1}"
        )
    return sp.csr_array((data, indices, indptr), shape=(m, m))


def _unpacked(six: np.ndarray) -> np.ndarray:
    if six.ndim != 2 or six.shape[1] != 6:
        return six
    return six[:, [0, 3, 4, 3, 1, 5, 4, 5, 2]].reshape(-1, 3, 3)


def _stored_cones(archive: Path, entries: Archive, rows: int) -> list[Cone]:
    """The runs of cones; an archive without them but with mu holds friction cones only."""
    if "cone_kinds" not in entries:
        if "mu" not in entries:
            raise FileError(
                f"{archive}: neither 'cone_kinds' and 'cone_counts' nor 'mu' says what the cones are"
            )
        mu = entries.real("mu")
        if "mu_r" in entries:
            return [RollingFriction(mu, entries.real("mu_r"), n=rows // 5)]
        return [Friction(np.full(rows // 3, mu) if mu.ndim == 0 else mu)]
    kinds = entries.words("cone_kinds")
    counts = entries.integers("cone_counts", len(kinds)).tolist()
    if min(counts, default=0) < 0 or max(counts, default=0) > rows:
        raise FileError(f"{archive}: cone_counts must be 0 to {rows}, the rows of A")
    used = dict.fromkeys(("mu", "mu_r", "elliptic", "lo", "hi"), 0)

    def take(key: str, count: int) -> np.ndarray:
        """The next entries of an array that belongs to all cones of a kind."""
        used[key] += count
        return np.atleast_1d(entries.real(key))[used[key] - count : used[key]]

    cones = [_stored_cone(archive, kind, n, take) for kind, n in zip(kinds, counts, strict=True)]
    for key, count in used.items():
        if key in entries and len(np.atleast_1d(entries.real(key))) != count:
            found = len(np.atleast_1d(entries.real(key)))
            raise FileError(f"{archive}: {key} has {found} entries but the cones ask for {count}")
    return cones


def _stored_cone(archive: Path, kind: str, count: int, take: Callable[[str, int], np.ndarray]) -> Cone:
    if kind in ("bilateral", "nonnegative"):
        return Bilateral(count) if kind == "bilateral" else NonNegative(count)
    if kind == "interval":
        return Interval(take("lo", count), take("hi", count))
    if kind == "friction":
        return Friction(take("mu", count))
    if kind == "planar":
        return PlanarFriction(take("mu", count), n=count)
    if kind == "rolling":
        return RollingFriction(take("mu", count), take("mu_r", count), n=count)
    if kind in ELLIPTIC:
        take("mu", count)
        table = take("elliptic", count)
        if table.ndim != 2 or table.shape[1] != 5:
            raise FileError(
                f"{archive}: the array 'elliptic' has shape {table.shape}; it must be (contacts, 5)"
            )
        width = ELLIPTIC[kind]
        torsion, rolling = table[:, 2] if width > 2 else None, table[:, 3:] if width > 3 else None
        return EllipticFriction(table[:, :2], torsion, rolling, n=count)
    known = ", ".join(("bilateral", "nonnegative", "interval", "friction", "planar", "rolling", *ELLIPTIC))
    raise FileError(f"{archive}: unknown cone {kind!r}; known are {known}")


def write_archive(problem: Problem, path: Path) -> None:
    """Write x.npz, and with a path x.mtx the matrix there."""
    entries = _cone_entries(problem)
    entries["b"] = problem.b
    for key in ("name", "description", "source", "law"):
        entries[key] = np.array(getattr(problem, key))
    if problem.f is not None:
        entries["f"] = problem.f
    if problem.guesses:
        entries["guesses"] = np.array(problem.guesses)
    archive = path.with_suffix(".npz")
    if path.suffix.lower() == ".npz":
        write_whole({archive: _compressed(entries | _matrix_entries(problem.A, path))})
        return
    text = io.BytesIO()
    scipy.io.mmwrite(text, _explicit(problem.A, path), symmetry="symmetric", precision=17)
    write_whole({archive: _compressed(entries), path: text.getbuffer()}, own={archive})


def _compressed(entries: dict[str, Any]) -> memoryview:
    data = io.BytesIO()
    np.savez_compressed(data, **entries)
    return data.getbuffer()


def _cone_entries(problem: Problem) -> dict[str, Any]:
    cones = problem.cones
    bounded = [cone for cone in cones if isinstance(cone, Interval)]
    rolling = [cone for cone in cones if isinstance(cone, RollingFriction)]
    elliptic = [cone for cone in cones if isinstance(cone, EllipticFriction)]
    empty = [np.empty(0)]
    entries: dict[str, Any] = {
        "cone_kinds": np.array([cone.kind for cone in cones], dtype="U11"),
        "cone_counts": np.array([cone.n for cone in cones], dtype=np.int64),
        "mu": problem.mu,
        "lo": np.concatenate(empty + [np.asarray(cone.lo) for cone in bounded]),
        "hi": np.concatenate(empty + [np.asarray(cone.hi) for cone in bounded]),
    }
    if rolling:
        entries["mu_r"] = np.concatenate([cone.rolling for cone in rolling])
    if elliptic:
        tables = [np.stack(cone.parameters, axis=1) for cone in elliptic]
        entries["elliptic"] = np.concatenate([np.pad(t, ((0, 0), (0, 5 - t.shape[1]))) for t in tables])
    return entries


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
