"""Problems with elliptic and rolling friction: all methods, both laws, every form of A, units of moments."""

import amontons
import numpy as np
import pytest
import scipy.sparse as sp
from reference import minimise
from rolling import BLOCK, KINDS, check_laws, random_problem


def forms(problem):
    """The same problem with every kind of A."""
    A = problem.A
    matrix = A.to_sparse()

    class Function:
        shape = A.shape

        def matvec(self, x):
            return matrix @ x

        def diagonal(self):
            return matrix.diagonal()

    kinds = {"contacts": A, "factored": A.stored(), "sparse": matrix, "dense": matrix.toarray()}
    kinds["function"] = Function()
    return {name: amontons.vi.Problem(form, problem.b, problem.cones) for name, form in kinds.items()}


# Breaks when a form of A is not the same problem in the same units: the residual of any x would differ.
@pytest.mark.parametrize("law", ["associated", "coulomb"])
@pytest.mark.parametrize("kind", KINDS)
def test_all_forms_are_one_problem(kind, law):
    for seed in range(20):
        problem = random_problem(kind, seed, size=[1.0, 0.02, 50.0][seed % 3], joints=seed % 3)
        x = np.random.default_rng(seed).normal(size=problem.rows)
        expected, violations = problem.residual(x, law=law), amontons.vi.violations(problem, x, law=law)
        for name, other in forms(problem).items():
            assert np.allclose(other.A.matvec(x) if name == "function" else other.A @ x, problem.A @ x)
            assert other.residual(x, law=law) == pytest.approx(expected, rel=1e-9), name
            assert amontons.vi.violations(other, x, law=law) == pytest.approx(violations, rel=1e-9), name
            assert np.array_equal(other.b, problem.b)
            s = other.solve(law=law, tolerance=1e-6)
            assert s.residual == pytest.approx(problem.residual(s.x, law=law), rel=1e-6, abs=1e-13)
            assert np.allclose(problem.A @ s.x + problem.b, s.u, atol=1e-9 * (1 + np.abs(s.u).max()))


