"""How long a step may take, whatever is in it."""

from itertools import pairwise

import amontons
import numpy as np
import pytest
from amontons import scenes, shapes
from middle import energies_in_the_middle


def hopeless():
    """Nothing meets a tolerance of zero."""
    return amontons.Simulation(scenes.make("stack", boxes=10), dt=5e-3, tolerance=0, on_failure="ignore")


def work_of(report):
    """Products and dense factorisations, as a share of the limit (`most_work` in solve_step.hpp)."""
    blocks = report.contacts + report.joint_rows
    factorization = (3 * blocks) ** 3 / 3 / 80
    work = report.products * (blocks + 16) + report.factorizations * factorization
    return work / (4e4 * (1 + blocks))


# Breaks when a step that cannot be solved works on without bound, leaves its state, or ends otherwise the
# next time: its limit counts work, and no time. A share of it is for one solve; an iteration may be long.
def test_step_that_cannot_be_solved_ends():
    def made():
        sim = hopeless()
        return sim, [sim.step() for _ in range(3)]

    (first, reports), (second, _) = made(), made()
    for report in reports:
        assert work_of(report) < 1
        assert report.advanced
        assert report.residual < 1e-6
    np.testing.assert_array_equal(first.state.positions, second.state.positions)


# Breaks when a body that spins some million times in a step takes seconds for it, or energy from nothing.
def test_spin_that_no_step_follows():
    builder = amontons.ModelBuilder(gravity=(0, 0, 0))
    builder.add_body(shape=shapes.Box((1e-3, 2e-3, 3e-3)), density=1, angular_velocity=(3e8, 2e8, 1e8))
    sim = amontons.Simulation(builder.build(), dt=5e-3)
    report = sim.step()
    assert report.advanced
    before = report.kinetic_energy
    assert sim.step().kinetic_energy <= before * (1 + 1e-9)


# Breaks when the turned inertia of a body on a hinge, about an axis that is none of its own, gives energy:
# the impulses of the hinge turn its momentum, and a step that turns it by radians sees neither on the way.
# Where it has become slow the second order may give some per cent in a step; without the bound it is whole
# multiples. Velocities of an instant are no measure of it here: they are those of the middle and half of
# their change, which turns with the body.
@pytest.mark.parametrize("turn", [1.0, 3.0, 6.0])
def test_fast_hinges_make_no_energy(turn):
    builder = amontons.ModelBuilder(gravity=(0, 0, 0))
    rng = np.random.default_rng(2)
    for k in range(5):
        axis = rng.standard_normal(3)
        axis /= np.linalg.norm(axis)
        body = builder.add_body(
            shape=shapes.Capsule(0.05, 0.3),
            density=1000,
            position=(k, 0, 0),
            angular_velocity=turn / 0.01 * axis + rng.standard_normal(3),
        )
        builder.add_revolute_joint(body, None, point=(k + 0.05, 0.1, 0), axis=axis)
    sim = amontons.Simulation(builder.build(), dt=0.01, on_failure="ignore")
    before = np.inf
    for _ in range(30):
        sim.step()
        energy, _ = energies_in_the_middle(sim)
        assert energy <= 1.03 * before
        before = energy


# Breaks when impulses that there was no time to find make energy: with a budget that is spent before the
# first solve, every step of bodies that start inside each other, with joints between them, is such a
# step. What is not allowed is taken back, whatever else they lack then.
def test_steps_without_time_make_no_energy():
    rng = np.random.default_rng(3)
    builder = amontons.ModelBuilder()
    builder.add_geom(None, shapes.Plane())
    bodies = [
        builder.add_body(
            shape=shapes.Box((0.1, 0.05, 0.02)),
            density=10.0 ** rng.uniform(1, 5),
            position=0.15 * rng.random(3),
        )
        for _ in range(10)
    ]
    for a, b in pairwise(bodies):
        builder.add_revolute_joint(a, b, point=0.15 * rng.random(3), axis=(0, 1, 0), stiffness=1e3, damping=1)
    for recovery in ("projection", "velocity"):
        sim = amontons.Simulation(
            builder.build(), dt=5e-3, budget=1e-9, recovery=recovery, on_failure="ignore"
        )
        for _ in range(50):
            report = sim.step()
            assert report.balanced
            assert np.isfinite(sim.state.positions).all()
        # Falling for a quarter of a second gives 2.5 m/s.
        assert np.abs(sim.state.linear_velocities).max() < 100


# Breaks when a step without time makes no iteration at all: a wall that nothing holds falls into itself
# within the second, by g t^2 / 2 and more, and its steps have the more contacts to look for; or when it
# begins a method that factors, for which there is no time.
def test_a_wall_stands_when_its_budget_is_spent_before_the_solve():
    model = scenes.wall_at_rest(columns=8, rows=6)
    sim = amontons.Simulation(model, dt=5e-3, budget=1e-9, on_failure="ignore")
    start = sim.state.positions.copy()
    for _ in range(200):
        report = sim.step()
        assert report.status in ("deadline", "converged")
        assert report.factorizations == 0
    # Each step goes on from the last one: they come to what one of them has no time for.
    assert report.residual < 1e-4
    assert np.abs(sim.state.positions - start).max() < 0.02 * model.length


