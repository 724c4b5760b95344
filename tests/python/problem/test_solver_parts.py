"""Parts of solvers for every kind of cone, against plain NumPy: projection, P, De Saxce term, natural map."""

import amontons
import numpy as np
import pytest
from scipy.optimize import brentq, minimize_scalar

CONES = {
    "bilateral": amontons.vi.Bilateral(2),
    "nonnegative": amontons.vi.NonNegative(3),
    "interval": amontons.vi.Interval([-0.2, 0.1, -np.inf], [0.3, 0.4, 0.0]),
    "friction": amontons.vi.Friction([0.3, 0.8]),
    "elliptic-3": amontons.vi.EllipticFriction([[0.3, 0.6], [0.8, 0.8]]),
    "elliptic-4": amontons.vi.EllipticFriction([[0.3, 0.6], [0.5, 0.4]], torsion=[0.02, 0.1]),
    "elliptic-6": amontons.vi.EllipticFriction([[0.3, 0.6], [0.5, 0.4]], 0.05, [[0.01, 0.03], [0.1, 0.02]]),
    "rolling": amontons.vi.RollingFriction([0.3, 0.7], [0.02, 0.1]),
    "planar": amontons.vi.PlanarFriction([0.3, 0.7]),
}
FORCES = 3


def random_problem(cones, seed=0, law="coulomb"):
    """A dense problem whose moments are of bodies of a tenth of a metre."""
    rng = np.random.default_rng(seed)
    rows = sum(cone.rows for cone in cones)
    unit, row = np.ones(rows), 0
    for cone in cones:
        if cone.moments:
            unit[row : row + cone.rows].reshape(cone.n, -1)[:, FORCES:] = 10.0
        row += cone.rows
    B = unit[:, None] * rng.normal(size=(rows, rows + 2))
    return amontons.vi.Problem(B @ B.T, rng.normal(size=rows), cones, law=law), rng


def blocks(problem):
    """Slice of rows, cone and index within the cone of every contact, or of the rows of the other cones."""
    row = 0
    for cone in problem.cones:
        count = cone.n if isinstance(cone, amontons.vi.Friction) or cone.kind not in list(CONES)[:3] else 1
        size = cone.rows // count
        for i in range(count):
            yield slice(row, row + size), cone, i
            row += size


def lengths(problem):
    """(m,) 1 for forces, and for moments the length that makes their mean of diag(A) that of the forces."""
    diagonal, S = np.diag(problem.A), np.ones(problem.rows)
    for rows, cone, _ in blocks(problem):
        if cone.moments:
            d = diagonal[rows]
            S[rows][FORCES:] = np.sqrt(d[:FORCES].mean() / d[FORCES:].mean())
    return S


def ellipse(t, mu, n):
    """The nearest point of sum (t / mu)^2 <= n^2."""
    if np.sum((t / mu) ** 2) <= n**2:
        return t
    if n == 0:
        return 0 * t
    excess = lambda k: np.sum((t * mu / (mu**2 + k)) ** 2) - n**2  # noqa: E731
    k = brentq(excess, 0, np.linalg.norm(t * mu) / n + 1, xtol=1e-15)
    return t * mu**2 / (mu**2 + k)


def disc(t, radius):
    size = np.linalg.norm(t)
    return t if size <= radius else t * radius / size


def tangential(cone, i, t, n, length):
    """The nearest friction t that a normal force n allows, moments and their coefficients over a length."""
    if isinstance(cone, amontons.vi.RollingFriction):
        return np.concatenate([disc(t[:2], cone.mu[i] * n), disc(t[2:], cone.rolling[i] / length * n)])
    if isinstance(cone, amontons.vi.Friction):
        return disc(t, cone.mu[i] * n)
    mu = np.array([column[i] for column in cone.parameters])
    mu[2:] /= length
    return ellipse(t, mu, n)


def nearest(cone, i, x, length):
    """The projection of a block: of contacts by a search for the normal force of the nearest point."""
    if cone.kind == "bilateral":
        return x
    if cone.kind == "nonnegative":
        return np.maximum(x, 0)
    if cone.kind == "interval":
        return np.clip(x, cone.lo, cone.hi)
    point = lambda n: np.concatenate([[n], tangential(cone, i, x[1:], n, length)])  # noqa: E731
    distance = lambda n: np.sum((point(n) - x) ** 2)  # noqa: E731
    most = 10 * np.linalg.norm(x)
    n = minimize_scalar(distance, bounds=(0, most), method="bounded", options={"xatol": 1e-11 * most}).x
    return min(point(n), point(0.0), key=lambda p: np.sum((p - x) ** 2))


