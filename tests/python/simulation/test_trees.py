"""Bodies in coordinates of their joints against closed forms, and against the form with rows of joints."""

import copy
import math
from dataclasses import replace

import amontons
import numpy as np
import pytest
from amontons import InputError, ModelBuilder, Simulation

G = 9.81


def chain(trees, links, *, gravity=(0, 0, -G), grounded=True):
    """Links of 1 m along x; hinges, balls, slides and universal joints in turn."""
    b = ModelBuilder(trees=trees, gravity=gravity)
    for i in range(links):
        name, before = f"link{i}", f"link{i - 1}" if i else None
        b.add_body(name, mass=1 + 0.3 * i, inertia=(0.01, 0.02, 0.03), position=(i + 0.5, 0, 0))
        if i == 0 and not grounded:
            continue
        point = (float(i), 0, 0)
        if i % 4 == 0:
            b.add_revolute_joint(name, before, point=point, axis=(0, 1, 0.2))
        elif i % 4 == 1:
            b.add_ball_joint(name, before, point=point)
        elif i % 4 == 2:
            b.add_prismatic_joint(name, before, point=point, axis=(0, 0, 1), stiffness=40.0, damping=0.5)
        else:
            b.add_universal_joint(name, before, point=point, axis_1=(0, 1, 0), axis_2=(0, 0, 1))
    return b.build()


def run(model, duration, dt, **options):
    simulation = Simulation(model, dt=dt, **options)
    reports = [simulation.step() for _ in range(round(duration / dt))]
    return simulation, reports


def test_both_forms_go_to_the_same_motion_at_second_order():
    """A wrong velocity term or mass leaves a difference that does not fall with the square of the step."""
    far = []
    for dt in (2e-3, 1e-3, 5e-4):
        by_rows, by_trees = (run(chain(trees, 5), 0.5, dt)[0] for trees in ("none", "auto"))
        far.append(np.abs(by_rows.state.positions - by_trees.state.positions).max())
    assert far[0] < 1e-3
    assert far[0] / far[1] > 3.5
    assert far[1] / far[2] > 3.5


def test_joints_of_trees_have_neither_rows_nor_errors():
    """A joint left among the rows would count here, and drift would show as an error."""
    _, by_rows = run(chain("none", 5), 0.1, 2e-3)
    _, by_trees = run(chain("auto", 5), 0.1, 2e-3)
    assert by_rows[-1].joint_rows > 15
    assert max(r.joint_rows for r in by_trees) == 0
    assert max(r.joint_error for r in by_trees) < 1e-13


def test_a_long_chain_that_snaps_straight_stays_closed():
    """60 links of 10 g carry 10 kg, let go from the horizontal: rows of joints open by 10 cm here."""
    b = ModelBuilder(trees="auto")
    for i in range(60):
        before = f"link{i - 1}" if i else None
        b.add_body(f"link{i}", mass=0.01, inertia=(1e-6, 1e-5, 1e-5), position=(0.1 * i + 0.05, 0, 0))
        point = (0.1 * i, 0, 0)
        if i % 2:
            b.add_ball_joint(f"link{i}", before, point=point)
        else:
            b.add_revolute_joint(f"link{i}", before, point=point, axis=(0, 1, 0))
    b.add_body("load", mass=10.0, inertia=(0.1, 0.1, 0.1), position=(6.05, 0, 0))
    b.add_fixed_joint("load", "link59", point=(6.0, 0, 0))
    simulation, reports = run(b.build(), 2.5, 5e-3)
    assert all(r.advanced for r in reports)
    # It passes the lowest point at 1.1 s; 6.05 m from the hinge it can be no farther than its links reach.
    reach = np.linalg.norm(simulation.state.positions[-1])
    assert reach < 6.05 + 1e-12
    assert max(r.joint_error for r in reports) < 1e-11


