"""User input for A, converted to the form that the core reads without copying."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Protocol, runtime_checkable

import numpy as np

from .. import _core
from ..checks import reals, vector
from ..errors import InputError
from .operators import Contacts, Factored

if TYPE_CHECKING:
    import scipy.sparse as sp

ASYMMETRY: float = _core.ASYMMETRY
"""|A - A'| / max |A| up to which a matrix counts as symmetric: above it the difference is no rounding."""


@runtime_checkable
class LinearMap(Protocol):
    """Anything with a shape and y = A x, such as scipy.sparse.linalg.LinearOperator.

    An optional method diagonal() gives diag(A), (m,), for the preconditioner; without it P = I.
    """

    shape: tuple[int, int]

    def matvec(self, x: Any, /) -> Any: ...


Matrix = Any
"""sp.csr_array | np.ndarray | Factored | Contacts | LinearMap; type checkers do not see SciPy's types."""


def canonical(A: Any) -> Matrix:
    """A as a CSR array, a dense float64 array, Factored, Contacts or a linear map.

    A CSC matrix becomes CSR on the same values (A is symmetric), CSR and dense float64 arrays keep theirs;
    indices are copied, so that nobody can change them. Other formats and number types are converted. Raises
    InputError for anything that is no real, square matrix; that it is symmetric is checked where the core
    makes a problem of it.
    """
    import scipy.sparse as sp  # takes as long to import as all the rest

    if isinstance(A, Factored | Contacts):
        return A
    if sp.issparse(A):
        return _sparse(A)
    if hasattr(A, "matvec") and hasattr(A, "shape"):
        _require_square(A.shape)
        return A
    if isinstance(A, np.ndarray | list | tuple):
        return _dense(reals("A", A) if not isinstance(A, np.ndarray) else A)
    raise InputError(
        f"A is a {type(A).__name__}; give a SciPy sparse matrix, a NumPy array, a LinearOperator, "
        "amontons.vi.Factored or amontons.vi.Contacts"
    )


def _require_square(shape: tuple[int, ...]) -> None:
    if len(shape) != 2 or shape[0] != shape[1]:
        raise InputError(f"A has shape {tuple(shape)}; it must be square")


def _require_real(dtype: np.dtype[Any]) -> None:
    if dtype.kind not in "fiub":
        raise InputError(f"A has entries of type {dtype}; they must be real numbers")


def _dense(A: np.ndarray) -> np.ndarray:
    _require_square(A.shape)
    _require_real(A.dtype)
    if A.flags.f_contiguous and not A.flags.c_contiguous:
        A = A.T  # the same matrix, since A is symmetric
    return np.ascontiguousarray(A, dtype=np.float64)


def _sparse(A: Any) -> sp.csr_array:
    import scipy.sparse as sp

    _require_square(A.shape)
    _require_real(A.dtype)
    if A.format in ("csc", "csr", "bsr"):
        _require_pointers(A)
    if A.format in ("csc", "csr"):
        parts = (A.data, A.indices, A.indptr)
        matrix = sp.csr_array(parts, shape=A.shape)
    else:
        matrix = sp.csr_array(A)
    if matrix.nnz > np.iinfo(np.int32).max:
        raise InputError(
            f"A has {matrix.nnz} entries, more than 32-bit indices reach; use amontons.vi.Factored"
        )
    if not matrix.has_canonical_format:
        matrix = matrix.copy()
        matrix.sum_duplicates()
    # Values are those of the caller, who may write numbers into them; where they stand is ours, checked once:
    # a wrong index would lead the core and SciPy out of the arrays.
    indices, indptr = (np.array(part, dtype=np.int32) for part in (matrix.indices, matrix.indptr))
    indices.flags.writeable = indptr.flags.writeable = False
    parts = (np.ascontiguousarray(matrix.data, dtype=np.float64), indices, indptr)
    return sp.csr_array(parts, shape=matrix.shape)


def _require_pointers(A: Any) -> None:
    """InputError for pointers and indices that lead out of the arrays, which SciPy itself follows."""
    size = A.shape[0] // (A.blocksize[0] if A.format == "bsr" else 1)
    pointers, indices = np.asarray(A.indptr), np.asarray(A.indices)
    if pointers.dtype.kind not in "iu" or indices.dtype.kind not in "iu":
        raise InputError("A.indptr and A.indices must hold integers")
    if pointers.shape != (size + 1,) or pointers[0] != 0 or (pointers[1:] < pointers[:-1]).any():
        raise InputError(f"A.indptr must have {size + 1} entries that ascend from 0")
    stored = min(len(indices), len(A.data))
    if pointers[-1] > stored:
        raise InputError(f"A.indptr ends with {pointers[-1]}; A has {stored} entries")
    used = indices[: pointers[-1]]
    if used.size and (used.min() < 0 or used.max() >= size):
        raise InputError(f"A.indices must lie from 0 to {size - 1}")


def diagonal(A: Matrix) -> np.ndarray:
    """diag(A), (m,), of a canonical A; ones for a function that does not tell."""
    import scipy.sparse as sp

    m = A.shape[0]
    if isinstance(A, np.ndarray | sp.csr_array | Factored | Contacts):
        return A.diagonal()
    if not hasattr(A, "diagonal"):
        return np.ones(m)
    entries = vector("A.diagonal()", A.diagonal())
    if len(entries) != m:
        raise InputError(f"A.diagonal() has {len(entries)} entries but A has {m} rows")
    return entries


def to_core(A: Matrix) -> _core.Operator:
    """The core's operator for a canonical A."""
    if isinstance(A, Factored | Contacts):
        return A.to_core()
    if isinstance(A, np.ndarray):
        return _core.dense_operator(A)
    import scipy.sparse as sp

    if isinstance(A, sp.csr_array):
        return _core.sparse_operator(A.indptr, A.indices, A.data)
    return function_to_core(A)


def function_to_core(A: LinearMap, S: np.ndarray | float = 1.0) -> _core.Operator:
    """The core's operator for S A S, S diagonal."""

    def product(x: np.ndarray) -> np.ndarray:
        return S * np.ascontiguousarray(A.matvec(S * x), dtype=np.float64).reshape(-1)

    return _core.callback_operator(product, S * diagonal(A) * S)
