"""Solutions of random problems against Clarabel: all cones, more constraints than there are freedoms."""

from collections import Counter

import amontons
import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from reference import minimise

MU = [0.0, 0.1, 0.3, 0.6, 1.0, 3.0, 10.0]


def random_problem(rng, bodies, mu, kinds, compliance, speculative):
    """Rows between random bodies or a body and the world, all touching in random directions.

    mu: one contact each. kinds: one joint row each, 0 free, 1 unilateral, 2 bounded. b = D v + c, c_n >= 0,
    so that A d = 0 implies b'd >= 0 for every d in K: the problem is bounded, whatever the rank of A.
    """
    body_a, body_b, jacobian_a, jacobian_b = [], [], [], []

    def add(a, b, row_a, row_b):
        body_a.append(a)
        body_b.append(b)
        jacobian_a.append(row_a)
        jacobian_b.append(row_b)

    def pair():
        a, b = int(rng.integers(0, bodies)), int(rng.integers(-1, bodies))
        b = -1 if a == b else b
        return (b, a) if b >= 0 and rng.random() < 0.5 else (a, b)

    for _ in mu:
        a, b = pair()
        frame = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        r_a, r_b = rng.normal(size=(2, 3))
        for e in frame:
            add(a, b, np.r_[e, np.cross(r_a, e)], -np.r_[e, np.cross(r_b, e)])
    for _ in kinds:
        add(*pair(), rng.normal(size=6), rng.normal(size=6))
    inverse_mass = 10 ** rng.uniform(-1, 1, bodies)
    roots = rng.normal(size=(bodies, 3, 3))
    inertia = inverse_mass[:, None, None] * (roots @ roots.transpose(0, 2, 1) / 3 + 0.1 * np.eye(3))
    A = amontons.vi.Factored(
        inverse_mass,
        inertia,
        body_a,
        body_b,
        jacobian_a,
        jacobian_b,
        compliance=np.full(len(body_a), compliance),
    )
    b = A.jacobian() @ rng.normal(size=6 * bodies)
    b[: 3 * len(mu) : 3] += speculative * rng.integers(0, 2, len(mu))
    cones = [amontons.vi.Friction(mu)] if len(mu) else []
    cones += [
        [amontons.vi.Bilateral(1), amontons.vi.NonNegative(1), amontons.vi.Interval(-0.3, 0.2)][kind]
        for kind in kinds
    ]
    return amontons.vi.Problem(A, b, cones)


@st.composite
def problems(draw, coefficients):
    mu = draw(st.lists(coefficients, max_size=10))
    kinds = draw(st.lists(st.integers(0, 2), min_size=0 if mu else 1, max_size=4))
    return random_problem(
        np.random.default_rng(draw(st.integers(0, 10**6))),
        draw(st.integers(1, 6)),
        mu,
        kinds,
        draw(st.sampled_from([0.0, 0.0, 1e-3, 0.1])),
        draw(st.sampled_from([0.0, 0.5])),
    )


def reference(problem, b):
    """The value that Clarabel finds, and the size at which 1e-6 of it means something."""
    A = problem.A.to_sparse()
    diagonal = np.maximum(A.diagonal(), 1e-12)
    try:
        x, value = minimise(A, b, problem.cones)
    except ArithmeticError:
        return None, None
    if (
        np.abs(x).max() > 1e5
    ):  # it ran off along a direction with A d = 0, whose b'd = 0 it takes for negative
        return None, None
    return value, max(abs(value), 1e-3 * np.sum(b**2 / diagonal), 1e-3)  # Clarabel stops at a gap of 1e-10


# The methods that must solve everything: any rank, any friction, any cones. Breaks for a wrong solution as
# well as for one that is not reached. Where bodies are over-constrained a tiny mu still matters, as x_n may
# grow like 1 / mu: Clarabel is no reference below 1e-3.
@settings(max_examples=400, derandomize=True)
@given(problems(st.one_of(st.sampled_from(MU), st.floats(1e-3, 10))))
def test_second_order_methods_find_the_minimum(problem):
    value, size = reference(problem, problem.b)
    assume(value is not None)
    for method in ("auto", "interior-point"):
        s = problem.solve(law="associated", method=method, tolerance=1e-9)
        assert s.converged, (method, s.status, s.residual)
        assert s.residual <= 1e-9
        assert abs(s.objective - value) <= 1e-6 * size


