"""What solve accepts for A and cones, and that all of it means the same."""

import amontons
import numpy as np
import pytest
import scipy.sparse as sp
import scipy.sparse.linalg
from problems import one_contact, pile, random_spd

N = 9
DENSE = random_spd(N)
B = np.random.default_rng(4).normal(size=N)


class Minimal:
    """The least that A can be: a shape and a product."""

    shape = (N, N)

    def matvec(self, x):
        return DENSE @ x


class WithDiagonal(Minimal):
    def diagonal(self):
        return DENSE.diagonal()


KINDS = {
    "dense": DENSE,
    "fortran": np.asfortranarray(DENSE),
    "list": DENSE.tolist(),
    "float32-exact": sp.csr_array(DENSE),
    "csr_array": sp.csr_array(DENSE),
    "csr_matrix": sp.csr_matrix(DENSE),
    "csc_array": sp.csc_array(DENSE),
    "csc_matrix": sp.csc_matrix(DENSE),
    "bsr_array": sp.bsr_array(DENSE, blocksize=(3, 3)),
    "coo_array": sp.coo_array(DENSE),
    "lil": sp.lil_array(DENSE),
    "operator": scipy.sparse.linalg.aslinearoperator(DENSE),
    "minimal": Minimal(),
    "diagonal": WithDiagonal(),
}


# Breaks when a format is transposed, truncated or refused. CSC of a symmetric matrix is its CSR.
@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_of_matrix_gives_the_same_solution(kind):
    expected = amontons.vi.solve(DENSE, B, "friction", mu=0.4, tolerance=1e-10)
    found = amontons.vi.solve(KINDS[kind], B, "friction", mu=0.4, tolerance=1e-10, method="p-spg-fb")
    assert found.converged
    assert np.allclose(found.x, expected.x, atol=1e-7)


# Breaks when int64 indices, unsorted columns, duplicates or integers are taken as they are.
def test_unusual_sparse_storage():
    A = sp.csr_array(DENSE)
    wide = A.copy()
    wide.indices, wide.indptr = A.indices.astype(np.int64), A.indptr.astype(np.int64)
    reverse = sp.csr_array((DENSE[:, ::-1].ravel(), np.tile(np.arange(N)[::-1], N), A.indptr))
    rows, columns = np.r_[np.repeat(range(N), N), range(N)], np.r_[np.tile(range(N), N), range(N)]
    coo = sp.coo_array((np.r_[DENSE.ravel(), np.ones(N)], (rows, columns)))
    for matrix, dense in ((wide, DENSE), (reverse, DENSE), (coo, DENSE + np.eye(N))):
        problem = amontons.vi.Problem(matrix, B, "bilateral")
        assert np.allclose(problem.A.toarray(), dense)
        assert np.allclose(
            amontons.vi.solve(matrix, B, "bilateral", tolerance=1e-12).x, np.linalg.solve(dense, -B)
        )
    integers = amontons.vi.Problem(np.diag(np.arange(1, N + 1)), B, "bilateral")
    assert np.allclose(integers.solve(tolerance=1e-12).x, -B / np.arange(1, N + 1))


# Breaks when large matrices start to be copied on their way in.
def test_matrices_are_not_copied():
    csr, csc = sp.csr_array(DENSE), sp.csc_array(DENSE)
    assert np.shares_memory(amontons.vi.Problem(csr, B, "bilateral").A.data, csr.data)
    assert np.shares_memory(amontons.vi.Problem(csc, B, "bilateral").A.data, csc.data)
    assert np.shares_memory(amontons.vi.Problem(DENSE, B, "bilateral").A, DENSE)
    fortran = np.asfortranarray(DENSE)
    assert np.shares_memory(amontons.vi.Problem(fortran, B, "bilateral").A, fortran)


# Breaks when the core keeps a pointer to memory that Python has freed.
def test_problem_keeps_its_matrix_alive():
    problem = amontons.vi.Problem(sp.csr_array(DENSE), B, "bilateral")
    x = problem._core.product(B)
    problem._A = None
    garbage = [np.full((N, N), np.nan) for _ in range(100)]
    assert np.array_equal(problem._core.product(B), x)
    assert len(garbage) == 100


