"""What solve returns, and how it can be watched and stopped."""

import os
import signal
import threading

import amontons
import numpy as np
import pytest
import scipy.sparse.linalg
from problems import EXAMPLES, one_contact, random_spd
from waiting import LONGEST, processor_time


def wall():
    return amontons.vi.read_problem(EXAMPLES / "wall_impact.hdf5")


FOREVER = {"tolerance": 0, "max_iterations": 10**9, "method": "p-spg-fb-literal"}


# A = I, b = (-1, v, 0). Sticking for v <= mu: u = 0. Else associated: x is the projection of -b on the cone.
@pytest.mark.parametrize("v", [0.3, 2.0])
def test_one_contact_associated(v):
    A, b, cones = one_contact(mu=0.5, tangential_velocity=v)
    solution = amontons.vi.solve(A, b, cones, law="associated", tolerance=1e-12)
    foot = (1 + 0.5 * v) / 1.25
    expected = [1, -v, 0] if v <= 0.5 else [foot, -0.5 * foot, 0]
    assert np.allclose(solution.x, expected, atol=1e-10)
    assert np.allclose(solution.u, solution.x + b)


# Coulomb: u_n = 0 while sliding, so x_n = 1 and x_t = -mu; no lift. Breaks when the De Saxce term is lost.
def test_one_contact_coulomb_slides_without_lift():
    A, b, cones = one_contact(mu=0.5, tangential_velocity=2.0)
    solution = amontons.vi.solve(A, b, cones, law="coulomb", tolerance=1e-10)
    assert solution.converged
    assert np.allclose(solution.x, [1, -0.5, 0], atol=1e-8)
    assert amontons.vi.residual(amontons.vi.Problem(A, b, cones), solution.x, law="coulomb") < 1e-9
    assert amontons.vi.residual(amontons.vi.Problem(A, b, cones), solution.x, law="associated") > 0.1


# Breaks when a field is missing, has another type, or the history is not that of the solve.
def test_solution_is_complete():
    problem = wall()
    solution = problem.solve(method="p-spg-fb", max_iterations=50, tolerance=1e-12, history=True)
    assert isinstance(solution, amontons.vi.Solution)
    assert solution.x.shape == solution.u.shape == (problem.rows,)
    assert np.allclose(solution.u, problem.A @ solution.x + problem.b, atol=1e-12)
    assert solution.status == "iteration_limit"
    assert not solution.converged
    assert solution.iterations == 50
    assert solution.method == "p-spg-fb"
    assert solution.residual == pytest.approx(amontons.vi.residual(problem, solution.x), rel=1e-12)
    assert solution.objective == pytest.approx(0.5 * solution.x @ (solution.u + problem.b))
    history = solution.history
    assert history.dtype.names == (
        "iteration", "products", "time", "residual", "best_residual", "objective", "step", "backtracks"
    )  # fmt: skip
    assert np.array_equal(history["iteration"], np.arange(len(history)))
    assert np.array_equal(history["best_residual"], np.minimum.accumulate(history["residual"]))
    assert np.all(np.diff(history["time"]) >= 0)
    assert history["products"][-1] <= solution.products
    assert problem.solve(max_iterations=2).history is None


# Breaks when the printed form hides what a user looks for.
def test_repr_tells_the_outcome():
    solution = amontons.vi.solve(np.eye(1), [1.0], "bilateral")
    text = repr(solution)
    for word in ("converged", "method", "residual", "objective", "products", "1 impulses"):
        assert word in text
    problem = repr(wall())
    for word in ("wall impact", "868", "Factored(43 bodies", "Friction(0.6, n=289)", "Bilateral"):
        assert word in problem


# Breaks when the arrays of a solution die with it, or are copied.
def test_arrays_outlive_the_solution():
    solution = amontons.vi.solve(np.eye(2), [1.0, 2.0], "bilateral")
    x = solution.x
    assert np.shares_memory(x, solution.x)
    del solution
    assert x.tolist() == [-1.0, -2.0]


