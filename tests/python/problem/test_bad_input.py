"""Every bad input of the Python functions has a message that names the thing and the remedy."""

import amontons
import numpy as np
import pytest
import scipy.sparse as sp
import scipy.sparse.linalg
from problems import pile, random_spd

EYE = np.eye(3)
ONES = np.ones(3)
UNSYMMETRIC = EYE + 1e-6 * np.eye(3, k=1)


def with_entry(array, index, value):
    changed = np.array(array, dtype=float)
    changed[index] = value
    return changed


def operator(function, n=3):
    return scipy.sparse.linalg.LinearOperator((n, n), matvec=function, dtype=float)


class BadDiagonal:
    shape = (3, 3)
    diagonal = staticmethod(lambda: np.ones(2))
    matvec = staticmethod(lambda x: x)


# Breaks when a message loses the name of the thing, its index or the remedy.
@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("text", ONES, "bilateral"), "A is a str; give a SciPy sparse matrix"),
        ((np.ones((3, 2)), ONES, "bilateral"), r"A has shape \(3, 2\); it must be square"),
        ((sp.csr_array((3, 2)), ONES, "bilateral"), r"A has shape \(3, 2\); it must be square"),
        ((EYE * 1j, ONES, "bilateral"), "complex128; they must be real"),
        ((sp.csr_array(EYE * 1j), ONES, "bilateral"), "complex128; they must be real"),
        ((UNSYMMETRIC, ONES, "bilateral"), r"A\[0, 1\] and A\[1, 0\] differ by 1.0e-06 .*\(A \+ A.T\) / 2"),
        ((sp.csr_array(UNSYMMETRIC), ONES, "bilateral"), r"A\[0, 1\] and A\[1, 0\] differ.*symmetrise it"),
        ((sp.csc_array(UNSYMMETRIC), ONES, "bilateral"), r"not symmetric.*symmetrise it"),
        ((sp.triu(np.ones((3, 3))), ONES, "bilateral"), "not symmetric: .* differ by 1.0e"),
        ((with_entry(EYE, (1, 1), np.nan), ONES, "bilateral"), r"A\[4\] is not finite"),
        ((sp.csr_array(with_entry(EYE, (1, 1), np.inf)), ONES, "bilateral"), r"A.data\[1\] is not finite"),
        (
            (with_entry(EYE, (1, 1), -1), ONES, "bilateral"),
            r"A\[1, 1\] = -1.0+ is negative.*positive semidefinite",
        ),
        ((operator(lambda x: x * np.nan), ONES, "bilateral"), "entry 0 of a product A x is not finite"),
        (
            (operator(lambda x: x[:2]), ONES, "bilateral"),
            r"dimension mismatch|must return 3 numbers|shape|reshape",
        ),
        ((BadDiagonal(), ONES, "bilateral"), r"A.diagonal\(\) has 2 entries but A has 3 rows"),
        ((EYE, np.ones(4), "bilateral"), "b has 4 entries but A has 3 rows"),
        ((EYE, np.ones((3, 1)), "bilateral"), r"b has shape \(3, 1\); it must be a vector"),
        ((EYE, ["a", "b", "c"], "bilateral"), "b must hold real numbers"),
        ((EYE, ONES * 1j, "bilateral"), "b is complex; it must hold real numbers"),
        ((EYE, with_entry(ONES, 2, np.nan), "bilateral"), r"b\[2\] is not finite"),
        ((EYE, with_entry(ONES, 0, -np.inf), "bilateral"), r"b\[0\] is not finite"),
        (
            (EYE, ONES, "slippery"),
            "cones = 'slippery'; a name must be one of 'bilateral', 'nonnegative', 'friction'",
        ),
        ((np.eye(4), np.ones(4), "friction"), "4 rows, which is no multiple of three"),
        (
            (EYE, ONES, [amontons.vi.Bilateral(2)]),
            r"the cones have 2 rows in all but A has 3 \(a friction cone takes",
        ),
        (
            (EYE, ONES, [3]),
            r"cones\[0\] is a int; it must be Bilateral, NonNegative, Interval, Friction, Ell",
        ),
        ((EYE, ONES, 3), "cones is a int; give a list of cone objects or a name"),
        ((EYE, ONES, "friction"), r"no friction coefficient: give mu=, or Friction\(mu\)"),
    ],
)
def test_matrix_vector_and_cones(arguments, message):
    mu = 0.3 if "multiple" in message else None
    with pytest.raises((amontons.InputError, ValueError), match=message):
        amontons.vi.solve(*arguments, mu=mu)