# Under coulomb a solution x solves the convex problem whose b holds the De Saxce term of x: Clarabel must
# not find less. No method is sure to converge there; the worst that over-constrained bodies with much
# friction may leave is bounded.
@settings(max_examples=250, derandomize=True)
@given(problems(st.one_of(st.sampled_from([0.0, 0.3, 1.0]), st.floats(1e-3, 1))))
def test_coulomb_solutions_solve_their_own_convex_problem(problem):
    s = problem.solve(law="coulomb", tolerance=1e-9)
    assert s.residual <= 1e-3
    if s.converged:
        check_coulomb(problem, s)


# Breaks when the default method loses the random small steps: Coulomb's law may have no solution, but rarely.
def test_coulomb_converges_nearly_always():
    rng = np.random.default_rng(12)
    failures = 0
    for _ in range(200):
        mu = rng.choice([0, 0.3, 0.6, 1], rng.integers(1, 11))
        problem = random_problem(
            rng,
            int(rng.integers(1, 7)),
            mu,
            rng.integers(0, 3, rng.integers(0, 5)),
            rng.choice([0, 0, 1e-3]),
            0.5,
        )
        s = problem.solve(law="coulomb", tolerance=1e-9)
        failures += not s.converged
        if s.converged:
            check_coulomb(problem, s)
    assert failures <= 2


def check_coulomb(problem, s):
    contacts = problem.contacts
    u = s.u[: 3 * contacts].reshape(-1, 3)
    b = problem.b.copy()
    b[: 3 * contacts : 3] += problem.mu * np.hypot(u[:, 1], u[:, 2])
    value, size = reference(problem, b)
    assume(value is not None)
    objective = s.objective + (b - problem.b) @ s.x
    assert abs(objective - value) <= 1e-6 * size


# First-order methods and the bare Newton method may give up on a hard problem, but rarely, and never
# with a claim that is wrong: what they call converged has the residual and the objective of a solution.
@pytest.mark.parametrize(
    ("method", "tolerance", "failures"),
    [("p-spg-fb", 1e-6, 0.03), ("newton", 1e-8, 0.03), ("apgd", 1e-6, 0.05)],
)
def test_other_methods_find_the_minimum(method, tolerance, failures):
    rng = np.random.default_rng(11)
    status = Counter()
    while status.total() < 300:
        problem = random_problem(
            rng,
            int(rng.integers(1, 7)),
            rng.choice(MU, rng.integers(1, 11)),
            rng.integers(0, 3, rng.integers(0, 5)),
            rng.choice([0, 0, 1e-3, 0.1]),
            0.5,
        )
        value, size = reference(problem, problem.b)
        if value is None:
            continue
        s = problem.solve(law="associated", method=method, tolerance=tolerance)
        status[s.status] += 1
        assert s.residual == pytest.approx(problem.residual(s.x, law="associated"), rel=1e-6, abs=1e-14)
        assert s.objective >= value - 1e-6 * size
        if s.converged:
            assert s.residual <= tolerance
            assert s.objective <= value + 1e-6 * size
    assert status["converged"] >= (1 - failures) * status.total(), status


# A random dense matrix of low rank without bodies: impulse space. b in the range of A keeps it bounded.
@settings(max_examples=300, derandomize=True)
@given(st.integers(0, 10**6), st.integers(1, 8), st.integers(1, 24))
def test_dense_matrices_of_low_rank(seed, contacts, rank):
    rng = np.random.default_rng(seed)
    B = rng.normal(size=(3 * contacts, rank))
    c = rng.normal(size=rank)
    b = B @ c
    problem = amontons.vi.Problem(B @ B.T, b, [amontons.vi.Friction(rng.uniform(0, 2, contacts))])
    try:
        x, _ = minimise(B @ B.T, b, problem.cones)
    except ArithmeticError:
        assume(False)
    # By B'x: x is large along free directions, and the sums x'Ax of Clarabel and of NumPy lose their digits.
    y = B.T @ x
    value = float(0.5 * y @ y + c @ y)
    s = problem.solve(law="associated", tolerance=1e-8)
    assert s.converged, (s.status, s.residual)
    assert abs(s.objective - value) <= 1e-6 * max(abs(value), 1e-3)