# Breaks when auto does not say what it did.
def test_auto_says_what_it_picked():
    solution = wall().solve(tolerance=1e-3, deadline=5)
    assert solution.method in amontons.vi.methods()
    assert solution.method != "auto"
    assert solution.reason


# Breaks when the phases are not those that ran, or the reason says something else than they do.
def test_phases_are_what_ran():
    # Plates of mass ratios: apgd slows down, the path and Newton's method take over.
    problem = amontons.vi.read_problem(EXAMPLES / "plates.hdf5")
    solution = problem.solve(law="coulomb", tolerance=1e-12, max_iterations=400, history=True)
    assert len(solution.phases) > 1
    assert solution.phases[0].method == "apgd"
    assert sum(phase.iterations for phase in solution.phases) == solution.iterations
    # That of the best, or of the joints that were made anew for it, which may cost a factor of two.
    assert any(phase.residual == pytest.approx(solution.residual, rel=1e-6) for phase in solution.phases)
    assert solution.residual <= 2.01 * min(phase.residual for phase in solution.phases)
    best = min(solution.phases, key=lambda phase: phase.residual)
    assert best.method == solution.method
    told = (
        f"{p.method} ({p.iterations} iterations, residual {p.residual:.1e}: {p.why})" for p in solution.phases
    )
    assert solution.reason == ", ".join(told)
    assert solution.objective == pytest.approx(0.5 * solution.x @ (solution.u + problem.b))
    alone = problem.solve(method="apgd", max_iterations=2)
    assert alone.phases == []
    assert not alone.reason


# Breaks when the callback sees something else than the history, or its result is ignored.
def test_callback_watches_and_stops():
    seen = []

    def callback(record):
        seen.append((record.iteration, record.residual, record.products))
        return record.iteration >= 7

    solution = wall().solve(method="p-spg-fb", callback=callback, history=True)
    assert solution.status == "interrupted"
    assert [s[0] for s in seen] == list(range(8))
    assert [s[1] for s in seen] == solution.history["residual"].tolist()
    assert "iteration=7" not in repr(solution)
    assert np.isfinite(solution.x).all()


# Breaks when an exception inside the solve is swallowed, replaced, or leaves the problem unusable.
def test_exceptions_propagate():
    problem = wall()

    def callback(record):
        if record.iteration == 3:
            raise ZeroDivisionError("from the callback")

    with pytest.raises(ZeroDivisionError, match="from the callback"):
        problem.solve(method="p-spg-fb", callback=callback)

    calls = []

    def matvec(x):
        calls.append(x)
        if len(calls) == 5:
            raise KeyError("from the product")
        return problem.A @ x

    A = scipy.sparse.linalg.LinearOperator(problem.A.shape, matvec=matvec, dtype=float)
    with pytest.raises(KeyError, match="from the product"):
        amontons.vi.solve(A, problem.b, problem.cones, method="p-spg-fb")
    assert problem.solve(max_iterations=2, method="p-spg-fb").iterations == 2


# Breaks when the vector handed to a callable is reused afterwards: keeping it must be safe.
def test_callable_may_keep_its_argument():
    kept = []
    dense = random_spd(6)

    def matvec(x):
        kept.append((x, x.copy()))
        return dense @ x

    A = scipy.sparse.linalg.LinearOperator((6, 6), matvec=matvec, dtype=float)
    amontons.vi.solve(A, -np.ones(6), "nonnegative", method="p-spg-fb")
    assert len(kept) > 1
    assert all(np.array_equal(x, copy) for x, copy in kept)


# Breaks when Ctrl-C is lost, raises, or waits for the end of the solve. What a shell runs in the background
# ignores it, hence the handler.
def test_ctrl_c_returns_the_best_iterate(request):
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    request.addfinalizer(lambda: signal.signal(signal.SIGINT, before))
    problem = wall()
    timer = threading.Timer(0.2, os.kill, (os.getpid(), signal.SIGINT))
    timer.start()
    solution = problem.solve(**FOREVER, deadline=LONGEST)
    timer.join()
    assert solution.status == "interrupted"
    assert solution.residual < 1
    assert solution.residual == pytest.approx(problem.residual(solution.x), rel=1e-9)