# Breaks when the names for all rows do not mean what the objects do.
@pytest.mark.parametrize(
    ("name", "cones"),
    [
        ("bilateral", [amontons.vi.Bilateral(9)]),
        ("nonnegative", [amontons.vi.NonNegative(4), amontons.vi.NonNegative(5)]),
        ("friction", [amontons.vi.Friction([0.4] * 3)]),
        ("friction", [amontons.vi.Friction(0.4, n=2), amontons.vi.Friction(0.4)]),
    ],
)
def test_names_of_cones(name, cones):
    mu = 0.4 if name == "friction" else None
    named = amontons.vi.solve(DENSE, B, name, mu=mu, tolerance=1e-10)
    listed = amontons.vi.solve(DENSE, B, cones, tolerance=1e-10)
    assert np.array_equal(named.x, listed.x)


# Breaks when mu is dealt out to contacts in another order than rows have.
def test_mu_is_dealt_out_in_row_order():
    cones = [amontons.vi.Friction(n=1), amontons.vi.Bilateral(3), amontons.vi.Friction(n=1)]
    problem = amontons.vi.Problem(DENSE, B, cones, mu=[0.1, 0.9])
    assert [c.mu.tolist() for c in problem.cones if isinstance(c, amontons.vi.Friction)] == [[0.1], [0.9]]
    assert amontons.vi.Problem(DENSE, B, [amontons.vi.Friction(n=2), *cones[1:2]], mu=0.5).mu.tolist() == [
        0.5,
        0.5,
    ]
    assert amontons.vi.Problem(np.eye(3), np.ones(3), amontons.vi.Friction(mu=1, n=1)).mu.tolist() == [1.0]


# Breaks when the factored operators differ from D M^-1 D' + E.
def test_factored_operators_equal_their_matrix():
    contacts, b, cones = pile()
    stored = contacts.stored()
    D, E = stored.jacobian(), stored.compliance
    expected = (D @ stored.inverse_mass_matrix() @ D.T).toarray() + np.diag(E)
    x = np.random.default_rng(0).normal(size=len(b))
    assert E.tolist() == [*np.repeat(contacts.compliance, 3), 0.0, 0.2]
    for A in (contacts, stored):
        assert np.allclose(A @ x, expected @ x)
        assert np.allclose(A.diagonal(), expected.diagonal())
        assert np.allclose(A.to_sparse().toarray(), expected)
    solutions = [
        amontons.vi.solve(A, b, cones, tolerance=1e-9).objective for A in (contacts, stored, expected)
    ]
    assert np.allclose(solutions, solutions[0], rtol=1e-8)


# Rows 3c + k of a contact are n, t1, t2 acting on body a at r_a with the sign +. Breaks when signs change.
def test_rows_of_a_contact():
    normal = np.array([0.6, 0.0, 0.8])
    A = amontons.vi.Contacts([1.0, 2.0], np.ones((2, 3)), [1], [0], [[1, 2, 3]], [[0, 1, 0]], [normal])
    axes = np.vstack([normal, A.tangents[0]])
    assert np.allclose(axes @ axes.T, np.eye(3))
    assert np.linalg.det(axes) == pytest.approx(1)
    stored = A.stored()
    assert np.allclose(stored.jacobian_a, np.hstack([axes, np.cross([1, 2, 3], axes)]))
    assert np.allclose(stored.jacobian_b, -np.hstack([axes, np.cross([0, 1, 0], axes)]))


# Breaks when later changes of the caller's b reach the problem, or the problem's b can be changed.
def test_b_belongs_to_the_problem():
    A, b, cones = one_contact()
    problem = amontons.vi.Problem(A, b, cones)
    b[:] = 0
    assert problem.b[0] == -1
    with pytest.raises(ValueError, match="read-only"):
        problem.b[0] = 0