def loaded_chain(masses, load, length=0.2):
    """Hinges and balls in turn along x, with a load at the end."""
    b = ModelBuilder(trees="auto")
    for i, mass in enumerate(masses):
        name, before, point = f"link{i}", f"link{i - 1}" if i else None, (length * i, 0, 0)
        rod = mass * length**2 / 12
        b.add_body(name, mass=mass, inertia=(1e-2 * rod, rod, rod), position=(length * (i + 0.5), 0, 0))
        if i % 2:
            b.add_ball_joint(name, before, point=point)
        else:
            b.add_revolute_joint(name, before, point=point, axis=(0, 1, 0))
    end = length * len(masses)
    b.add_body("load", mass=load, inertia=(0.01 * load,) * 3, position=(end + 0.05, 0, 0))
    b.add_fixed_joint("load", name, point=(end, 0, 0))
    return b.build()


@pytest.mark.parametrize(
    ("masses", "load"),
    [
        ([0.01] * 200, 10.0),
        ([1.0, 1e-9, 1e-9, 1e-9], 17.0),
        ([1.0, 1e-9, 1.0, 1e-9, 1.0, 1e-9], 17.0),
        ([1e-3] * 9, 1.0),
        ([10 ** (-i / 3) for i in range(10)], 1e-4),
    ],
)
def test_chains_of_any_masses_stay_closed_and_gain_no_energy(masses, load):
    """Let go from the horizontal, a light end whips: explicit velocity terms create energy without bound."""
    model = loaded_chain(masses, load)
    simulation, reach = Simulation(model, dt=5e-3), 0.2 * len(masses) + 0.05
    links = G * sum(mass * 0.2 * (i + 0.5) for i, mass in enumerate(masses))
    before = simulation.state.positions[-1].copy()
    for _ in range(60 if len(masses) > 100 else 600):
        report = simulation.step()
        assert report.advanced
        assert report.joint_error < 1e-11
        assert report.status == "converged"
        now = simulation.state.positions[-1].copy()
        v, height = (now - before) / simulation.dt, 0.5 * (now + before)[2]
        before = now
        assert np.linalg.norm(now) < reach + 1e-12
        # The load has no more energy than the links can lose; a step of second order swings by a percent.
        assert load * (0.5 * v @ v + G * height) < links + 0.01 * load * G * reach


def test_a_link_that_friction_locks_has_a_solution():
    """An overlap by rounding along a hinge: no motion closes it, and without compliance impulses diverge."""
    b = ModelBuilder(trees="auto")
    box = amontons.shapes.Box((0.1, 0.1, 0.1))
    b.add_geom(None, box, position=(0.3, 0, -0.2 + 3e-8))
    b.add_geom(None, box, position=(0.3, 0, 0.2 - 3e-8))
    b.add_body("arm", mass=1.0, inertia=(0.01, 0.01, 0.01), position=(0.3, 0, 0), linear_velocity=(0, 0.3, 0))
    b.add_geom("arm", box)
    b.add_revolute_joint("arm", point=(0, 0, 0), axis=(0, 0, 1))
    _, reports = run(b.build(), 0.1, 2e-3)
    assert reports[0].contacts > 0
    assert {r.status for r in reports} == {"converged"}
    assert {r.path for r in reports} == {"accurate"}


def displaced(model, simulation, step):
    """Centres of mass and their sum of mass times position before and after a step."""
    mass = np.array([body.mass for body in model.bodies])
    step()
    return (mass[:, None] * simulation.state.positions).sum(0) / mass.sum()


def test_the_centre_of_a_free_tree_moves_straight():
    """Momentum: the sum of all impulses on a free tree is zero in each step, whatever its joints do."""
    model = chain("auto", 4, gravity=(0, 0, 0), grounded=False)
    simulation = Simulation(model, dt=2e-3)
    simulation.qd = np.random.default_rng(3).normal(size=len(simulation.qd))
    centres = np.array([displaced(model, simulation, simulation.step) for _ in range(500)])
    # The rates are found to 1e-9 of the fastest one, which is a few rad/s, on bodies within 4 m.
    change = np.abs(np.diff(centres, 2, axis=0)).max() / 2e-3
    assert change < 1e-9 * 4 * np.abs(simulation.qd).max()
    assert np.linalg.norm(centres[-1] - centres[0]) > 0.1