# Breaks when two contradictory options are accepted, or an unknown one is ignored.
@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"mu": -0.1}, r"friction coefficient mu\[0\] = -0.1.*not negative"),
        ({"mu": [0.1, 0.2]}, "mu has 2 entries but there are 1 contacts"),
        ({"mu": np.nan}, r"mu\[0\] = -?nan"),
        ({"mu": np.inf}, r"mu\[0\] = inf"),
        ({"mu": "rough"}, "mu must hold real numbers"),
        ({"mu": 0.3, "cones": "bilateral"}, "mu is given but no cone is a friction cone; drop mu or"),
        ({"mu": 0.3, "cones": [amontons.vi.Friction(0.3)]}, "mu is given twice"),
        ({"law": "newton"}, "unknown law 'newton'; known are associated, coulomb"),
        (
            {"law": "relaxed"},
            r"unknown law 'relaxed' \(here it is called 'associated'\)",
        ),
        ({"method": "simplex"}, "unknown method 'simplex'; known are auto, .*p-spg-fb.*interior-point"),
        ({"method": None}, "unknown method None"),
        ({"method": "cg"}, "cg.*bilateral"),
        ({"method": "minres"}, "minres.*bilateral"),
        (
            {"method": "apgd", "omega": 1.0},
            r"unknown option 'omega' of method 'apgd' \(it belongs to jacobi, gauss-seidel\); its opt.* none",
        ),
        ({"tol": 1e-3}, r"unknown option 'tol' of method 'auto' \(here it is called 'tolerance'\)"),
        ({"max_iter": 3}, r"\(here it is called 'max_iterations'\)"),
        ({"toleranse": 3}, r"\(did you mean 'tolerance'\?\)"),
        ({"method": "pgs"}, r"unknown method 'pgs' \(here it is called 'gauss-seidel'\); known are auto"),
        ({"method": "NSGS"}, r"\(here it is called 'gauss-seidel'\)"),
        ({"method": "admm"}, "method 'admm' was removed; use 'interior-point'"),
        ({"method": "ipm"}, r"\(here it is called 'interior-point'\)"),
        ({"method": "projected Jacobi"}, r"\(here it is called 'jacobi'\)"),
        ({"method": "p-spg-fb", "rho": 1.0}, "its options are: alpha_min, alpha_max, .*gamma"),
        ({"relaxation": 1.0}, "unknown option 'relaxation' of method 'auto'"),
        ({"method": "gauss-seidel", "omega": 2.5}, "omega = 2.5.*0 < omega < 2"),
        ({"method": "gauss-seidel", "omega": "x"}, "omega = 'x'; it must be a number"),
        ({"method": "jacobi", "omega": -1.0}, "omega = -1.0; it must be zero or positive"),
        ({"method": "p-spg-fb", "memory": -1}, "memory = -1; it must be an integer, at least 0"),
        ({"method": "p-spg-fb", "sigma_min": 0.9, "sigma_max": 0.1}, "0 < sigma_min <= sigma_max < 1"),
        ({"method": "p-spg-fb", "alpha_min": 2.0, "alpha_max": 1.0}, "0 < alpha_min < alpha_max"),
        ({"method": "p-spg-fb", "gamma": 1.5}, "gamma = 1.5.*between 0 and 1"),
        ({"method": "p-spg-fb-literal", "tau_g": 0.0}, "tau_g = 0.0+; it must be positive"),
        ({"tolerance": -1e-6}, "tolerance = -1e-06; it must be zero or positive"),
        ({"tolerance": np.nan}, "tolerance = nan; it must be a number"),
        ({"tolerance": "small"}, "tolerance = 'small'; it must be a number"),
        ({"max_iterations": 0}, "max_iterations = 0; it must be an integer, at least 1"),
        ({"max_iterations": 1.5}, "max_iterations = 1.5; it must be an integer"),
        ({"deadline": 0}, "deadline = 0; it must be positive"),
        ({"deadline": -1.0}, "deadline = -1.0; it must be positive"),
        ({"threads": 0}, "threads = 0; it must be an integer, at least 1"),
        ({"threads": True}, "threads = True; it must be an integer"),
        ({"x0": [1.0]}, "x0 has 1 entries but the problem has 3 rows"),
        ({"x0": [1.0, np.nan, 0.0]}, r"x0\[1\] is not finite"),
        ({"callback": 3}, "callback is a int; it must be callable"),
    ],
)
def test_options(options, message):
    cones = options.pop("cones", "friction")
    mu = options.pop("mu", 0.3 if cones == "friction" else None)
    with pytest.raises(amontons.InputError, match=message):
        amontons.vi.solve(EYE, -ONES, cones, mu=mu, **options)


