"""Iterates from outside: the protocol, and the reference in NumPy, against those of the compiled module."""

import signal

import amontons
import numpy as np
import pytest
from device_problems import NAMES, compare_to_cpu, problems, random_problem
from numpy_iterate import NumpyIterate
from waiting import processor_time

METHODS = ("p-spg-fb", "apgd")
LAWS = ("associated", "coulomb")


# Breaks when a pass of NumPy, the layout or the way through the binding means something else than in C++.
@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("name", NAMES)
def test_numpy_is_the_cpu(name, method, law):
    def solve(problem, options):
        return problem.solve(iterate=NumpyIterate(problem, law=law), **options)

    compare_to_cpu(name, method, law, solve)


class Intervals:
    """Another iterate: dense A and one interval per row, in the words of amontons.vi.Iterate."""

    def __init__(self, A, b, low, high, P):
        self.A, self.b, self.low, self.high, self.P = A, b, low, high, P
        self.at, self.fault = None, None

    def passes(self, name):
        if self.at == name and self.fault:
            raise self.fault

    def map(self):
        step = self.u / self.P
        e = self.x - np.clip(self.x - step, self.low, self.high)
        return float(self.P @ e**2)

    def start(self, x0):
        self.passes("start")
        self.x = self.best = np.clip(x0, self.low, self.high)
        return self.refresh()

    def refresh(self):
        self.u = self.A @ self.x + self.b
        return self.map()

    def direction(self, alpha):
        self.passes("direction")
        self.d = np.clip(self.x - alpha * self.u / self.P, self.low, self.high) - self.x
        return self.d @ self.u, self.P @ self.d**2

    def curvature(self):
        self.Ad = self.A @ self.d
        return np.float64(self.d @ self.Ad)

    def update(self, lam):
        self.passes("update")
        s, y = lam * self.d, lam * self.Ad
        self.x, self.u = self.x + s, self.u + y
        return s @ y, np.sum(y**2 / self.P), self.map()

    def start_momentum(self):
        self.y, self.u_y = self.x, self.u

    def momentum_direction(self, alpha):
        self.d = np.clip(self.y - alpha * self.u_y / self.P, self.low, self.high) - self.y
        return self.P @ self.d**2, self.P @ (self.d * (self.y - self.x))

    def accelerate(self, beta):
        x, u = self.y + self.d, self.u_y + self.Ad
        self.y, self.u_y = x + beta * (x - self.x), u + beta * (u - self.u)
        self.x, self.u = x, u
        return self.map()

    def refresh_momentum(self):
        self.u_y = self.A @ self.y + self.b
        return self.refresh()

    def keep_best(self):
        self.best = self.x

    def extract_best(self):
        return self.best

    def extract(self):
        self.passes("extract")
        return self.x

    def objective(self):
        return 0.5 * self.x @ (self.u + self.b)


def bounded(n=40, seed=2):
    """A problem with intervals, and the iterate of it."""
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(n, n + 2))
    A, b = root @ root.T / n, rng.normal(size=n)
    low, high = np.full(n, -0.3), np.full(n, 0.5)
    problem = amontons.vi.Problem(A, b, [amontons.vi.Interval(low, high)])
    return problem, Intervals(A, b, low, high, problem.P)


# Breaks when an object with the passes of amontons.vi.Iterate, and nothing else, is not enough for a method.
@pytest.mark.parametrize("method", ["auto", *METHODS])
def test_an_iterate_of_ones_own(method):
    problem, iterate = bounded()
    solution = problem.solve(method=method, iterate=iterate, tolerance=1e-9, history=True)
    assert solution.converged
    assert solution.device == "Intervals"
    assert len(solution.history) > solution.iterations
    np.testing.assert_allclose(solution.x, problem.solve(tolerance=1e-12).x, atol=1e-8)


# Breaks when an exception of a pass is swallowed, or an interrupt in a pass loses the best x.
def test_what_a_pass_raises():
    problem, iterate = bounded()
    iterate.at, iterate.fault = "update", RuntimeError("no device any more")
    with pytest.raises(RuntimeError, match="no device any more"):
        problem.solve(method="p-spg-fb", iterate=iterate)

    class Interrupted(Intervals):
        count = 0

        def direction(self, alpha):
            self.count += 1
            if self.count == 9:
                raise KeyboardInterrupt
            return super().direction(alpha)

    iterate = Interrupted(iterate.A, iterate.b, iterate.low, iterate.high, iterate.P)
    solution = problem.solve(method="p-spg-fb", iterate=iterate, tolerance=0)
    assert solution.status == "interrupted"
    assert 0 < solution.residual < 1
    assert iterate.count == 9


