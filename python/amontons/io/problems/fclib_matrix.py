"""Sparse matrices in the layout of FCLIB."""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.sparse as sp

from ...limits import readable
from ..hdf5 import Reader

TRIPLET_LABELS = "nz is the number of triplets, -1 for compressed columns, -2 for compressed rows"


def read_matrix(parent: Reader, key: str) -> sp.csr_array:
    """A matrix of the FCLIB layout: m, n, nz and p, i, x, whose meaning depends on nz.

    Sizes and indices are checked before SciPy sees them: it trusts them.
    """
    g, name = parent.sub(key), parent.name(key)
    m, n, nz = g.integer("m"), g.integer("n"), g.integer("nz")
    if m < 0 or n < 0:
        raise g.fail(f"{name} has a negative size, {m} x {n}")
    # Every row and column has numbers of its own elsewhere in the file, in f, w or q: 8 bytes each.
    if 8 * max(m, n) > g.most:
        raise g.fail(f"{name} is {m} x {n}, but the file can hold vectors of {readable(g.most)} at most")
    if nz < -2:
        raise g.fail(f"{name}/nz = {nz} is no known storage; {TRIPLET_LABELS}")
    p, i, x = g.integers("p"), g.integers("i"), g.array("x").ravel()
    matrix = _triplets(g, m, n, nz, p, i, x) if nz >= 0 else _compressed(g, m, n, nz, p, i, x)
    if not np.isfinite(matrix.data).all():
        raise g.fail(f"{name}/x: an entry is not finite")
    return matrix


def _triplets(g: Reader, m: int, n: int, nz: int, p: Any, i: Any, x: Any) -> sp.csr_array:
    # Real files have i = row and p = column (the comment in fclib.h says the reverse), and arrays that
    # may be longer than the nz entries in use.
    for key, array in (("i", i), ("p", p), ("x", x)):
        if len(array) < nz:
            raise g.fail(f"{g.name(key)} has {len(array)} entries but nz = {nz}; {TRIPLET_LABELS}")
    rows, columns, values = i[:nz], p[:nz], x[:nz]
    _require_indices(g, "i", rows, m)
    _require_indices(g, "p", columns, n)
    return sp.csr_array((_reals(values), (rows, columns)), shape=(m, n))


def _compressed(g: Reader, m: int, n: int, nz: int, p: Any, i: Any, x: Any) -> sp.csr_array:
    major, minor = (n, m) if nz == -1 else (m, n)
    if len(p) != major + 1 or p[0] != 0 or np.any(p[1:] < p[:-1]):
        raise g.fail(
            f"{g.name('p')} must hold {major + 1} ascending pointers from 0 on (nz = {nz}); {TRIPLET_LABELS}"
        )
    nnz = int(p[-1])
    for key, array in (("i", i), ("x", x)):
        if len(array) < nnz:
            raise g.fail(f"{g.name(key)} has {len(array)} entries but {g.name('p')} ends at {nnz}")
    _require_indices(g, "i", i[:nnz], minor)
    parts = (_reals(x[:nnz]), i[:nnz], p)
    matrix = sp.csc_array(parts, shape=(m, n)) if nz == -1 else sp.csr_array(parts, shape=(m, n))
    matrix = sp.csr_array(matrix)
    with np.errstate(over="ignore", invalid="ignore"):
        matrix.sum_duplicates()
    return matrix


def _reals(values: Any) -> Any:
    with np.errstate(over="ignore"):  # of numbers of 128 bits
        return values.astype(np.float64)


def _require_indices(g: Reader, key: str, indices: Any, size: int) -> None:
    bad = np.flatnonzero((indices < 0) | (indices >= size))
    if bad.size:
        raise g.fail(f"{g.name(key)}[{bad[0]}] = {indices[bad[0]]} is outside 0..{size - 1}")
