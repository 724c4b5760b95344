"""From M, H, G of a global problem to the factored operator of bodies; or to A where there are no bodies."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg

from ...checks import Array
from ...errors import InputError
from ...limits import Limits, readable
from ...problem.matrices import ASYMMETRY
from ...problem.operators import Factored, block_diagonal


@dataclass(frozen=True)
class BodySpace:
    """A factored operator with the vectors that go with it."""

    A: Factored
    f: Array
    """(6 n,) the generalised impulse in the coordinates of A"""
    free_velocity: Array
    """(m,) D M^-1 f"""
    note: str


def factored(M: sp.csr_array, D: sp.csr_array, f: Array, contact_rows: int, block: int) -> BodySpace | None:
    """A = D M^-1 D' in body space, or None unless M is symmetric and block-diagonal by six, and every contact
    (`block` rows) and every other row of D touches at most two of its blocks.

    M: (6 n, 6 n). D: (m, 6 n), the rows of contacts first. f: (6 n,).
    """
    blocks = _mass_blocks(M)
    if blocks is None:
        return None
    D = sp.csr_array(D)
    D.eliminate_zeros()
    pairs = _bodies_of_rows(D, contact_rows, block, len(blocks))
    if pairs is None:
        return None
    _require_positive_definite(blocks)
    note = ""
    if _is_mass_and_inertia(blocks):
        inverse_mass, inverse_inertia = 1.0 / blocks[:, 0, 0], _inverse_inertias(blocks[:, 3:, 3:])
    else:
        # With M = L L' per body, velocities L'v have unit masses: D M^-1 D' = (D L^-T) (D L^-T)'.
        inverse_L = np.linalg.inv(np.linalg.cholesky(blocks))
        transform = block_diagonal(inverse_L)
        D, f = sp.csr_array(D @ transform.T), transform @ f
        inverse_mass, inverse_inertia = np.ones(len(blocks)), np.ones((len(blocks), 3))
        note = "M couples velocities within bodies: body coordinates were changed to unit masses (exact)"
    a, b = pairs
    A = Factored(inverse_mass, inverse_inertia, a, b, *_dense_rows(D, a, b))
    return BodySpace(A, f, D @ (A.inverse_mass_matrix() @ f), note)


def _mass_blocks(M: sp.csr_array) -> Array | None:
    """(n, 6, 6) diagonal blocks, or None if M has other entries or is unsymmetric."""
    if M.shape[0] % 6:
        return None
    coo = sp.coo_array(M)
    used = coo.data != 0
    rows, columns, values = coo.coords[0][used], coo.coords[1][used], coo.data[used]
    if np.any(rows // 6 != columns // 6):
        return None
    blocks = np.zeros((M.shape[0] // 6, 6, 6))
    np.add.at(blocks, (rows // 6, rows % 6, columns % 6), values)
    skew = np.abs(blocks - blocks.transpose(0, 2, 1)).max(initial=0.0)
    return blocks if skew <= ASYMMETRY * np.abs(blocks).max(initial=0.0) else None


def _bodies_of_rows(
    D: sp.csr_array, contact_rows: int, block: int, bodies: int
) -> tuple[Array, Array] | None:
    """The two bodies of every row (-1 for none), the lower index first, or None if a row has more."""
    m = D.shape[0]
    rows = np.repeat(np.arange(m), np.diff(D.indptr))
    # The rows of a contact count together; every other row is a group of its own.
    contacts = contact_rows // block
    of_joints = np.arange(m) - contact_rows + contacts
    group_of_row = np.where(np.arange(m) < contact_rows, np.arange(m) // block, of_joints)
    keys = np.unique(group_of_row[rows] * max(bodies, 1) + D.indices // 6)
    groups, touched = keys // max(bodies, 1), keys % max(bodies, 1)
    group_count = m - contact_rows + contacts
    counts = np.bincount(groups, minlength=group_count)
    if counts.max(initial=0) > 2:
        return None
    first = np.concatenate([[0], np.cumsum(counts)])[:-1]
    a, b = np.full(group_count, -1), np.full(group_count, -1)
    a[counts >= 1] = touched[first[counts >= 1]]
    b[counts == 2] = touched[first[counts == 2] + 1]
    return a[group_of_row].astype(np.int32), b[group_of_row].astype(np.int32)


def _dense_rows(D: sp.csr_array, a: Array, b: Array) -> tuple[Array, Array]:
    rows = np.repeat(np.arange(D.shape[0]), np.diff(D.indptr))
    body, column = D.indices // 6, D.indices % 6
    jacobian_a, jacobian_b = np.zeros((D.shape[0], 6)), np.zeros((D.shape[0], 6))
    on_a = body == a[rows]
    jacobian_a[rows[on_a], column[on_a]] = D.data[on_a]
    jacobian_b[rows[~on_a], column[~on_a]] = D.data[~on_a]
    return jacobian_a, jacobian_b


def _require_positive_definite(blocks: Array) -> None:
    # Scaled to unit diagonals, so that kg and kg m^2 compare.
    diagonal = blocks[:, range(6), range(6)]
    wrong = np.flatnonzero(np.any(diagonal <= 0, axis=1))
    if not wrong.size:
        scale = 1.0 / np.sqrt(diagonal)
        scaled = blocks * scale[:, :, None] * scale[:, None, :]
        wrong = np.flatnonzero(np.linalg.eigvalsh(scaled)[:, 0] <= 1e-14) if len(blocks) else wrong
    if wrong.size:
        i = wrong[0]
        raise InputError(f"M is not positive definite: its block of body {i} (rows {6 * i} to {6 * i + 5})")


def _is_mass_and_inertia(blocks: Array) -> bool:
    mass = blocks[:, 0, 0]
    translation = blocks[:, :3, :3] - mass[:, None, None] * np.eye(3)
    return not (translation.any() or blocks[:, :3, 3:].any() or blocks[:, 3:, :3].any())


def _inverse_inertias(inertia: Array) -> Array:
    off_diagonal = inertia - inertia * np.eye(3)
    if not off_diagonal.any():
        return 1.0 / inertia[:, range(3), range(3)]
    inverse = np.linalg.inv(inertia)
    return (inverse + inverse.transpose(0, 2, 1)) / 2


def delassus(
    M: sp.csr_array, D: sp.csr_array, f: Array, limits: Limits
) -> tuple[Array | sp.csr_array, Array]:
    """A = D M^-1 D' and D M^-1 f for any invertible M; A is sparse where less than a third is filled."""
    if M.shape[0] == 0:
        return sp.csr_array((D.shape[0], D.shape[0])), np.zeros(D.shape[0])
    try:
        solve = scipy.sparse.linalg.splu(sp.csc_array(M)).solve
    except RuntimeError:
        raise InputError("M is singular; the mass matrix must be positive definite") from None
    if np.any(M.diagonal() <= 0):
        i = int(np.flatnonzero(M.diagonal() <= 0)[0])
        raise InputError(f"M is not positive definite: M[{i}, {i}] = {M.diagonal()[i]:g}")
    columns, taken, width = [], 0, 256
    for start in range(0, D.shape[0], width):
        right = D[start : start + width].T.toarray()
        columns.append(sp.csc_array(D @ solve(right)))
        taken += 12 * columns[-1].nnz
        if taken > limits.memory:
            raise InputError(
                f"A = D M^-1 D' of {D.shape[0]} rows takes more than the limit of {readable(limits.memory)}; "
                "raise it with limits=amontons.Limits(memory=...)"
            )
    A = sp.csr_array(sp.hstack(columns)) if columns else sp.csr_array((0, 0))
    dense = A.nnz > A.shape[0] * A.shape[1] / 3
    return (A.toarray() if dense else A), D @ solve(f)