# min 1/2 x'Ax + b'x over K, against Clarabel in the user's units. Breaks for a wrong set, a wrong barrier, or
# units that are lost on the way.
@pytest.mark.parametrize("kind", KINDS)
def test_second_order_methods_find_the_minimum(kind):
    compared = 0
    for seed in range(100):
        compliance = [0.0, 0.0, 0.1][seed % 3]
        problem = random_problem(kind, seed, compliance=compliance, joints=seed % 4 // 3)
        try:
            x, value = minimise(problem.A.to_sparse(), problem.b, problem.cones)
        except ArithmeticError:
            continue
        if np.abs(x).max() > 1e4:
            continue
        compared += 1
        for method in ("auto", "interior-point"):
            s = problem.solve(law="associated", method=method, tolerance=1e-9)
            assert s.converged, (seed, method, s.status, s.residual, s.reason)
            assert abs(s.objective - value) <= 1e-6 * max(abs(value), 1e-2)
            check_laws(problem, s, "associated")
    assert compared >= 80


# The other methods may give up on a hard one, but rarely, and what they call converged fulfils the law.
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(
    "method", ["p-spg-fb", "p-spg-fb-literal", "apgd", "newton", "gauss-seidel", "jacobi"]
)
def test_other_methods(kind, method):
    missed = 0
    for seed in range(40):
        problem = random_problem(kind, seed, compliance=[0.0, 1e-2][seed % 2])
        s = problem.solve(law="associated", method=method, tolerance=1e-7, max_iterations=20000)
        missed += not s.converged
        assert s.residual == pytest.approx(problem.residual(s.x, law="associated"), rel=1e-6, abs=1e-13)
        if s.converged:
            check_laws(problem, s, "associated")
    assert missed <= 1


# Coulomb's law, written out: u_n >= 0, x_n u_n = 0, maximal dissipation. Breaks for a wrong De Saxce term or
# a wrong derivative of it; no method is sure to converge here.
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("method", ["auto", "interior-point", "newton", "apgd", "p-spg-fb"])
def test_coulomb(kind, method):
    missed = 0
    for seed in range(60):
        problem = random_problem(kind, seed, size=[1.0, 0.01][seed % 2])
        s = problem.solve(law="coulomb", method=method, tolerance=1e-8, max_iterations=20000)
        missed += not s.converged
        if s.converged:
            check_laws(problem, s, "coulomb")
    assert missed <= 2


# The same bodies described in millimetres: moments in N mm. Breaks when anything depends on that unit.
@pytest.mark.parametrize("kind", KINDS[1:])
def test_the_unit_of_length_does_not_matter(kind):
    for seed in range(10):
        problem = random_problem(kind, seed)
        cone, block = problem.cones[0], BLOCK[kind]
        unit = np.tile(np.where(np.arange(block) < 3, 1.0, 1000.0), cone.n)  # x_mm = unit x, u_mm = u / unit
        if kind == "rolling":
            in_mm = amontons.vi.RollingFriction(cone.mu, 1000 * cone.rolling)
        else:
            rolling = None if cone.rolling is None else 1000 * cone.rolling
            in_mm = amontons.vi.EllipticFriction(cone.mu, 1000 * cone.torsion, rolling)
        matrix = problem.A.to_sparse().toarray() / np.outer(unit, unit)
        millimetres = amontons.vi.Problem(matrix, problem.b / unit, in_mm)
        x = np.random.default_rng(seed).normal(size=problem.rows)
        for law in ("associated", "coulomb"):
            assert millimetres.residual(unit * x, law=law) == pytest.approx(problem.residual(x, law=law))
            s = millimetres.solve(law=law, method="interior-point", tolerance=1e-8)
            assert problem.residual(s.x / unit, law=law) == pytest.approx(s.residual, rel=1e-4, abs=1e-10)


# Breaks when a length that the user chose changes the solution, or is ignored.
def test_any_moment_length_gives_the_same_motion():
    problem = random_problem("elliptic-6", 3)
    arrays = {key: value for key, value in vars(problem.A).items() if not key.startswith("_")}
    s = problem.solve(law="associated", tolerance=1e-10)
    for length in (0.1, 3.0):
        A = amontons.vi.Contacts.from_arrays({**arrays, "moment_length": np.full(problem.contacts, length)})
        other = amontons.vi.Problem(A, problem.b, problem.cones)
        x = np.random.default_rng(1).normal(size=problem.rows)
        assert np.allclose(A @ x, problem.A @ x)
        assert other.residual(x) != pytest.approx(problem.residual(x), rel=1e-3)
        assert np.allclose(other.solve(law="associated", tolerance=1e-10).u, s.u, atol=1e-6)


# Breaks when what the core made is read back in the core's units.
@pytest.mark.parametrize("kind", KINDS)
def test_a_problem_of_the_core_is_in_the_users_units(kind):
    problem = random_problem(kind, 5, joints=2)
    shared = amontons.vi.Problem._from_core(problem._core, name="", description="", source="")
    x = np.random.default_rng(0).normal(size=problem.rows)
    assert np.allclose(shared.b, problem.b, rtol=1e-14)
    assert np.allclose(shared.A @ x, problem.A @ x)
    assert shared.residual(x) == pytest.approx(problem.residual(x), rel=1e-12)
    assert [cone.kind for cone in shared.cones] == [kind, "bilateral"]
    for ours, theirs in zip(shared.cones[0].parameters, problem.cones[0].parameters, strict=True):
        assert np.allclose(ours, theirs, rtol=1e-14)
    assert np.allclose(
        shared.solve(law="associated", tolerance=1e-10).u,
        problem.solve(law="associated", tolerance=1e-10).u,
        atol=1e-7,
    )


# Breaks when a warm start is taken in other units than x: at the solution nothing is left to do.
@pytest.mark.parametrize("kind", KINDS)
def test_warm_start_is_in_the_users_units(kind):
    problem = random_problem(kind, 7, size=0.01)
    s = problem.solve(tolerance=1e-8)
    again = problem.solve(method="apgd", x0=s.x, tolerance=1.01 * s.residual + 1e-14)
    assert again.converged
    assert again.iterations <= 1


# With equal coefficients and no moments the three sets are one. Breaks when one of them means something else.
@pytest.mark.parametrize("law", ["associated", "coulomb"])
def test_sets_that_mean_the_same(law):
    problem = random_problem("elliptic-3", 11)
    mu, n = 0.6, problem.contacts
    circular = amontons.vi.Problem(problem.A, problem.b, amontons.vi.Friction(mu, n=n))
    elliptic = amontons.vi.Problem(problem.A, problem.b, amontons.vi.EllipticFriction(mu, n=n))
    rows = np.arange(5 * n).reshape(n, 5)[:, :3].ravel()
    embed = sp.csr_array((np.ones(3 * n), (rows, np.arange(3 * n))), shape=(5 * n, 3 * n))
    # Rolling rows that nothing moves: they add nothing.
    rolling = amontons.vi.Problem(
        embed @ problem.A.to_sparse() @ embed.T, embed @ problem.b, amontons.vi.RollingFriction(mu, 0.1, n=n)
    )
    solutions = [p.solve(law=law, tolerance=1e-10) for p in (circular, elliptic, rolling)]
    assert all(s.converged for s in solutions)
    if law == "associated":
        assert np.allclose(solutions[1].u, solutions[0].u, atol=1e-7)
        assert np.allclose(embed.T @ solutions[2].u, solutions[0].u, atol=1e-7)
    x = np.random.default_rng(2).normal(size=problem.rows)
    assert elliptic.residual(x, law=law) == pytest.approx(circular.residual(x, law=law), rel=1e-12)


# Breaks when wrong coefficients get in, or the message does not say what to give.
@pytest.mark.parametrize(
    ("make", "message"),
    [
        (
            lambda: amontons.vi.EllipticFriction([0.1, -0.2]),
            "mu along tangent 1 of elliptic friction cone 1 is -0.2",
        ),
        (lambda: amontons.vi.EllipticFriction(0.1, torsion=np.nan), "torsion of elliptic"),
        (lambda: amontons.vi.EllipticFriction(np.ones((2, 3))), r"mu has shape \(2, 3\)"),
        (lambda: amontons.vi.EllipticFriction([0.1, 0.2], torsion=[1, 2, 3]), "entries but there are"),
        (lambda: amontons.vi.EllipticFriction([0.1, 0.2], n=3), "mu has 2 entries but there are 3 contacts"),
        (lambda: amontons.vi.EllipticFriction("a"), "mu must be numbers"),
        (lambda: amontons.vi.RollingFriction(0.1, -1), "^rolling of rolling friction cone 0 is -1"),
        (lambda: amontons.vi.RollingFriction([[0.1, 0.2]], 1), r"mu has shape \(1, 2\); give one number"),
        (
            lambda: amontons.vi.Problem(np.eye(7), np.ones(7), [amontons.vi.RollingFriction(1, 1)]),
            "have 5 rows",
        ),
        (
            lambda: amontons.vi.Problem(np.eye(5), np.ones(5), ["rolling"]),
            "EllipticFriction, RollingFriction or PlanarFriction",
        ),
    ],
)
def test_bad_cones_are_named(make, message):
    with pytest.raises(amontons.InputError, match=message):
        make()


# Breaks when a form of the arguments means something else than the docstring says.
def test_forms_of_the_arguments():
    assert amontons.vi.EllipticFriction(0.5).kind == "elliptic-3"
    assert amontons.vi.EllipticFriction(0.5, torsion=0.01, n=100).rows == 400
    six = amontons.vi.EllipticFriction([0.3, 0.5], rolling=1e-3)
    assert six.rows == 12
    assert np.array_equal(np.stack(six.parameters, 1), [[0.3, 0.3, 0, 1e-3, 1e-3], [0.5, 0.5, 0, 1e-3, 1e-3]])
    one = amontons.vi.EllipticFriction([[0.3, 0.6]], rolling=[[1e-3, 2e-3]])
    assert np.array_equal(np.stack(one.parameters, 1), [[0.3, 0.6, 0, 1e-3, 2e-3]])
    assert amontons.vi.RollingFriction(0.3, 0.01, n=3).rows == 15
    problem = amontons.vi.Problem(
        np.eye(8), np.ones(8), [amontons.vi.Friction(0.2), amontons.vi.RollingFriction(0.4, 1)]
    )
    assert problem.contacts == 2
    assert problem.mu.tolist() == [0.2, 0.4]