def share_lost_on_a_standing_base(trees):
    """Energy over m g l that two arms lose in 4 s at 5 ms as they swing on a base that stands on a floor."""
    b = ModelBuilder(trees=trees)
    b.add_floor()
    b.add_body("base", shape=amontons.shapes.Box((0.5, 0.5, 0.1)), mass=20.0, position=(0, 0, 0.1))
    b.add_geom("base", amontons.shapes.Box((0.5, 0.5, 0.1)))
    for i in range(2):
        b.add_body(f"arm{i}", mass=1.0, inertia=(0.01, 0.01, 0.01), position=(0.3 * (i + 1), 0, 1))
        b.add_revolute_joint(f"arm{i}", "base" if i == 0 else "arm0", point=(0.3 * i, 0, 1), axis=(0, 1, 0))
    simulation = Simulation(b.build(), dt=5e-3)
    energies = []
    for _ in range(800):
        report = simulation.step()
        assert report.status == "converged"
        energies.append(report.energy)
    assert trees == "none" or np.abs(simulation.state.positions[0] - (0, 0, 0.1)).max() < 1e-9
    return (np.mean(energies[:100]) - np.mean(energies[-100:])) / (2 * 0.3 * G)


@pytest.mark.parametrize("trees", ["none", "auto"])
def test_arms_that_swing_on_a_standing_base_keep_their_energy(trees):
    """Contacts of the base must not damp the joints."""
    # The error of a step of second order swings with the motion and does not add up.
    assert abs(share_lost_on_a_standing_base(trees)) < 1e-3


def machine(trees):
    """What a robot has: a base on feet, servos with limits, dry friction, stops, a compliant loop."""
    b = ModelBuilder(trees=trees)
    b.add_floor()
    box = amontons.shapes.Box
    b.add_body("base", shape=box((0.3, 0.3, 0.05)), mass=4.0, position=(0, 0, 0.05))
    b.add_geom("base", box((0.3, 0.3, 0.05)))
    for i, x in enumerate((0.2, 0.5, 0.8)):
        name, before = f"link{i}", f"link{i - 1}" if i else "base"
        b.add_body(name, mass=0.4, inertia=(1e-3, 2e-3, 2e-3), position=(x, 0, 0.4))
        b.add_geom(name, box((0.1, 0.03, 0.03)))
        b.add_revolute_joint(
            name,
            before,
            point=(x - 0.15, 0, 0.4),
            axis=(0, 1, 0),
            name=f"hinge{i}",
            limits=(-0.8, 0.6),
            friction=0.02,
            damping=0.02,
            armature=0.004,
            motor=amontons.Motor("position", kp=30.0, kd=1.0, max_effort=6.0) if i == 0 else None,
        )
    b.add_body("strut", mass=0.3, inertia=(1e-3, 1e-3, 1e-3), position=(0.35, 0.1, 0.4))
    b.add_revolute_joint("strut", "link0", point=(0.2, 0.1, 0.4), axis=(0, 1, 0))
    b.add_revolute_joint("strut", "link1", point=(0.5, 0.1, 0.4), axis=(0, 1, 0), compliance=1e-5)
    return b.build()


def test_a_machine_moves_alike_in_both_forms():
    """Contacts, stops, servos, friction, drives and a loop act on trees as on rows."""
    by_rows, before = run(machine("none"), 0.4, 5e-4)
    by_trees, reports = run(machine("auto"), 0.4, 5e-4)
    assert all(r.status == "converged" for r in reports)
    assert before[-1].contacts == reports[-1].contacts > 0
    assert np.abs(by_rows.state.positions - by_trees.state.positions).max() < 5e-4
    for table, unit in (("joint_reactions", "force"), ("joint_efforts", "passive")):
        ours, theirs = getattr(by_trees.forces, table), getattr(by_rows.forces, table)
        ours, theirs = (t() if callable(t) else t for t in (ours, theirs))
        assert np.abs(np.asarray(ours[unit]) - np.asarray(theirs[unit])).max() < 0.2


