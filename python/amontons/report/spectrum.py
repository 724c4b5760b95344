"""Rank and conditioning of A: by all eigenvalues where these are cheap, else by Lanczos iterations."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp

from ..checks import Array
from ..problem.operators import Contacts, Factored
from ..problem.problem import Problem

DENSE_LIMIT = 1500
"""Rows (or body velocities) up to which all eigenvalues are computed, in about a second."""
RELATIVE_ZERO = 1e-12
"""Eigenvalues below this fraction of the largest count as zero."""


@dataclass(frozen=True)
class Spectrum:
    """Eigenvalues of A; `exact` tells whether they were all computed or estimated by Lanczos iterations."""

    largest: float
    smallest: float
    """the smallest eigenvalue of A, which is 0 where the rank is deficient; an upper bound unless exact"""
    smallest_nonzero: float
    rank: int
    exact: bool

    @property
    def condition(self) -> float:
        """largest / smallest nonzero eigenvalue; a lower bound unless exact"""
        return self.largest / self.smallest_nonzero if self.smallest_nonzero > 0 else np.inf


def spectrum(problem: Problem) -> Spectrum:
    """The spectrum of problem.A."""
    A, m = problem.A, problem.rows
    if m == 0:
        return Spectrum(0.0, 0.0, 0.0, 0, True)
    if isinstance(A, Contacts):
        A = A.stored()
    if isinstance(A, Factored) and not A.compliance.any() and 6 * A.bodies <= min(m, DENSE_LIMIT):
        # The nonzero eigenvalues of D M^-1 D' are those of the smaller M^-1/2 D' D M^-1/2.
        half = _square_root(A.inverse_mass_matrix())
        body_side = (half @ A.jacobian().T @ A.jacobian() @ half).toarray()
        return _from_eigenvalues(np.asarray(np.linalg.eigvalsh(body_side)), m)
    if m <= DENSE_LIMIT:
        return _from_eigenvalues(np.asarray(np.linalg.eigvalsh(_dense(problem, A))), m)
    return _lanczos(problem)


def _dense(problem: Problem, A: Any) -> Array:
    if isinstance(A, Factored):
        return A.to_sparse().toarray()
    if sp.issparse(A):
        return A.toarray()
    if isinstance(A, np.ndarray):
        return A
    columns = np.array([problem._product(e) for e in np.eye(problem.rows)])
    return (columns + columns.T) / 2


def _square_root(matrix: sp.csr_array) -> sp.csr_array:
    n = matrix.shape[0] // 6
    coo = sp.coo_array(matrix)
    blocks = np.zeros((n, 6, 6))
    blocks[coo.coords[0] // 6, coo.coords[0] % 6, coo.coords[1] % 6] = coo.data
    values, vectors = np.linalg.eigh(blocks)
    roots = (vectors * np.sqrt(np.maximum(values, 0))[:, None, :]) @ vectors.transpose(0, 2, 1)
    return sp.csr_array(sp.bsr_array((roots, np.arange(n), np.arange(n + 1)), shape=matrix.shape))


def _from_eigenvalues(values: Array, m: int) -> Spectrum:
    largest = float(values[-1]) if len(values) else 0.0
    nonzero = values[values > RELATIVE_ZERO * max(largest, 0.0)]
    smallest = float(values[0]) if len(values) == m else 0.0
    return Spectrum(largest, smallest, float(nonzero[0]) if len(nonzero) else 0.0, len(nonzero), True)


def _lanczos(problem: Problem, steps: int = 120, probes: int = 4) -> Spectrum:
    """Stochastic Lanczos quadrature (Ubaru, Chen, Saad 2017): rank = m * weight of nonzero Ritz values."""
    m = problem.rows
    rng = np.random.default_rng(0)
    weights, largest, smallest, ritz_values = [], 0.0, np.inf, []
    for _ in range(probes):
        values, first = _ritz(problem, rng.choice([-1.0, 1.0], m) / np.sqrt(m), steps)
        largest, smallest = max(largest, values[-1]), min(smallest, values[0])
        ritz_values.append(values)
        weights.append(first)
    # Ritz values cannot tell zeros from eigenvalues below the resolution of the iteration.
    zero = 1e-9 * largest
    fraction = np.mean([w[v > zero].sum() for v, w in zip(ritz_values, weights, strict=True)])
    nonzero = min(v[v > zero][0] for v in ritz_values)
    bound = m if not isinstance(problem.A, Factored | Contacts) else min(m, 6 * problem.A.bodies)
    return Spectrum(float(largest), float(smallest), float(nonzero), min(bound, round(m * fraction)), False)


def _ritz(problem: Problem, start: Array, steps: int) -> tuple[Array, Array]:
    """Ritz values and the squared first components of their vectors, with full reorthogonalisation."""
    basis = [start]
    alpha, beta = [], []
    for _ in range(min(steps, problem.rows)):
        w = problem._product(basis[-1])
        alpha.append(float(basis[-1] @ w))
        Q = np.array(basis)
        for _ in range(2):
            w -= Q.T @ (Q @ w)
        norm = float(np.linalg.norm(w))
        if norm <= 1e-13 * max(map(abs, alpha)):
            break
        beta.append(norm)
        basis.append(w / norm)
    k = len(alpha)
    T = np.diag(alpha) + np.diag(beta[: k - 1], 1) + np.diag(beta[: k - 1], -1)
    values, vectors = np.linalg.eigh(T)
    return values, vectors[0] ** 2
