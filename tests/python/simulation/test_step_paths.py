"""Which way a step took: every name of `Report.path` is reached, and the residual is that of the result."""

import amontons
import numpy as np
import pytest
from amontons import ModelBuilder, scenes, shapes


def crowded(**options):
    """Bodies that start inside each other in a closed room."""
    rng = np.random.default_rng(1)
    b = ModelBuilder()
    for axis in range(3):
        for side in (-1, 1):
            half, at = [1.2, 1.2, 1.2], [0.0, 0.0, 0.0]
            half[axis], at[axis] = 0.1, 1.1 * side
            b.add_geom(None, shapes.Box(half), position=at)
    for k in range(14):
        density = 1000 * 1e16 ** rng.uniform(-0.5, 0.5)
        shape = shapes.Sphere(0.1) if k % 2 else shapes.Ellipsoid((0.1, 0.08, 0.06))
        b.add_body(shape=shape, density=density, position=rng.uniform(-0.15, 0.15, 3))
    return amontons.Simulation(b.build(), on_failure="ignore", **options)


def spinning_hinges():
    """Bodies that turn by radians within a step, about axes that are none of their own."""
    b = ModelBuilder(gravity=(0, 0, 0))
    rng = np.random.default_rng(2)
    for k in range(5):
        axis = rng.standard_normal(3)
        axis /= np.linalg.norm(axis)
        body = b.add_body(
            shape=shapes.Capsule(0.05, 0.3), density=1000, position=(k, 0, 0), angular_velocity=600 * axis
        )
        b.add_revolute_joint(body, None, point=(k + 0.05, 0.1, 0), axis=axis)
    return amontons.Simulation(b.build(), dt=0.01, on_failure="ignore")


def hanging_chain(**options):
    return amontons.Simulation(scenes.chain(links=10), on_failure="ignore", **options)


def box_on_floor():
    b = ModelBuilder()
    b.add_floor()
    b.add_body(shape=shapes.Box((0.1, 0.1, 0.1)), position=(0, 0, 0.1), mass=1.0)
    return amontons.Simulation(b.build())


WAYS = {
    "accurate": (box_on_floor, {}),
    "joints_restored": (hanging_chain, {"max_iterations": 1, "method": "gauss-seidel"}),
    "budget_spent": (hanging_chain, {"budget": 1e-6}),
    "impulses_scaled": (spinning_hinges, {}),
    "bodies_stopped": (crowded, {"max_iterations": 1}),
}


# Breaks when a way is no longer taken, or is taken without a word; and when what follows the solve changes
# the impulses but not the residual: it is that of the problem at the impulses, whatever changed them.
@pytest.mark.parametrize("path", WAYS)
def test_every_path_is_reached_and_reports_the_true_residual(path):
    make, options = WAYS[path]
    sim, paths = make(**options), set()
    for _ in range(100):
        report = sim.step()
        paths.add(report.path)
        true = sim.problem().residual(sim.forces.impulses, law=sim.options["law"])
        assert report.residual == pytest.approx(true, rel=1e-6, abs=1e-12)
        assert report.converged == (report.status == "converged" and report.balanced)
        assert report.path != "accurate" or report.status != "made_safe"
    assert path in paths


# Breaks when the report counts no solver calls, or counts starts that were accepted.
def test_solves_are_counted():
    sim = box_on_floor()
    assert sim.step().solves >= 1
    for _ in range(20):
        report = sim.step()
    assert report.solves == 0