def four_bar(trees):
    """A parallelogram in a vertical plane, pushed along its bar."""
    b = ModelBuilder(trees=trees)
    for name, x in (("left", 0.0), ("right", 0.8)):
        b.add_body(name, mass=1, inertia=(0.02, 0.02, 0.001), position=(x, 0, -0.25))
        b.add_revolute_joint(name, point=(x, 0, 0), axis=(0, 1, 0))
    b.add_body("bar", mass=2, inertia=(0.01, 0.1, 0.1), position=(0.4, 0, -0.5))
    b.add_revolute_joint("bar", "left", point=(0, 0, -0.5), axis=(0, 1, 0))
    b.add_revolute_joint("bar", "right", point=(0.8, 0, -0.5), axis=(0, 1, 0))
    return b.build()


def test_a_planar_loop_that_its_tree_holds_in_the_plane():
    """No motion of the tree changes three rows of the loop: a compliance relative to it is none."""
    ends = []
    for trees in ("none", "auto"):
        simulation = Simulation(four_bar(trees), dt=1e-3, tolerance=1e-9)
        simulation.state.forces[2] = (3, 0, 0)
        reports = [simulation.step() for _ in range(400)]
        assert {r.status for r in reports} == {"converged"}
        ends.append(simulation.state.positions[2].copy())
    # Both forms are of second order: (h w)^2 / 12 of a swing of 7 cm at w = 4 rad/s is far below this.
    assert np.abs(ends[0] - ends[1]).max() < 1e-5
    assert ends[1][0] > 0.46


def test_joints_that_close_loops_are_of_second_order():
    """Breaks when the rates of the last step stand for how bodies came: then 1e-4 m at any step."""
    errors = []
    for dt in (2e-3, 1e-3):
        simulation = Simulation(four_bar("auto"), dt=dt, tolerance=1e-9)
        simulation.state.forces[2] = (15, 0, 0)
        errors.append(max(simulation.step().joint_error for _ in range(round(1 / dt))))
    assert errors[1] < 2e-7
    assert errors[0] / errors[1] > 3


def test_loops_stop_velocities_that_they_forbid():
    """Breaks when only the velocities that rates have count as those of the last step: the loop tears."""
    simulation = Simulation(four_bar("auto"), dt=1e-3, tolerance=1e-9)
    simulation.state.linear_velocities = [(1, 0.5, -2), (-3, 0, 1), (0.5, 2, 3)]
    assert max(simulation.step().joint_error for _ in range(20)) < 1e-9


def hanging(trees="auto"):
    """Two weights on balls, at rest below each other, on the world."""
    b = ModelBuilder(trees=trees)
    b.add_body("upper", mass=2.0, inertia=(0.1, 0.1, 0.1), position=(0, 0, -1))
    b.add_body("lower", mass=3.0, inertia=(0.1, 0.1, 0.1), position=(0, 0, -3))
    b.add_ball_joint("upper", point=(0, 0, 0))
    b.add_revolute_joint("lower", "upper", point=(0, 0, -2), axis=(0, 1, 0))
    return b.build()


def test_reactions_carry_what_hangs():
    """By the recursive equations: each joint carries all weight below it."""
    simulation, _ = run(hanging(), 0.01, 2e-3)
    forces = (
        simulation.forces.joint_reactions()["force"]
        if callable(simulation.forces.joint_reactions)
        else (simulation.forces.joint_reactions["force"])
    )
    assert np.allclose(np.asarray(forces), [[0, 0, 5 * G], [0, 0, 3 * G]], atol=1e-9)


def test_an_impact_travels_through_the_joints():
    """A hanging rod struck at its end bounces: its hinge carries the rest of the impulse."""
    out = {}
    for trees in ("none", "auto"):
        b = ModelBuilder(trees=trees, gravity=(0, 0, 0))
        sphere = amontons.shapes.Sphere(0.1)
        elastic = amontons.Material(restitution=1.0, friction=0.0)
        b.add_body("rod", mass=3.0, inertia=(0.01, 0.25, 0.25), position=(0, 0, -0.5))
        b.add_geom("rod", sphere, position=(0, 0, -0.5), material=elastic)
        b.add_revolute_joint("rod", point=(0, 0, 0), axis=(0, 1, 0), damping=5.0, name="pivot")
        b.add_body("ball", shape=sphere, mass=1.0, position=(-0.2005, 0, -1), linear_velocity=(1, 0, 0))
        b.add_geom("ball", sphere, material=elastic)
        simulation = Simulation(b.build(), dt=1e-3)
        simulation.step()
        spin = simulation.state.angular_velocities[0, 1]
        out[trees] = (
            simulation.state.linear_velocities[1],
            simulation.forces.joint_reactions["force"][0],
            spin,
        )
    # Inertia about the pivot 1 kg m^2 against 1 kg at 1 m: the ball stops, and the rod takes all. The damper
    # must not take part in the impact.
    assert np.allclose(out["auto"][0], 0, atol=1e-6)
    assert np.allclose(out["auto"][0], out["none"][0], atol=1e-6)
    assert np.isclose(out["auto"][1][0], out["none"][1][0], rtol=1e-6)
    # And the pull of the rod on its circle, m omega^2 / 2, to first order in the step.
    assert np.isclose(out["auto"][1][2], 3.0 * 0.5 * out["auto"][2] ** 2, rtol=1e-2)


