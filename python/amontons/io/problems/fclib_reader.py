"""Reading FCLIB files (Acary, Bremond, Koziara, Perignon, INRIA RT-444, 2014)."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import scipy.sparse as sp

from ...checks import Array
from ...errors import FileError, SymmetrisedWarning
from ...limits import Limits
from ...problem.cones import Bilateral, Cone, Friction, RollingFriction
from ...problem.matrices import ASYMMETRY
from ...problem.problem import Problem
from ..files import told_at
from ..hdf5 import Reader, open_hdf5
from .body_space import delassus, factored
from .fclib_matrix import read_matrix

TOLERATED_ASYMMETRY = 1e-2
"""Files of real engines reach 2e-3; beyond 1e-2 of the largest entry the matrix is taken to be wrong."""


def read_fclib(path: Path, limits: Limits) -> Problem:
    """The problem of an FCLIB file; see `amontons.vi.read_problem`."""
    if not h5py.is_hdf5(path):
        raise FileError(
            f"{path}: is not an HDF5 file (its signature is missing); is it empty or of another kind?"
        )
    with told_at(path), open_hdf5(path, "an FCLIB file") as file:
        return _read(Reader(path, file, limits))


def _read(root: Reader) -> Problem:
    for kind in ("", "_rolling"):
        if root.has(f"fclib_global{kind}"):
            return _read_global(root, root.sub(f"fclib_global{kind}"), bool(kind))
        if root.has(f"fclib_local{kind}"):
            return _read_local(root, root.sub(f"fclib_local{kind}"), bool(kind))
    found = ", ".join(f"/{key}" for key in root.names()) or "nothing"
    raise root.fail(f"is no FCLIB file: it has neither /fclib_global nor /fclib_local but {found}")


def _read_global(root: Reader, g: Reader, rolling: bool) -> Problem:
    """M v = H r + G lambda + f, u = H'v + w, 0 = G'v + b: so A = D M^-1 D' with D' = [H G]."""
    _require_dimensions(g, rolling)
    M, H = read_matrix(g, "M"), read_matrix(g, "H")
    G = read_matrix(g, "G") if g.has("G") else sp.csr_array((M.shape[0], 0))
    if M.shape[0] != M.shape[1]:
        raise g.fail(f"M is {M.shape[0]} x {M.shape[1]}; it must be square")
    for key, matrix in (("H", H), ("G", G)):
        if matrix.shape[0] != M.shape[0]:
            raise g.fail(f"{key} has {matrix.shape[0]} rows but M has {M.shape[0]}")
    vectors = g.sub("vectors")
    contact_rows, cones = _cones(g, vectors, rolling, H.shape[1], f"H has {H.shape[1]} columns", G.shape[1])
    f = vectors.vector("f", M.shape[0])
    b = vectors.vector("w", contact_rows)
    if G.shape[1]:
        b = np.concatenate([b, vectors.vector("b", G.shape[1])])

    notes: list[str] = []
    D = sp.csr_array(sp.hstack([H, G]).T)
    found = factored(M, D, f, contact_rows, 5 if rolling else 3)
    if found is not None:
        A: Any = found.A
        f_kept: Array | None = found.f
        b = b + found.free_velocity
        if found.note:
            notes.append(found.note)
    else:
        A, free_velocity = delassus(M, D, f, root.limits)
        b, f_kept = b + free_velocity, None
        notes.append("M is not block-diagonal by bodies of six velocities: A = D M^-1 D' was formed")
        if (sp.triu(M, 1).nnz == 0 or sp.tril(M, -1).nnz == 0) and not _is_diagonal(M):
            notes.append("M has entries on one side of its diagonal only, and is taken as it stands")
        A = _symmetrised(root, "H' M^-1 H", A, notes)
    return _problem(root, g, A, b, cones, notes, f_kept)


def _read_local(root: Reader, g: Reader, rolling: bool) -> Problem:
    """u = W r + V lambda + q, 0 = V'r + R lambda + s: so A = [W V; V' R]."""
    _require_dimensions(g, rolling)
    W = read_matrix(g, "W")
    if W.shape[0] != W.shape[1]:
        raise g.fail(f"W is {W.shape[0]} x {W.shape[1]}; it must be square")
    bilateral = 0
    if g.has("V") or g.has("R"):
        V, R = read_matrix(g, "V"), read_matrix(g, "R")
        bilateral = R.shape[0]
        if R.shape != (bilateral, bilateral) or V.shape != (W.shape[0], bilateral):
            raise g.fail(f"W is {W.shape}, V {V.shape} and R {R.shape}; these do not fit together")
    vectors = g.sub("vectors")
    contact_rows, cones = _cones(g, vectors, rolling, W.shape[0], f"W has {W.shape[0]} rows", bilateral)
    b = vectors.vector("q", contact_rows)
    A = W
    if bilateral:
        b = np.concatenate([b, vectors.vector("s", bilateral)])
        A = sp.csr_array(sp.block_array([[W, V], [V.T, R]]))
    notes: list[str] = []
    A = _symmetrised(root, "W", A, notes)
    return _problem(root, g, A, b, cones, notes, None)


def _require_dimensions(g: Reader, rolling: bool) -> None:
    """Rows per contact: FCLIB counts rolling moments as dimensions."""
    spacedim, expected = g.integer("spacedim"), 5 if rolling else 3
    if spacedim != expected:
        raise g.fail(
            f"spacedim = {spacedim} is not supported; only three-dimensional contacts are, "
            f"whose spacedim is {expected} {'with' if rolling else 'without'} rolling friction"
        )


def _cones(
    g: Reader, vectors: Reader, rolling: bool, rows: int, found: str, bilateral: int
) -> tuple[int, list[Cone]]:
    """The number of rows of contacts, and the cones; found: which matrix says so."""
    block = 5 if rolling else 3
    if not rolling and vectors.has("mu_r"):
        raise g.fail(f"{vectors.name('mu_r')}: rolling friction belongs in the group {g.group.name}_rolling")
    if rows % block:
        parts = "normal, two tangents, two moments" if rolling else "normal and two tangents"
        raise g.fail(f"{found}, which is no multiple of {'five' if rolling else 'three'} ({parts})")
    coefficients = [vectors.vector(key, rows // block) for key in ("mu", "mu_r")[: 1 + rolling]]
    for key, values in zip(("mu", "mu_r"), coefficients, strict=False):
        negative = np.flatnonzero(values < 0)
        if negative.size:
            i = negative[0]
            raise g.fail(f"{vectors.name(key)}[{i}] = {values[i]:g}; it must not be negative")
    cones: list[Cone] = []
    if rows:
        cones.append(RollingFriction(*coefficients) if rolling else Friction(*coefficients))
    return rows, cones + ([Bilateral(bilateral)] if bilateral else [])


def _is_diagonal(matrix: sp.csr_array) -> bool:
    coo = sp.coo_array(matrix)
    return bool(np.all((coo.coords[0] == coo.coords[1]) | (coo.data == 0)))


def _symmetrised(root: Reader, name: str, A: Any, notes: list[str]) -> Any:
    """The symmetric part of A; with a warning where the difference is no rounding."""
    difference = abs(A - A.T)
    scale = abs(A).max() if min(A.shape) else 0.0
    asymmetry = float(difference.max() / scale) if scale > 0 else 0.0
    if asymmetry == 0:
        return A
    if not asymmetry <= TOLERATED_ASYMMETRY:
        raise root.fail(
            f"{name} is unsymmetric by {asymmetry:.1e} of its largest entry, more than "
            f"{TOLERATED_ASYMMETRY:g}: the file is wrong, or its problem has no symmetric matrix"
        )
    if asymmetry > ASYMMETRY:
        note = f"{name} was unsymmetric by {asymmetry:.1e} of its largest entry and was symmetrised"
        notes.append(note)
        warnings.warn(f"{root.path}: {note}", SymmetrisedWarning, stacklevel=6)
    symmetric = (A + A.T) / 2
    return sp.csr_array(symmetric) if sp.issparse(symmetric) else symmetric


def _problem(
    root: Reader, g: Reader, A: Any, b: Array, cones: list[Cone], notes: list[str], f: Array | None
) -> Problem:
    title = description = source = law = ""
    if g.has("info"):
        info = g.sub("info")
        title, description, source, law = map(info.text, ("title", "description", "source", "law"))
    contact_rows = sum(cone.rows for cone in cones if not isinstance(cone, Bilateral))
    return Problem(
        A,
        b,
        cones,
        name=title or root.path.stem,
        description=description,
        source=source or root.path.name,
        notes=notes,
        f=f,
        guesses=_guesses(root, contact_rows, len(b) - contact_rows),
        law=law or "coulomb",  # the problem of FCLIB
    )


def _guesses(root: Reader, contact_rows: int, bilateral: int) -> list[Array]:
    """The impulses of /guesses, then of /solution unless it is all zeros, as some writers leave it."""
    found: list[Array] = []
    if root.has("guesses"):
        guesses = root.sub("guesses")
        for k in range(guesses.integer("number_of_guesses")):
            found.append(_impulses(guesses.sub(str(k + 1)), contact_rows, bilateral))
    if root.has("solution"):
        x = _impulses(root.sub("solution"), contact_rows, bilateral)
        if x.any():
            found.append(x)
    return found


def _impulses(g: Reader, contact_rows: int, bilateral: int) -> Array:
    r = g.vector("r", contact_rows) if contact_rows else np.empty(0)
    if bilateral:
        r = np.concatenate([r, g.vector("l", bilateral)])
    return r