# Breaks when a cone can be made that has no meaning.
@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: amontons.vi.Bilateral(-1), r"Bilateral\(n\): n = -1"),
        (
            lambda: amontons.vi.Bilateral(1.5),
            r"Bilateral\(n\): n = 1.5; give the number of rows as an integer",
        ),
        (lambda: amontons.vi.NonNegative(True), r"NonNegative\(n\): n = True"),
        (lambda: amontons.vi.Interval(1, -1), "interval 0: lo = 1.0+ is above hi = -1.0+; swap them"),
        (lambda: amontons.vi.Interval([0, 0], [1, np.nan]), "interval 1: a bound is NaN"),
        (lambda: amontons.vi.Interval([0, 0], [1, 1, 1]), "lo has 2 entries and hi 3"),
        (lambda: amontons.vi.Interval(np.inf, np.inf), "interval 0 is empty"),
        (lambda: amontons.vi.Friction(), "Friction needs the coefficients mu or the number of contacts n"),
        (lambda: amontons.vi.Friction([0.1, -0.2]), r"mu\[1\] = -0.2.*not negative"),
        (lambda: amontons.vi.Friction([0.1, 0.2], n=3), "mu has 2 entries but n = 3"),
        (lambda: amontons.vi.Friction([[0.1]]), r"Friction: mu has shape \(1, 1\)"),
        (lambda: amontons.vi.Friction(-2), r"mu\[0\] = -2.*not negative"),
        (lambda: amontons.vi.Friction(n=-2), r"Friction\(n\): n = -2"),
    ],
)
def test_cones(make, message):
    with pytest.raises(amontons.InputError, match=message):
        make()


def factored(**changes):
    arguments = {
        "inverse_mass": [1.0, 2.0],
        "inverse_inertia": np.ones((2, 3)),
        "body_a": [0, 1, 1],
        "body_b": [1, -1, -1],
        "jacobian_a": np.ones((3, 6)),
        "jacobian_b": np.ones((3, 6)),
    }
    return amontons.vi.Factored(**(arguments | changes))


# Breaks when an array of the factored operator is taken unchecked: the core indexes with it.
@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"inverse_mass": [1.0, -2.0]}, r"inverse_mass\[1\] = -2; it must be finite and not negative"),
        ({"inverse_mass": [1.0, np.nan]}, r"inverse_mass\[1\] = nan"),
        ({"inverse_mass": [1.0]}, r"inverse_inertia has shape \(2, 3\); it must be \(1, 3, 3\)"),
        (
            {"inverse_inertia": [np.eye(3), np.diag([1.0, 1, -1])]},
            r"inverse_inertia\[1\] is not positive semi",
        ),
        ({"inverse_inertia": [np.eye(3), UNSYMMETRIC]}, r"inverse_inertia\[1\] is not symmetric"),
        ({"inverse_inertia": np.full((2, 3), np.inf)}, r"inverse_inertia\[0, 0\] is not finite"),
        (
            {"body_a": [0, 1, 2]},
            r"body_a\[2\] = 2: that body does not exist \(there are 2; -1 is the world\)",
        ),
        ({"body_b": [-2, 0, 0]}, r"body_b\[0\] = -2: that body does not exist"),
        ({"body_a": [0.5, 1, 1]}, "body_a must be a vector of integers"),
        ({"body_b": [1, 1, -1]}, "row 1 joins body 1 to itself; it needs two bodies or one"),
        ({"body_b": [1]}, "body_a has 3 entries and body_b 1"),
        ({"jacobian_a": np.ones((3, 5))}, r"jacobian_a has shape \(3, 5\); it must be \(3, 6\)"),
        ({"jacobian_b": with_entry(np.ones((3, 6)), (2, 4), np.nan)}, r"jacobian_b\[2, 4\] is not finite"),
        ({"compliance": [0.0, 0.0, -1.0]}, r"compliance\[2\] = -1; it must be finite and not negative"),
        ({"compliance": [0.0, 0.0]}, "compliance has 2 entries; it must have 3"),
    ],
)
def test_factored(changes, message):
    with pytest.raises(amontons.InputError, match=message):
        factored(**changes)