# Breaks when what a pass returns is used although it is no number.
@pytest.mark.parametrize(
    ("name", "result", "said"),
    [
        ("start", None, "start() must return a number, not a NoneType"),
        ("direction", 1.0, "direction() must return 2 numbers"),
        ("update", (1, 2), "update() must return 3 numbers"),
        ("update", (1, 2, "x"), "update() must return a number, not a str"),
        ("extract_best", [1.0], "extract_best() must return an array of 40 float64"),
        ("extract_best", np.zeros(3), "extract_best() must return an array of 40 float64"),
    ],
)
def test_results_of_passes_are_checked(name, result, said):
    problem, iterate = bounded()
    setattr(iterate, name, lambda *_: result)
    with pytest.raises(amontons.InputError) as caught:
        problem.solve(method="p-spg-fb", iterate=iterate, max_iterations=3)
    assert said in str(caught.value)


# Breaks when an iterate is taken where nobody asks it, or beside a device.
def test_an_iterate_that_cannot_be_used():
    problem, iterate = bounded()
    with pytest.raises(amontons.InputError, match="has no use for an iterate"):
        problem.solve(method="newton", iterate=iterate)
    with pytest.raises(amontons.InputError, match="exclude each other"):
        problem.solve(device="numpy", iterate=iterate)
    with pytest.raises(amontons.InputError, match=r"is a str without start\(\)"):
        problem.solve(iterate="numpy")
    with pytest.raises(amontons.InputError, match="circular friction cones and single rows only"):
        NumpyIterate(problem)


# Breaks when a limit of the driver does not hold for an iterate from outside.
def test_limits_hold():
    problem = problems()["wall"]
    options = dict(method="p-spg-fb", device="numpy", tolerance=0)
    late = problem.solve(deadline=0.2, **options)
    assert late.status == "deadline"
    assert late.time < 0.5
    seen = []
    stopped = problem.solve(callback=lambda r: seen.append(r.residual) or len(seen) == 5, **options)
    assert (stopped.status, len(seen)) == ("interrupted", 5)
    assert problem.solve(max_iterations=7, **options).iterations == 7


# Breaks when a step on a device goes on although its budget is spent, or a failing pass spoils the state.
@pytest.mark.alone
def test_a_simulation_with_numpy(monkeypatch):
    model = amontons.scenes.make("spheres_in_box", count=40)
    options = dict(method="apgd", tolerance=0, device="numpy", device_contacts=1, on_failure="ignore")
    sim = amontons.Simulation(model, max_iterations=3, **options)
    sim.run(0.15)
    hurried = amontons.Simulation(model, budget=0.02, **options)
    for _ in range(30):
        with processor_time() as spent:
            hurried.step()
    assert spent.seconds < 0.5
    before = sim.state.positions.copy(), sim.time

    def fails(self, alpha):
        raise RuntimeError("the cable is out")

    monkeypatch.setattr(NumpyIterate, "momentum_direction", fails)
    with pytest.raises(RuntimeError, match="the cable is out"):
        sim.step()
    np.testing.assert_array_equal(sim.state.positions, before[0])
    assert sim.time == before[1]
    monkeypatch.undo()
    assert sim.step().advanced


# Breaks when P is not that of the formulas: of a block the mean of diag(A) over its rows.
def test_preconditioner():
    problem = random_problem(20, 6, 9)
    diagonal = problem.A.to_sparse().diagonal()
    own = np.repeat(diagonal[:60].reshape(-1, 3).mean(axis=1), 3)
    np.testing.assert_allclose(problem.P, [*own, *diagonal[60:]], rtol=1e-12)


# Breaks when Ctrl-C during a pass is lost, or comes out as an exception.
@pytest.mark.skipif(not hasattr(signal, "setitimer"), reason="no interval timer")
def test_ctrl_c():
    problem = problems()["drum"]
    before = signal.signal(signal.SIGALRM, signal.default_int_handler)
    try:
        signal.setitimer(signal.ITIMER_REAL, 0.5)
        solution = problem.solve(method="p-spg-fb", law="coulomb", device="numpy", tolerance=0)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)
    assert solution.status == "interrupted"
    assert np.isfinite(solution.x).all()


# Breaks when Ctrl-C while the arrays of a problem are uploaded comes out as an exception.
def test_ctrl_c_while_an_iterate_is_made(monkeypatch):
    def interrupted(problem, law):
        raise KeyboardInterrupt

    monkeypatch.setattr(NumpyIterate, "of_core", interrupted)
    solution = problems()["wall"].solve(method="apgd", device="numpy")
    assert (solution.status, solution.device) == ("interrupted", "numpy")