def term(cone, i, u):
    """mu |u_t| and its like, from the user's units."""
    if isinstance(cone, amontons.vi.RollingFriction):
        return cone.mu[i] * np.hypot(*u[1:3]) + cone.rolling[i] * np.hypot(*u[3:])
    if isinstance(cone, amontons.vi.Friction):
        return cone.mu[i] * np.hypot(*u[1:])
    return np.linalg.norm([column[i] for column in cone.parameters] * u[1:])


# Breaks for a kind of cone whose projection is another one, and where units of moments are mixed up. The
# search for the nearest point has half the digits.
@pytest.mark.parametrize("kind", CONES)
def test_projection(kind):
    problem, rng = random_problem([CONES[kind]])
    S = lengths(problem)
    for scale in (0.1, 1.0, 1.0, 10.0):
        x = scale * rng.normal(size=problem.rows) * S
        expected = np.empty(problem.rows)
        for rows, cone, i in blocks(problem):
            expected[rows] = nearest(cone, i, x[rows] / S[rows], S[rows][-1]) * S[rows]
        assert np.allclose(problem.project(x), expected, rtol=0, atol=1e-6 * scale)
        assert np.allclose(problem.project(problem.project(x)), problem.project(x), atol=1e-14 * scale)


# Breaks when P is not one number per block in the units in which moments count over a length.
@pytest.mark.parametrize("kind", CONES)
def test_preconditioner(kind):
    problem, _ = random_problem([CONES[kind]])
    S, diagonal = lengths(problem), np.diag(problem.A)
    for rows, cone, _ in blocks(problem):
        d = diagonal[rows] * S[rows] ** 2
        P = d.mean() if cone.kind not in list(CONES)[:3] else d  # rows of other cones are blocks of their own
        assert np.allclose(problem.P[rows], P / S[rows] ** 2)


# Breaks for a wrong or missing term, one in another row, or one under the convex law.
@pytest.mark.parametrize("kind", CONES)
def test_de_saxce_term(kind):
    problem, rng = random_problem([CONES[kind]])
    u = rng.normal(size=problem.rows)
    expected = np.zeros(problem.rows)
    for rows, cone, i in blocks(problem):
        if cone.kind not in list(CONES)[:3]:
            expected[rows.start] = term(cone, i, u[rows])
    assert np.allclose(problem.de_saxce(u), expected)
    assert not problem.de_saxce(u, law="associated").any()
    assert not random_problem([CONES[kind]], law="associated")[0].de_saxce(u).any()


# Breaks when the map, its norm and the residual are not of one formula, for all cones in one problem.
@pytest.mark.parametrize("law", ["coulomb", "associated"])
def test_natural_map(law):
    problem, rng = random_problem(list(CONES.values()), law=law)
    x = rng.normal(size=problem.rows) * lengths(problem)
    u = problem.A @ x + problem.b
    r = problem.natural_map(x)
    assert np.allclose(
        r, x - problem.project(x - (u + problem.de_saxce(u)) / problem.P), rtol=1e-9, atol=1e-12
    )
    zero = problem.natural_map(np.zeros(problem.rows))
    assert problem.residual(x) == pytest.approx(np.sqrt(problem.P @ r**2 / (problem.P @ zero**2)), rel=1e-12)
    other = {"coulomb": "associated", "associated": "coulomb"}[law]
    assert not np.allclose(problem.natural_map(x, law=other), r)
    # Without cancellation: where the trial point is inside, the map is the step, however large x is.
    inside = np.zeros(problem.rows)
    inside[0] = 1e16
    assert problem.natural_map(inside)[0] == pytest.approx((problem.A @ inside + problem.b)[0] / problem.P[0])


# Breaks when the name of earlier versions is only missing.
def test_name_that_changed():
    problem, _ = random_problem([CONES["rolling"]])
    with pytest.raises(AttributeError, match=r"^Problem.saxce is now Problem.de_saxce$"):
        problem.saxce  # noqa: B018
    with pytest.raises(AttributeError, match=r"no attribute 'natural_mop' \(did you mean 'natural_map'\?\)"):
        problem.natural_mop  # noqa: B018


# Breaks when arrays of another length or kind come through, or a result can be written.
@pytest.mark.parametrize("name", ["project", "de_saxce", "natural_map"])
def test_bad_arguments(name):
    problem, _ = random_problem([CONES["rolling"]])
    with pytest.raises(amontons.InputError, match="has 3 entries but the problem has 10 rows"):
        getattr(problem, name)(np.zeros(3))
    with pytest.raises(amontons.InputError, match="must hold real numbers"):
        getattr(problem, name)("abc")
    with pytest.raises(ValueError, match="read-only"):
        problem.P[0] = 1.0