def test_users_may_move_bodies_of_trees():
    """A pose that was written into the state is fitted by the joints, and kept where it fits."""
    simulation = Simulation(chain("auto", 3), dt=1e-3)
    other = Simulation(chain("auto", 3), dt=1e-3)
    other.q = np.array(other.q) + np.r_[0.3, np.zeros(len(other.q) - 1)]
    simulation.state.positions[:] = other.state.positions
    simulation.state.orientations[:] = other.state.orientations
    for s in (simulation, other):
        s.step()
    assert np.allclose(simulation.state.positions, other.state.positions, atol=1e-12)
    # Torn off by 0.5 m it comes back: the joint has no row that could leave it open.
    simulation.state.positions[1] += (0, 0, 0.5)
    assert simulation.step().joint_error < 1e-13


def test_copies_and_saved_states_continue_bit_for_bit(tmp_path):
    """All that the future depends on is in the state: no coordinate lives elsewhere."""
    simulation, _ = run(chain("auto", 5), 0.05, 2e-3)
    twin = copy.copy(simulation)
    simulation.save(tmp_path / "state.h5")
    restored = Simulation.load(tmp_path / "state.h5")
    for s in (simulation, twin, restored):
        for _ in range(20):
            s.step()
    for s in (twin, restored):
        assert s.state.positions.tobytes() == simulation.state.positions.tobytes()
        assert s.state.orientations.tobytes() == simulation.state.orientations.tobytes()


@pytest.mark.parametrize("method", ["p-spg-fb", "apgd", "interior-point", "newton", "gauss-seidel"])
def test_every_method_solves_steps_of_trees(method):
    """Methods that read masses and rows would solve another problem: they get the matrix."""
    reference, _ = run(machine("auto"), 0.01, 1e-3)
    simulation, reports = run(machine("auto"), 0.01, 1e-3, method=method, tolerance=1e-8)
    assert max(r.residual for r in reports) < 1e-6
    assert np.allclose(simulation.state.positions, reference.state.positions, atol=1e-6)


def test_the_problem_of_a_step_has_the_trees_in_it(tmp_path):
    """Its matrix is symmetric, and its impulses leave the velocities that the residual claims."""
    simulation, _ = run(machine("auto"), 0.01, 1e-3)
    problem = simulation.problem()
    again = problem.solve(tolerance=1e-10)
    assert again.status == "converged"
    assert math.isclose(again.residual, 0, abs_tol=1e-9)
    # It can be printed, its matrix read, and both written.
    assert "dense" in repr(problem)
    assert np.abs(problem.A - problem.A.T).max() <= 1e-12 * np.abs(problem.A).max()
    problem.write(tmp_path / "problem.npz")
    read = amontons.vi.read_problem(tmp_path / "problem.npz")
    assert np.array_equal(read.b, problem.b)
    assert np.array_equal(read.A, problem.A)


