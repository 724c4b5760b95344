"""Matrix Market and NumPy archives."""

import amontons
import numpy as np
import pytest
import scipy.sparse as sp
from problems import EXAMPLES, pile, random_spd

CONES = [
    amontons.vi.Interval([-1, -np.inf], [1, 0]),
    amontons.vi.Friction([0.0, 0.7]),
    amontons.vi.NonNegative(2),
    amontons.vi.Bilateral(1),
    amontons.vi.Friction(0.2),
    amontons.vi.Interval(0, np.inf),
]


def matrices():
    dense = random_spd(15)
    return {
        "dense": dense,
        "sparse": sp.csr_array(np.where(np.abs(dense) > 3, dense, 0)),
        "list": dense.tolist(),
    }


# Breaks when an order, bound or coefficient of a cone is lost, or numbers are rounded in text.
@pytest.mark.parametrize("suffix", [".npz", ".mtx"])
@pytest.mark.parametrize("kind", matrices())
def test_any_product_of_cones_round_trips(kind, suffix, tmp_path):
    A = matrices()[kind]
    b = np.random.default_rng(0).normal(size=15) * 1e-3
    problem = amontons.vi.Problem(A, b, CONES, name="n", description="d", source="s", guesses=[b, 2 * b])
    problem.write(tmp_path / f"p{suffix}")
    again = amontons.vi.read_problem(tmp_path / f"p{suffix}")
    toarray = lambda M: M.toarray() if sp.issparse(M) else np.asarray(M)  # noqa: E731
    assert np.array_equal(toarray(again.A), toarray(problem.A))
    assert np.array_equal(again.b, b)
    assert [type(c) for c in again.cones] == [type(c) for c in CONES]
    for ours, theirs in zip(again.cones, CONES, strict=True):
        for field in ("n", "mu", "lo", "hi"):
            assert np.array_equal(getattr(ours, field, None), getattr(theirs, field, None))
    assert (again.name, again.description, again.source) == ("n", "d", "s")
    assert np.array_equal(again.guesses, [b, 2 * b])


# Breaks when the factored form is expanded on the way through an archive, or its numbers change.
def test_factored_operator_stays_factored(tmp_path):
    A, b, cones = pile()
    amontons.vi.Problem(A, b, cones).write(tmp_path / "p.npz")
    again = amontons.vi.read_problem(tmp_path / "p.npz")
    assert isinstance(again.A, amontons.vi.Factored)
    x = np.arange(len(b), dtype=float)
    assert np.array_equal(again.A @ x, A.stored() @ x)


# Breaks when an HDF5 problem changes by going through Matrix Market and back.
def test_fclib_to_matrix_market_and_back(tmp_path):
    problem = amontons.vi.read_problem(EXAMPLES / "wall_impact.hdf5")
    problem.write(tmp_path / "p.mtx")
    assert {p.name for p in tmp_path.iterdir()} == {"p.mtx", "p.npz"}
    again = amontons.vi.read_problem(tmp_path / "p.mtx")
    again.write(tmp_path / "q.hdf5")
    final = amontons.vi.read_problem(tmp_path / "q.hdf5")
    x = np.random.default_rng(2).normal(size=problem.rows)
    assert np.allclose(final.A @ x, problem.A @ x, rtol=0, atol=1e-12)
    assert np.array_equal(final.b, problem.b)


# Breaks when an archive of plain arrays, made by hand, needs more than A, b and mu.
def test_archive_made_by_hand(tmp_path):
    A = sp.csr_array(random_spd(6))
    np.savez(tmp_path / "p.npz", A_data=A.data, A_indices=A.indices, A_indptr=A.indptr, b=np.ones(6), mu=0.4)
    problem = amontons.vi.read_problem(tmp_path / "p.npz")
    assert problem.contacts == 2
    assert problem.mu.tolist() == [0.4, 0.4]
