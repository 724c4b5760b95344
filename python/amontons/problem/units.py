"""One unit per block for the core: moments over a length, spins times it.

A block of the core has one number P, the mean of its diag(A), as step and as weight in the residual. Where a
block has moments beside forces that mean says little of either, so that the problem changes units at the
border: with S = diag(1 for forces, l for moments), l of each block in m,

    x = S x_core,   u = S^-1 u_core,   A_core = S A S,   b_core = S b,   and coefficients in m over l.

The set keeps its form, <x, u> its value. l^2 is the mean of diag(A) of the forces of the block over that of
its moments: both become alike, and the residual does not change with the unit of length.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from .. import _core
from ..checks import Array
from . import matrices
from .cones import Cone
from .operators import Contacts, Factored, balanced_length


def scale_of(A: matrices.Matrix, cones: Iterable[Cone]) -> Array | None:
    """S for the rows of A, (m,), or None where no cone has moments. `Contacts` know their lengths."""
    if isinstance(A, Contacts):
        return A.moment_scale()
    listed = [cone for cone in cones if cone.n]
    if not any(cone.moments for cone in listed):
        return None
    diagonal, scale, row = matrices.diagonal(A), np.ones(A.shape[0]), 0
    for cone in listed:
        if cone.moments:
            blocks = slice(row, row + cone.rows)
            parts = diagonal[blocks].reshape(cone.n, -1)
            length = balanced_length(parts[:, :3].mean(axis=1), parts[:, 3:].mean(axis=1))
            scale[blocks].reshape(parts.shape)[:, 3:] = length[:, None]
        row += cone.rows
    return scale


def scaled(A: matrices.Matrix, S: Array | None) -> _core.Operator:
    """The core's operator for S A S."""
    if S is None or isinstance(A, Contacts):
        return matrices.to_core(A)
    if isinstance(A, Factored):
        rows = {
            "jacobian_a": A.jacobian_a * S[:, None],
            "jacobian_b": A.jacobian_b * S[:, None],
            "compliance": A.compliance * S**2,
        }
        return Factored.from_arrays({**vars(A), **rows, "_core_operator": None}).to_core()
    if isinstance(A, np.ndarray):
        return _core.dense_operator(A * (S[:, None] * S))
    import scipy.sparse as sp

    if isinstance(A, sp.csr_array):
        entries = A.data * (np.repeat(S, np.diff(A.indptr)) * S[A.indices])
        return _core.sparse_operator(A.indptr, A.indices, entries)
    return matrices.function_to_core(A, S)