def test_lattices_and_compliant_joints_keep_rows():
    """Rules of `auto`: a compliant joint is a spring, and most joints of a lattice close loops."""
    b = ModelBuilder(trees="auto")
    for i in range(2):
        b.add_body(f"body{i}", mass=1.0, inertia=(0.1, 0.1, 0.1), position=(i, 0, 0))
    b.add_revolute_joint("body0", point=(0, 0, 0), axis=(0, 1, 0))
    b.add_revolute_joint("body1", "body0", point=(0.5, 0, 0), axis=(0, 1, 0), compliance=1e-6)
    assert Simulation(b.build(), dt=1e-3).step().joint_rows == 5
    lattice = ModelBuilder(trees="auto")
    corners = [(i, j, k) for i in range(3) for j in range(3) for k in range(3)]
    for i, corner in enumerate(corners):
        lattice.add_body(f"body{i}", mass=1.0, inertia=(0.1, 0.1, 0.1), position=corner)
    for a, p in enumerate(corners):
        for c in range(a):
            if sum(abs(x - y) for x, y in zip(p, corners[c], strict=True)) == 1:
                middle = tuple((x + y) / 2 for x, y in zip(p, corners[c], strict=True))
                lattice.add_ball_joint(f"body{a}", f"body{c}", point=middle)
    model = lattice.build()
    assert Simulation(model, dt=1e-3).step().joint_rows == 3 * len(model.joints)


def test_wrong_values_are_named():
    with pytest.raises(InputError, match="trees"):
        ModelBuilder(trees="all")
    with pytest.raises(InputError, match="trees"):
        replace(hanging(), trees="some")


# Breaks when the matrix of a step without rows divides by their number: Python ends.
def test_the_problem_of_a_tree_without_rows():
    builder = ModelBuilder()
    builder.add_body("bob", mass=1, inertia=(1,) * 3)
    builder.add_revolute_joint("bob", axis=(0, 1, 0), point=(0, 0, 1))
    sim = Simulation(replace(builder.build(), trees="auto"))
    sim.step()
    assert sim.problem().A.shape == (0, 0)
    assert "rows:  0" in repr(sim.problem())


def test_many_contacts_on_few_coordinates_are_solved_directly():
    """210 rows on two links, whose race the limit of rows would start, although W has seven coordinates."""
    b = ModelBuilder(trees="auto")
    b.add_floor()
    for k in range(2):
        b.add_body(f"plank{k}", mass=1.0, inertia=(0.01, 0.1, 0.1), position=(k, 0, 0.05))
        for i in range(35):
            at = (-0.45 + 0.15 * (i % 7), -0.2 + 0.1 * (i // 7), 0)
            b.add_geom(f"plank{k}", amontons.shapes.Sphere(0.05), position=at)
    b.add_revolute_joint("plank1", "plank0", point=(0.5, 0, 0.05), axis=(0, 1, 0))
    _, reports = run(b.build(), 0.02, 2e-3)
    assert all(r.converged and r.contacts == 70 for r in reports)
    assert {r.method for r in reports} <= {"elimination", "warm start"}


def arm_on_a_pile():
    """Three layers of boxes, 34 in all, and an arm of three links that stands on them: one island."""
    b = ModelBuilder(trees="auto")
    b.add_floor()
    for z, layer in enumerate(((4, 4), (4, 3), (3, 2))):
        for x, y in np.ndindex(*layer):
            at = (0.2 * x + 0.1 * (z == 2), 0.2 * y + 0.1 * z, 0.1 + 0.2 * z)
            b.add_body(shape=amontons.shapes.Box((0.098, 0.098, 0.1)), density=500, position=at)
    link = amontons.shapes.Box((0.1, 0.05, 0.03))
    for k in range(3):
        x = 0.2 + 0.22 * k
        b.add_body(f"link{k}", shape=link, density=800, position=(x, 0.3, 0.63))
        if k:
            b.add_revolute_joint(f"link{k}", f"link{k - 1}", point=(x - 0.11, 0.3, 0.63), axis=(0, 1, 0))
    return b.build()


def test_sparse_factors_of_a_tree_among_free_bodies():
    """Breaks when such an island has no factors, which its first steps need, or they depend on threads."""
    found = []
    for threads in (1, 3):
        simulation = Simulation(arm_on_a_pile(), dt=2e-3, tolerance=1e-8, threads=threads)
        reports = [simulation.step() for _ in range(4)]
        assert all(r.converged for r in reports)
        assert "interior-point" in {r.method for r in reports}
        assert sum(r.factorizations for r in reports) < 60
        found.append(simulation.state.positions.tobytes())
    assert found[0] == found[1]
