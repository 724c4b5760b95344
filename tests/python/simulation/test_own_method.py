"""A Python function as the method of a simulation: when it is believed, and what follows from its faults."""

import copy
import gc
import pickle
import weakref

import amontons
import numpy as np
import pytest
from amontons import StepWarning

SEEN = []


def apgd(problem, x0, options):
    """Named as a method that there is, which it must not become."""
    SEEN.append((problem, x0.copy(), options))
    x0 *= 2  # the start is the function's to change
    return problem.solve(method="apgd", tolerance=options.tolerance).x


def stack(method="auto", **options):
    return amontons.Simulation(amontons.scenes.stack(boxes=2), dt=5e-3, method=method, **options)


@pytest.fixture(autouse=True)
def _forget():
    SEEN.clear()


# Breaks when the function is not called, gets another problem, or the motion is another one.
@pytest.mark.parametrize("law", ["coulomb", "associated"])
def test_it_makes_the_steps(law):
    simulation, other = stack(apgd, law=law, tolerance=1e-9), stack(law=law, tolerance=1e-9)
    report = simulation.step()
    other.step()
    assert report.status == "converged"
    assert report.method == "apgd"
    assert report.path == "accurate"
    assert np.allclose(simulation.state.positions, other.state.positions, atol=1e-9)
    problem, x0, options = SEEN[-1]
    assert isinstance(problem, amontons.vi.Problem)
    assert problem.law == options.law == law
    assert options.tolerance <= 1e-9
    assert options.max_iterations is None
    assert options.deadline is None
    assert x0.shape == (problem.rows,)
    assert problem.residual(simulation.forces.impulses) <= 1e-9
    assert np.array_equal(problem.b, simulation.problem().b)


# A problem that was kept is not that of a later step. Breaks when the memory of the step is handed out.
def test_problems_may_be_kept():
    simulation = stack(apgd, tolerance=1e-12, warm_start=False)
    simulation.step()
    problem = SEEN[-1][0]
    b = problem.b.copy()
    for _ in range(3):
        simulation.step()
    assert np.array_equal(problem.b, b)


# Breaks when an x is believed that is no solution, or when it moves bodies into the floor.
@pytest.mark.parametrize(
    "wrong", [0.0, -1.0, 1.0, 1e6, 1e300, np.nan, np.inf, -np.inf], ids=lambda value: f"{value:g}"
)
def test_a_wrong_x_has_not_converged(wrong):
    simulation = stack(lambda problem, x0, options: np.full(problem.rows, wrong))
    before = simulation.state.positions.copy()
    for _ in range(5):
        with pytest.warns(StepWarning, match=r"residual of .* above the tolerance .*<lambda>: stalled"):
            report = simulation.step()
        assert report.status == "stalled"
        assert report.path != "accurate"
        assert report.residual > 1e-6
        assert report.balanced
    assert np.isfinite(simulation.state.positions).all()
    assert simulation.state.positions[:, 2] == pytest.approx(before[:, 2], abs=0.01)


# With on_failure="raise" the state is put back, as with every method.
def test_on_failure():
    simulation = stack(lambda problem, x0, options: x0 * 0, on_failure="raise")
    before = simulation.state.positions.copy()
    with pytest.raises(amontons.SimulationError):
        simulation.step()
    assert np.array_equal(simulation.state.positions, before)
    assert simulation.time == 0


def raises(problem, x0, options):
    raise RuntimeError("no idea")