# Breaks when a step that is hit drops the impulses of the last one because their residual is above that of
# none: in a few iterations nothing takes their place, and the pile sinks into itself by a quarter of a
# diameter. What falls freely goes g h^2 further in each step; a pile may be off by some of these.
def test_a_pile_stands_on_the_impulses_of_the_last_step():
    h = 1e-2
    model = scenes.spheres_in_box(count=500, mu=0.5)
    sim = amontons.Simulation(model, dt=h, max_iterations=5, on_failure="ignore")
    assert max(sim.step().penetration for _ in range(120)) < 3 * 9.81 * h**2


# Breaks when steps that are not solved, here by one iteration each, let others press bodies into what is
# fixed, by velocities or by the correction of positions; the centre of a box that lies is 0.1 m high.
@pytest.mark.parametrize("seed", range(3))
def test_no_body_sinks_into_its_floor_whatever_the_solve(seed):
    rng = np.random.default_rng(seed)
    builder = amontons.ModelBuilder()
    builder.add_geom(None, shapes.Box((50, 50, 0.5)), position=(0, 0, -0.5))
    for k in range(30):
        builder.add_body(
            shape=shapes.Box((0.1, 0.1, 0.1)),
            density=1000 * 10 ** rng.uniform(-2, 2),
            position=(*rng.uniform(-0.15, 0.15, 2), 0.15 + 0.25 * k),
            linear_velocity=(0, 0, -5.0),
        )
    sim = amontons.Simulation(builder.build(), max_iterations=1, on_failure="ignore")
    lowest = []
    for _ in range(300):
        assert sim.step().balanced
        lowest.append(sim.state.positions[:, 2].min())
    assert min(lowest) > 0.05


# Breaks when what a step that is not solved throws away, with velocities of any size, leaves through a wall:
# bodies of 1e-8 to 1e8 times the density of water that start inside each other, in a closed room of 2 m.
# Walls must be looked for from where the bodies are, whatever holds them there, and spins of many turns in a
# step, which no contact foresees, must be none.
@pytest.mark.parametrize(("seed", "iterations"), [(0, 20), (1, 1), (1, 20), (3, 1)])
def test_nothing_leaves_a_room_whatever_the_solve(seed, iterations):
    rng = np.random.default_rng(seed)
    builder = amontons.ModelBuilder()
    for axis in range(3):
        for side in (-1, 1):
            half, at = [1.2, 1.2, 1.2], [0.0, 0.0, 0.0]
            half[axis], at[axis] = 0.1, 1.1 * side
            builder.add_geom(None, shapes.Box(half), position=at)
    kinds = (shapes.Sphere(0.1), shapes.Ellipsoid((0.1, 0.08, 0.06)), shapes.Box((0.1, 0.08, 0.05)))
    for k in range(14):
        turn = rng.standard_normal(4)
        builder.add_body(
            shape=kinds[k % 3],
            density=1000 * 1e16 ** rng.uniform(-0.5, 0.5),
            position=rng.uniform(-0.15, 0.15, 3),
            orientation=turn / np.linalg.norm(turn),
        )
    sim = amontons.Simulation(builder.build(), max_iterations=iterations, on_failure="ignore")
    missed = 0
    for _ in range(100):
        report = sim.step()
        assert report.balanced
        missed += not report.converged
        assert np.abs(sim.state.positions).max() < 1.0
    assert missed > 0


# Breaks when closed contacts are told apart by gaps of what the last steps left: bricks on two others have
# more of them than freedoms, and each step would look for those that carry, with 500 products and not ten.
def test_a_wall_at_rest_costs_little_for_as_long_as_it_stands():
    sim = amontons.Simulation(scenes.wall_at_rest(columns=12, rows=10), dt=5e-3)
    products = []
    for _ in range(200):
        report = sim.step()
        products.append(report.products)
        assert report.converged
    assert np.mean(products[100:]) < 30
    # The slack of 40 steps of the tolerance, and what one step lets move.
    assert report.penetration < 2 * 40 * 1e-6 * 9.81 * 5e-3**2


# Breaks when bodies that are deep in each other, with no room to leave, are asked to close their other
# contacts by velocities: none does, and every step misses its tolerance.
def test_what_is_pressed_into_a_gap_that_is_too_narrow():
    builder = amontons.ModelBuilder()
    builder.add_geom(None, shapes.Plane())
    builder.add_geom(None, shapes.Box((1, 1, 0.1)), position=(0, 0, 0.48))
    for z in (0.1 - 1e-6, 0.28 + 1e-6):
        builder.add_body(shape=shapes.Box((0.1, 0.1, 0.1)), density=1000, position=(0, 0, z))
    sim = amontons.Simulation(builder.build(), recovery_speed=1e-9, on_failure="ignore")
    assert all(sim.step().converged for _ in range(50))


# Breaks when surfaces that interlock let bodies through: from some mu on the cone is a half space to
# rounding.
@pytest.mark.parametrize("mu", [1e3, 1e8, 1e30])
def test_friction_without_bound(mu):
    builder = amontons.ModelBuilder()
    rough = amontons.Material(friction=mu)
    builder.add_geom(None, shapes.Plane(), material=rough)
    for i in range(3):
        box = dict(shape=shapes.Box((0.1, 0.1, 0.1)), density=1000, material=rough)
        builder.add_body(**box, position=(0.03 * i, 0, 0.11 + 0.21 * i))
    sim = amontons.Simulation(builder.build(), dt=5e-3, on_failure="ignore")
    sim.run(0.5)
    np.testing.assert_allclose(sim.state.positions[:, 2], [0.1, 0.3, 0.5], atol=2e-3)
    with pytest.raises(amontons.InputError, match="friction is inf; it must be finite"):
        amontons.Material(friction=float("inf"))