# Breaks when the rows of one friction cone may act on different bodies, which the solvers do not expect.
def test_factored_friction_cone_of_different_bodies():
    with pytest.raises(
        amontons.InputError, match="rows 0 to 2 are one friction cone and must act on the same two"
    ):
        amontons.vi.Problem(factored(), ONES, "friction", mu=0.3)


# Breaks when a contact is taken unchecked.
@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"normal": [[0, 0, 2.0]]}, r"normal\[0\] has length 2; it must be a unit vector"),
        ({"normal": [[0, 0, np.nan]]}, r"normal\[0, 2\] is not finite"),
        ({"r_a": [[0, 0]]}, r"r_a has shape \(1, 2\); it must be \(1, 3\)"),
        ({"r_b": [[np.inf, 0, 0]]}, r"r_b\[0, 0\] is not finite"),
        ({"body_a": [1]}, r"body_a\[0\] = 1: that body does not exist"),
        ({"body_b": [0]}, "contact 0 joins body 0 to itself"),
        ({"body_a": [-1]}, "contact 0 is between the world and itself"),
        ({"compliance": -1.0}, r"compliance\[0\] = -1"),
        ({"joint_body_a": [0], "joint_body_b": [7]}, r"joint_body_b\[0\] = 7"),
        ({"joint_body_a": [0], "joint_body_b": [-1]}, r"joint_jacobian_a has shape .*; it must be \(1, 6\)"),
    ],
)
def test_contacts(changes, message):
    arguments = {
        "inverse_mass": [1.0],
        "inverse_inertia": [[1.0, 1.0, 1.0]],
        "body_a": [0],
        "body_b": [-1],
        "r_a": [[0, 0, -1.0]],
        "r_b": [[0, 0, 0]],
        "normal": [[0, 0, 1.0]],
    }
    with pytest.raises(amontons.InputError, match=message):
        amontons.vi.Contacts(**(arguments | changes))


# Breaks when cones that do not follow the rows of Contacts are accepted.
def test_contacts_with_other_cones():
    A, b, cones = pile()
    with pytest.raises(amontons.InputError, match="cones must start with one friction cone per contact"):
        amontons.vi.Problem(A, b, [cones[1], *cones[:1], cones[2]])


# Breaks when the residual of something else than an iterate is computed.
@pytest.mark.parametrize(
    ("arguments", "options", "message"),
    [
        (([1.0],), {}, "x has 1 entries but the problem has 3 rows"),
        ((ONES,), {"law": "hertz"}, "unknown law 'hertz'"),
        ((ONES,), {"norm": "l1"}, "unknown norm 'l1'; known are natural, plain, plain_inf, siconos"),
    ],
)
def test_residual(arguments, options, message):
    problem = amontons.vi.Problem(EYE, ONES, "bilateral")
    with pytest.raises(amontons.InputError, match=message):
        amontons.vi.residual(problem, *arguments, **options)


# An indefinite matrix with a positive diagonal: nothing can see it up front. Breaks when a method does not
# notice on the way, but loops, returns NaN or claims convergence at a point that is none. The literal
# variant never looks at the curvature, as in the paper.
@pytest.mark.parametrize(
    "method", ["auto", "p-spg-fb", "p-spg-fb-literal", "interior-point", "newton", "apgd"]
)
@pytest.mark.parametrize("cones", ["nonnegative", "bilateral"])
def test_indefinite_matrix_ends_cleanly(method, cones):
    A = random_spd(6) - 4 * np.eye(6)
    np.fill_diagonal(A, np.abs(np.diag(A)))
    assert np.linalg.eigvalsh(A)[0] < 0 < A.diagonal().min()
    problem = amontons.vi.Problem(A, np.linspace(-1, 1, 6), cones)
    limits = {"method": method, "deadline": 2, "max_iterations": 20000}
    if method != "p-spg-fb-literal":
        with pytest.raises(amontons.InputError, match="A is not positive semidefinite"):
            problem.solve(**limits)
        return
    solution = problem.solve(**limits)
    assert np.isfinite(solution.x).all()
    assert not solution.converged
    assert problem.residual(solution.x) > 1e-6


# Breaks when bad input raises something that users do not expect to catch.
def test_errors_are_value_errors():
    assert issubclass(amontons.InputError, ValueError)
    assert issubclass(amontons.FileError, amontons.InputError)
    assert issubclass(amontons.vi.SymmetrisedWarning, UserWarning)