# Breaks when an exception or a wrong answer ends the process, is swallowed, or leaves half a step.
@pytest.mark.parametrize(
    ("method", "error", "message"),
    [
        (raises, RuntimeError, "no idea"),
        (lambda problem, x0, options: 1 / 0, ZeroDivisionError, "division"),
        (lambda problem: None, TypeError, "positional"),
        (
            lambda problem, x0, options: None,
            amontons.InputError,
            "returned None; it must return the impulses x, ",
        ),
        (lambda problem, x0, options: 3.0, amontons.InputError, r"returned 3.0; it must return"),
        (
            lambda problem, x0, options: x0[:2],
            amontons.InputError,
            "returned 2 impulses; the problem has 24 rows",
        ),
        (lambda problem, x0, options: x0.reshape(-1, 3), amontons.InputError, r"has shape \(8, 3\)"),
        (lambda problem, x0, options: ["a"] * 24, amontons.InputError, "must hold real numbers"),
        (lambda problem, x0, options: x0 * 1j, amontons.InputError, "is complex"),
    ],
)
def test_what_it_does_wrong_ends_the_step(method, error, message):
    simulation = stack(method)
    before = simulation.state.positions.copy()
    with pytest.raises(error, match=message) as caught:
        simulation.step()
    if error not in (amontons.InputError,):
        assert "in a step, which was undone" in caught.value.__notes__[0]
    assert np.array_equal(simulation.state.positions, before)
    assert simulation.time == 0
    simulation.change_options(method="auto")
    assert simulation.step().status == "converged"


# A function that steps its own simulation would find it in the middle of a step.
def test_no_step_within_a_step():
    simulation = stack(lambda problem, x0, options: simulation.step())
    with pytest.raises(amontons.InputError, match="in the middle of a step"):
        simulation.step()


# Impulses of rows with moments are in the user's units. Breaks when x or x0 are those of the core.
def test_units_of_moments():
    builder = amontons.ModelBuilder()
    material = amontons.Material(friction=0.5, torsional_friction=0.01, rolling_friction=0.005)
    builder.add_geom(None, amontons.shapes.Plane(), material=material)
    builder.add_body(
        "ball", shape=amontons.shapes.Sphere(0.03), density=1000, position=(0, 0, 0.03), material=material,
        linear_velocity=(0.3, 0, 0), angular_velocity=(0, 10, 20),
    )  # fmt: skip
    model = builder.build()
    mine = amontons.Simulation(model, method=apgd, tolerance=1e-10)
    theirs = amontons.Simulation(model, tolerance=1e-10)
    for _ in range(10):
        assert mine.step().status == "converged"
        theirs.step()
    assert SEEN
    assert np.allclose(mine.state.angular_velocities, theirs.state.angular_velocities, atol=1e-5)


# Copies and worlds side by side call it too; a function of a module can be pickled with its simulation.
def test_copies():
    simulation = stack(apgd, warm_start=False)
    for other in (simulation.copy(), copy.deepcopy(simulation), pickle.loads(pickle.dumps(simulation))):
        SEEN.clear()
        other.step()
        assert SEEN
    assert simulation.options["method"] is apgd
    assert simulation.time == 0
    SEEN.clear()
    result = amontons.rollout(simulation.model, [simulation] * 3, steps=2, threads=2)
    assert len(SEEN) >= 6
    assert result.residuals.max() <= 1e-6
    with pytest.warns(StepWarning, match="no idea"):
        failed = amontons.rollout(
            simulation.model, [amontons.Simulation(simulation.model, method=raises)], steps=2
        )
    assert "no idea" in failed.failures[0]


# A function does not go into a file; what is there says so, even where its name is that of a method.
def test_files(tmp_path):
    simulation = stack(apgd)
    simulation.save(tmp_path / "s.h5")
    with pytest.raises(amontons.FileError, match="its method is the function 'apgd'.*load it with method="):
        amontons.Simulation.load(tmp_path / "s.h5")
    again = amontons.Simulation.load(tmp_path / "s.h5", method=apgd)
    again.step()
    assert SEEN
    with amontons.record(tmp_path / "r.h5", again):
        again.run(0.02)
    assert amontons.read_recording(tmp_path / "r.h5").options["method"] == "apgd"


# Breaks when the compiled module keeps the function, or lets go of it while a copy needs it.
def test_it_lives_as_long_as_its_simulations():
    class Method:
        def __call__(self, problem, x0, options):
            return problem.solve().x

    method = Method()
    gone = weakref.ref(method)
    simulation = stack(method)
    del method
    other = simulation.copy()
    del simulation
    gc.collect()
    assert other.step().status == "converged"
    assert other.step().method in ("Method", "warm start")
    del other
    gc.collect()
    assert gone() is None


@pytest.mark.parametrize("method", [3, None, ["auto"]])
def test_what_is_no_method(method):
    with pytest.raises(amontons.InputError, match="unknown method"):
        stack(method)