# Breaks when a KeyboardInterrupt that lands in Python code called by the solver escapes or corrupts x.
@pytest.mark.parametrize("where", ["callback", "product"])
def test_ctrl_c_inside_python_code(where):
    problem = wall()
    calls = []

    def interrupt(*_):
        calls.append(None)
        if len(calls) == 9:
            raise KeyboardInterrupt

    def matvec(x):
        interrupt()
        return problem.A @ x

    if where == "callback":
        solution = problem.solve(**FOREVER, callback=interrupt)
    else:
        A = scipy.sparse.linalg.LinearOperator(problem.A.shape, matvec=matvec, dtype=float)
        solution = amontons.vi.solve(A, problem.b, problem.cones, **FOREVER)
    assert solution.status == "interrupted"
    assert np.isfinite(solution.x).all()


# Breaks when the solve keeps the interpreter to itself.
def test_other_threads_run_meanwhile():
    count, stop = [0], threading.Event()

    def work():
        while not stop.wait(1e-3):
            count[0] += 1

    thread = threading.Thread(target=work)
    thread.start()
    before = count[0]
    wall().solve(**FOREVER, deadline=1.0)
    during = count[0] - before
    stop.set()
    thread.join()
    assert during > 5  # before and after the solve one each


# Breaks when one problem cannot be solved by several threads at a time.
def test_one_problem_in_two_threads():
    problem = wall()
    alone = problem.solve(max_iterations=300, method="p-spg-fb", tolerance=0).x
    found = [None, None]

    def work(i):
        found[i] = problem.solve(max_iterations=300, method="p-spg-fb", tolerance=0).x

    threads = [threading.Thread(target=work, args=(i,)) for i in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert all(np.array_equal(x, alone) for x in found)


# Breaks when a deadline is overrun by more than a few polls, or the result is not usable.
@pytest.mark.alone
def test_deadline_holds():
    with processor_time() as spent:
        solution = wall().solve(**FOREVER, deadline=0.1)
    assert solution.status == "deadline"
    assert spent.seconds < 1.0
    assert solution.residual < 1


# Breaks when options of a method do not reach it.
@pytest.mark.parametrize(
    ("method", "option"),
    [
        ("p-spg-fb-literal", {"memory": 0}),
        ("p-spg-fb-literal", {"alpha_max": 1.01, "alpha_min": 1e-3}),
        ("p-spg-fb", {"gamma": 0.9}),
        ("gauss-seidel", {"omega": 1.5}),
        ("jacobi", {"omega": 0.01}),
    ],
)
def test_method_options_reach_the_method(method, option):
    problem = wall()
    limits = {"tolerance": 0, "max_iterations": 40, "method": method}
    default = problem.solve(**limits)
    changed = problem.solve(**limits, **option)
    assert not np.array_equal(default.x, changed.x)


# Breaks when a measure is zero away from a solution, or not at one.
def test_residual_norms_and_violations():
    A, b, cones = one_contact(mu=0.5, tangential_velocity=0.3)
    problem = amontons.vi.Problem(A, b, cones)
    for norm in ("natural", "plain", "plain_inf", "siconos"):
        assert amontons.vi.residual(problem, [1, -0.3, 0], norm=norm) == pytest.approx(0, abs=1e-15)
        assert amontons.vi.residual(problem, [0.5, 0, 0], norm=norm) > 0.1
    assert amontons.vi.residual(problem, np.zeros(3)) == 1
    v = amontons.vi.violations(problem, [0.0, 0.2, 0.0])
    assert v.penetration_velocity == pytest.approx(1)
    assert v.cone > 0.1
    assert amontons.vi.violations(problem, [1, -0.3, 0]).complementarity == pytest.approx(0, abs=1e-15)
