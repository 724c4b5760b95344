"""Properties of a problem before it is solved."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from ..problem.cones import Bilateral, Interval, NonNegative
from ..problem.operators import Contacts, Factored
from ..problem.problem import Problem
from .spectrum import spectrum


def as_dict(problem: Problem) -> dict[str, Any]:
    """The same as numbers, for JSON."""
    s = spectrum(problem)
    A = problem.A
    return {
        "name": problem.name,
        "description": problem.description,
        "source": problem.source,
        "rows": problem.rows,
        "cones": [repr(cone) for cone in problem.cones],
        "contacts": problem.contacts,
        "bilateral_rows": _rows(problem, Bilateral),
        "other_bounded_rows": _rows(problem, NonNegative | Interval),
        "mu": [problem.mu.min(), problem.mu.max()] if problem.contacts else None,
        "bodies": A.bodies if isinstance(A, Factored | Contacts) else None,
        "entries": None if isinstance(A, Factored | Contacts) else getattr(A, "nnz", problem.rows**2),
        "symmetrised": any("symmetrised" in note for note in problem.notes),
        "rank": s.rank,
        "eigenvalues": [s.smallest, s.largest],
        "smallest_nonzero_eigenvalue": s.smallest_nonzero,
        "condition": s.condition,
        "exact_spectrum": s.exact,
        "guess_residuals": [problem.residual(x) for x in problem.guesses],
        "notes": list(problem.notes),
    }


def facts(problem: Problem) -> Iterator[tuple[str, str]]:
    """Pairs of name and value: sizes, cones, mu, bodies, symmetry, rank, conditioning, notes."""
    yield "name", problem.name
    if problem.description:
        yield "description", problem.description
    if problem.source:
        yield "source", problem.source
    yield from _sets(problem)
    yield from _operator(problem)
    symmetrised = [note for note in problem.notes if "symmetrised" in note]
    yield "symmetry", symmetrised[0] if symmetrised else "symmetric"
    yield from _spectrum(problem)
    if problem.guesses:
        residuals = ", ".join(f"{problem.residual(x):.1e}" for x in problem.guesses)
        yield "guesses", f"{len(problem.guesses)}, residuals {residuals}"
    for note in problem.notes:
        if note not in symmetrised:
            yield "note", note


def _sets(problem: Problem) -> Iterator[tuple[str, str]]:
    yield "rows", str(problem.rows)
    yield "cones", ", ".join(map(repr, problem.cones)) or "none"
    yield "contacts", str(problem.contacts)
    if problem.contacts:
        yield "law", problem.law
    yield "bilateral rows", str(_rows(problem, Bilateral))
    yield "other bounded rows", str(_rows(problem, NonNegative | Interval))
    if problem.contacts:
        yield "mu", f"{problem.mu.min():g} to {problem.mu.max():g}"


def _rows(problem: Problem, kind: Any) -> int:
    return sum(cone.rows for cone in problem.cones if isinstance(cone, kind))


def _operator(problem: Problem) -> Iterator[tuple[str, str]]:
    A = problem.A
    if isinstance(A, Factored | Contacts):
        moving = A.inverse_mass[A.inverse_mass > 0]
        yield "operator", f"factored, {A.bodies} bodies, {len(moving)} of them movable"
        if len(moving):
            yield "masses", f"{1 / moving.max():.4g} to {1 / moving.min():.4g} kg"
    else:
        count = A.nnz if hasattr(A, "nnz") else problem.rows**2
        yield "operator", f"{'sparse' if hasattr(A, 'nnz') else 'dense'} matrix, {count} entries"


def _spectrum(problem: Problem) -> Iterator[tuple[str, str]]:
    s = spectrum(problem)
    about = "" if s.exact else "about "
    yield "rank", f"{about}{s.rank} of {problem.rows}"
    yield (
        "eigenvalues",
        f"{s.smallest:.3e} to {s.largest:.3e}, smallest nonzero {about}{s.smallest_nonzero:.3e}",
    )
    yield "conditioning", f"{'' if s.exact else 'at least '}{s.condition:.2e} (largest over smallest nonzero)"
    if problem.rows:
        diagonal = problem._core.preconditioner
        yield "diagonal", f"{diagonal.min():.3e} to {diagonal.max():.3e} (mean per cone)"
        yield "|b|", f"{np.linalg.norm(problem.b):.6g} m/s"
