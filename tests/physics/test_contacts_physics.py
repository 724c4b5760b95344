"""Contacts: restitution, belts, compliance, rolling, deep overlap, bullets, against closed forms."""

import math

import amontons
import numpy as np
import pytest
from amontons import Material, shapes
from measures import bounce_heights
from middle import kick, middle

G = 9.81


def about(axis, angle):
    """The unit quaternion of a rotation."""
    axis = np.asarray(axis, float) / np.linalg.norm(axis)
    return (math.cos(angle / 2), *(math.sin(angle / 2) * axis))


@pytest.mark.parametrize("h", [1e-3, 5e-3])
@pytest.mark.parametrize("e", [0.0, 0.5, 1.0])
def test_bounce_height(e, h):
    # Dropped by 1 m it rises by e^2 m. The impact is at the start of its step, by d <= v h above the floor,
    # and the ball rises by d + e^2 (1 - d); e = 0 stays down. Between two steps the top is g h^2 / 8 higher.
    heights = bounce_heights(e, h, 1.3)
    low = int(np.argmin(heights[: round(0.7 / h)]))
    more = max(heights[low:]) - e * e
    assert -G * h * h / 8 - 1e-9 < more < (1 - e * e) * math.sqrt(2 * G) * h + 1e-9


@pytest.mark.parametrize("e", [0.5, 0.9])
def test_what_bounces_off_a_blow_stops_at_the_wall(e):
    # A ball of 1 kg at 20 m/s strikes one of 10 g, which flies off at (1 + e) 20 / 1.01 m/s: in this step, by
    # three times its way to a wall that is thinner than that, and that no velocity foresaw. It passes the
    # wall if the look at the end of the step asks what the solve changed, and not what the impact did before.
    b = amontons.ModelBuilder(gravity=(0, 0, 0))
    material = Material(restitution=e)
    for x, mass, speed in ((0, 1.0, 20.0), (0.21, 0.01, 0.0)):
        b.add_body(
            shape=shapes.Sphere(0.1), mass=mass, position=(x, 0, 0), linear_velocity=(speed, 0, 0),
            material=material,
        )  # fmt: skip
    b.add_geom(None, shapes.Box((0.01, 1, 1)), position=(0.42, 0, 0), material=material)
    sim = amontons.Simulation(b.build(), dt=0.01)
    furthest = []
    sim.run(0.1, after_step=lambda s, _: furthest.append(s.state.positions[1, 0]))
    assert max(furthest) <= 0.31 + 1e-6
    assert furthest[0] > 0.3


@pytest.mark.parametrize("e", [0.5, 1.0])
@pytest.mark.parametrize("mu", [0.0, 0.2, 1.0])
def test_askew_impacts_create_no_energy(e, mu):
    # Newton's e with friction creates energy where friction turns the slip round (Kane and Levinson 1985): up
    # to 45 % in these falls. Tolerance: that of the solver, of the energy of the blow.
    worst = 0.0
    for shape in (shapes.Capsule(0.02, 0.3), shapes.Box((0.3, 0.05, 0.05)), shapes.Cylinder(0.1, 0.2)):
        for angle in (0.3, 0.5, 0.7, 0.9):
            for speed in (-1.0, 5.0):
                b = amontons.ModelBuilder()
                material = Material(friction=mu, restitution=e)
                b.add_geom(None, shapes.Plane(), material=material)
                b.add_body(
                    position=(0, 0, 0.4),
                    orientation=about((0.1, 1, 0.05), angle),
                    shape=shape,
                    mass=1.0,
                    linear_velocity=(speed, 0.3, -3),
                    angular_velocity=(0, 3, 0),
                    material=material,
                )
                sim = amontons.Simulation(b.build(), dt=2e-3)
                energies = []
                sim.run(0.2, after_step=lambda _, r, energies=energies: energies.append(r.energy))
                worst = max(worst, float(np.diff(energies).max()) / energies[0])
    assert worst < 1e-5


def test_forces_balance_in_a_tumbling_heap():
    # m (v+ - v-) / k - m g = sum of contact forces for every body in every kick, to rounding, impacts with
    # restitution included; momentum on the ground is that of the total. Friction stays within its cone.
    rng = np.random.default_rng(3)
    b = amontons.ModelBuilder()
    b.add_geom(None, shapes.Plane(), material=Material(restitution=0.4))
    kinds = [
        shapes.Sphere(0.1),
        shapes.Box((0.1, 0.08, 0.12)),
        shapes.Capsule(0.06, 0.1),
        shapes.Cylinder(0.1, 0.1),
    ]
    for i in range(8):
        b.add_body(
            position=(*rng.uniform(-0.15, 0.15, 2), 0.3 + 0.28 * i),
            shape=kinds[i % 4],
            density=500.0,
            linear_velocity=rng.normal(size=3),
            angular_velocity=5 * rng.normal(size=3),
        )
    sim = amontons.Simulation(b.build())
    mass = np.array([body.mass for body in sim.model.bodies])[:, None]
    for _ in range(200):
        before = np.array(middle(sim).state.linear_velocities)
        sim.step()
        rate = (middle(sim).state.linear_velocities - before) / kick(sim) - np.array([0, 0, -G])
        np.testing.assert_allclose(
            sim.forces.contact_forces()[0], mass * rate, atol=1e-10 * (G + np.abs(rate).max())
        )
        c = sim.contacts
        normal = np.einsum("ij,ij->i", c["force"], c["normal"])
        friction = np.linalg.norm(c["force"] - normal[:, None] * c["normal"], axis=1)
        assert (friction <= c["friction"] * normal + 1e-9 * np.abs(normal).max(initial=1)).all()


@pytest.mark.parametrize("direction", [(1, 0), (-1, 0), (0, 1), (0.6, -0.8)])
def test_belt_carries_a_box(direction):
    # mu g t while it slips, then the speed of the belt, whichever way the belt runs.
    b = amontons.ModelBuilder()
    b.add_geom(None, shapes.Plane(), surface_velocity=(*direction, 0))
    b.add_body(position=(0, 0, 0.1), shape=shapes.Box((0.2, 0.1, 0.1)), mass=2.0)
    sim = amontons.Simulation(b.build())
    sim.run(0.1)
    np.testing.assert_allclose(sim.state.linear_velocities[0, :2], 0.05 * G * np.array(direction), atol=1e-5)
    sim.run(0.5)
    np.testing.assert_allclose(sim.state.linear_velocities[0, :2], direction, atol=1e-5)


def test_belts_of_moving_bodies():
    # On a turned, moving platform the belt's velocity is in the platform's axes and adds to its motion; a
    # body drives itself backwards by its own belt; between a free conveyor and its load momentum stays zero.
    b = amontons.ModelBuilder()
    b.add_geom(None, shapes.Plane(), material=Material(friction=0.0), category=2, mask=2)
    platform = b.add_body(
        motion="kinematic",
        position=(0, 0, -0.1),
        orientation=about((0, 0, 1), math.pi / 2),
        linear_velocity=(0, 0.3, 0),
    )
    b.add_geom(platform, shapes.Box((5, 5, 0.1)), surface_velocity=(1, 0, 0))
    box = shapes.Box((0.1, 0.1, 0.1))
    load = b.add_body(position=(0, 0, 0.1), shape=box, mass=2.0)
    crawler = b.add_body(position=(1, 0, 0.1), mass=2.0, inertia=(0.1,) * 3)
    b.add_geom(crawler, box, surface_velocity=(0.5, 0, 0))
    conveyor = b.add_body(position=(20, 0, 0.1), mass=2.0, inertia=(1.0,) * 3)
    b.add_geom(conveyor, shapes.Box((2, 2, 0.1)), surface_velocity=(1, 0, 0), category=3, mask=3)
    cargo = b.add_body(position=(20, 0, 0.3), shape=box, mass=1.0)
    sim = amontons.Simulation(b.build())
    sim.run(1.0)
    v = sim.state.linear_velocities
    np.testing.assert_allclose(v[load], (0, 1.3, 0), atol=1e-5)
    # Its belt runs along x of the body, the platform's along y.
    np.testing.assert_allclose(v[crawler], (-0.5, 1.3, 0), atol=1e-5)
    assert v[cargo, 0] - v[conveyor, 0] == pytest.approx(1.0, abs=1e-5)
    assert v[cargo, 0] + 2 * v[conveyor, 0] == pytest.approx(0.0, abs=1e-5)


def test_turntable():
    # A box at the radius of half a metre rides on the spinning surface of a disc that stands: it keeps its
    # place on the surface: its speed is w r, its spin w. Friction of 0.5 g holds w^2 r = 0.5 m/s^2.
    b = amontons.ModelBuilder()
    b.add_geom(None, shapes.Cylinder(1.0, 0.05), position=(0.2, 0.1, 0.0), surface_spin=(0.0, 0.0, 1.0))
    b.add_body("box", position=(0.7, 0.1, 0.1), shape=shapes.Box((0.05, 0.05, 0.05)), mass=1.0)
    sim = amontons.Simulation(b.build(), dt=2e-3)
    sim.run(1.0)
    x, y, _ = sim.state.positions[0] - (0.2, 0.1, 0.0)
    assert math.hypot(x, y) == pytest.approx(0.5, abs=0.01)
    np.testing.assert_allclose(sim.state.linear_velocities[0], (-y, x, 0), atol=0.01)
    np.testing.assert_allclose(sim.state.angular_velocities[0], (0, 0, 1), atol=0.01)


def test_compliance_of_surfaces_adds():
    # Four points carry a quarter of the weight each, on springs in series: depth = m g / 4 (c1 + c2). Damping
    # of implicit Euler, h w^2 / 2 with w^2 = 4 / (m c) = 2000 / s^2: 5 / s, e^-25 is left after 5 s.
    b = amontons.ModelBuilder()
    b.add_geom(None, shapes.Plane(), material=Material(compliance=3e-4))
    b.add_body(
        position=(0, 0, 0.1), shape=shapes.Box((0.2, 0.1, 0.1)), mass=2.0, material=Material(compliance=7e-4)
    )
    sim = amontons.Simulation(b.build())
    sim.run(5.0)
    assert 0.1 - sim.state.positions[0, 2] == pytest.approx(2 * G / 4 * 1e-3, rel=1e-5)


def test_relaxation_of_a_compliant_contact():
    # On a spring 1/c with the damper tau / c the depth z of a mass follows m z'' = m g - (z + tau z') / c, at
    # rest at 0: with w^2 = 1 / (m c) and 2 a = tau w^2, z = m g c (1 - (p e^-qt - q e^-pt) / (p - q)), where
    # p, q = a +- sqrt(a^2 - w^2) are 135.1 and 37.0 / s here. First order: halving h halves the error.
    m, c, tau, t = 2.0, 1e-4, 0.0344, 0.03
    w2 = 1 / (m * c)
    a = 0.5 * tau * w2
    p, q = a + math.sqrt(a * a - w2), a - math.sqrt(a * a - w2)
    exact = m * G * c * (1 - (p * math.exp(-q * t) - q * math.exp(-p * t)) / (p - q))
    errors = []
    for h in (2e-4, 1e-4):
        b = amontons.ModelBuilder()
        b.add_geom(None, shapes.Plane(), material=Material(compliance=c, relaxation_time=tau))
        b.add_body(position=(0, 0, 0.1), shape=shapes.Sphere(0.1), mass=m)
        sim = amontons.Simulation(b.build(), dt=h)
        sim.run(t)
        errors.append(abs(0.1 - sim.state.positions[0, 2] - exact))
    assert errors[1] < 0.02 * exact
    assert errors[1] < 0.6 * errors[0]


def test_relaxation_of_two_materials_is_their_mean_by_compliance():
    b = amontons.ModelBuilder()
    b.add_geom(None, shapes.Plane(), material=Material(compliance=1e-4, relaxation_time=0.03))
    soft = Material(compliance=3e-4, relaxation_time=0.01)
    b.add_body(position=(0, 0, 0.1), shape=shapes.Sphere(0.1), mass=1.0, material=soft)
    sim = amontons.Simulation(b.build())
    sim.step()
    # 0.015 s: x_n = -k (gap + (h + tau) u) / c of the first step from rest at gap 0, with u = -g k + x_n / m
    # and its kick k = h / 2.
    h, c, tau = 5e-3, 4e-4, 0.015
    k = h / 2
    impulse = G * k * k * (h + tau) / c / (1 + k * (h + tau) / c)
    assert sim.contacts["impulse"][0, 2] == pytest.approx(impulse, rel=1e-6)


def test_what_sticks_on_a_compliant_contact_does_not_creep():
    # Pushed by half of what friction holds, four soft points stretch along the ground and then rest: with
    # u_t = -E x_t the box would slide at F c / 4 h = 0.5 m/s for ever.
    b = amontons.ModelBuilder()
    b.add_geom(None, shapes.Plane(), material=Material(compliance=1e-3, friction=0.8))
    b.add_body(
        position=(0, 0, 0.1), shape=shapes.Box((0.2, 0.2, 0.1)), mass=2.0, material=Material(friction=0.8)
    )
    sim = amontons.Simulation(b.build())
    sim.state.forces[0] = (0.4 * 2 * G, 0, 0)
    sim.run(3.0)
    assert np.linalg.norm(sim.state.linear_velocities[0]) < 1e-5
    # The stretch of a tangential spring of the same compliance, within what the box tilts and the way in.
    assert sim.state.positions[0, 0] == pytest.approx(0.4 * 2 * G * 1e-3 / 4, rel=0.5)


@pytest.mark.parametrize("pair", [None, 0.05])
def test_surfaces_touch_at_their_rest_offsets(pair):
    # Offsets add, and the material of a pair has its own. Falling, the ball is caught there too.
    b = amontons.ModelBuilder()
    b.add_geom(None, shapes.Plane(), name="floor", material=Material(rest_offset=0.02))
    ball = Material(rest_offset=0.01)
    b.add_body("ball", position=(0, 0, 0.3), shape=shapes.Sphere(0.1), mass=1.0, material=ball)
    if pair is not None:
        b.set_pair_material(0, 1, Material(rest_offset=pair))
    sim = amontons.Simulation(b.build())
    low = []
    sim.run(1.0, after_step=lambda s, _: low.append(s.state.positions[0, 2]))
    assert sim.state.positions[0, 2] == pytest.approx(0.1 + (pair or 0.03), abs=1e-6)
    assert min(low) > 0.1 + (pair or 0.03) - 1e-6
    assert sim.contacts["gap"] == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("share", [0.98, 1.02])
def test_push_below_and_above_friction(share):
    # A force at the centre of mass, askew to the box's axes: rest below mu m g, (F - mu m g) / m above it. In
    # the first step it acts over half a kick, whose mean friction holds.
    b = amontons.ModelBuilder()
    b.add_geom(None, shapes.Plane())
    b.add_body(position=(0, 0, 0.05), shape=shapes.Box((0.3, 0.2, 0.05)), mass=3.0)
    sim = amontons.Simulation(b.build())
    sim.run(0.1)
    force = share * 0.5 * 3 * G
    sim.state.forces[0] = (0.6 * force, 0.8 * force, 0)
    sim.run(1.0)
    expected = max(0.0, share - 1) * 0.5 * G * (1 - sim.dt / 2)
    np.testing.assert_allclose(
        sim.state.linear_velocities[0], (0.6 * expected, 0.8 * expected, 0), atol=1e-5 * G
    )
    assert set(sim.contacts["state"]) == ({"stick"} if share < 1 else {"slip"})


def floors(slope):
    """Grounds of 40 m by 4 m with their top through the origin, tilted about y."""
    n = np.array([math.sin(slope), 0, math.cos(slope)])
    x, y = np.meshgrid(np.linspace(-20, 20, 81), np.linspace(-2, 2, 9), indexing="ij")
    vertices = np.stack([x.ravel(), y.ravel(), 0 * x.ravel()], 1)
    a = (9 * np.arange(80)[:, None] + np.arange(8)).ravel()
    triangles = np.concatenate([np.stack([a, a + 9, a + 10], 1), np.stack([a, a + 10, a + 1], 1)])
    return n, {
        "plane": (shapes.Plane(), (0, 0, 0)),
        "box": (shapes.Box((20, 2, 0.5)), tuple(-0.5 * n)),
        "mesh": (shapes.Mesh(vertices, triangles), (0, 0, 0)),
        "height field": (shapes.HeightField(np.zeros((9, 81)), 40.0, 4.0), (0, 0, 0)),
    }


@pytest.mark.parametrize("ground", ["plane", "box", "mesh", "height field"])
@pytest.mark.parametrize("shape", ["sphere", "cylinder", "capsule"])
def test_rolling_down_any_ground(ground, shape):
    # v = g sin t / (1 + I / (m r^2)), no step away from the surface and none sideways: an edge of a triangle
    # that is felt as a bump shows in all three.
    slope = 0.2
    n, grounds = floors(slope)
    body = {
        "sphere": shapes.Sphere(0.1),
        "cylinder": shapes.Cylinder(0.1, 0.2),
        "capsule": shapes.Capsule(0.1, 0.2),
    }[shape]
    b = amontons.ModelBuilder()
    floor, position = grounds[ground]
    b.add_geom(None, floor, position=position, orientation=about((0, 1, 0), slope))
    b.add_body(
        position=tuple(0.1 * n + np.array([0, 0.0137, 0])),
        orientation=about((1, 0, 0), math.pi / 2),
        shape=body,
        mass=1.0,
    )
    sim = amontons.Simulation(b.build())
    inertia = np.asarray(sim.model.bodies[0].inertia).reshape(3, 3)[2, 2]
    away = []
    sim.run(1.5, after_step=lambda s, _: away.append(abs(float(s.state.positions[0] @ n) - 0.1)))
    v = sim.state.linear_velocities[0]
    # The solver's tolerance is relative to g h.
    assert np.linalg.norm(v) == pytest.approx(G * math.sin(slope) * 1.5 / (1 + inertia / 0.01), rel=1e-4)
    assert abs(v[1]) < 1e-5
    assert max(away) < 1e-6


@pytest.mark.parametrize("ground", ["mesh", "height field"])
def test_sliding_over_triangles_feels_no_edges(ground):
    # Without friction nothing may change the velocity, and nothing may lift or turn the body.
    _, grounds = floors(0.0)
    floor, _ = grounds[ground]
    smooth = Material(friction=0.0)
    for shape, z in (
        (shapes.Sphere(0.1), 0.1),
        (shapes.Box((0.1, 0.1, 0.1)), 0.1),
        (shapes.Cylinder(0.1, 0.1), 0.1),
        (shapes.Capsule(0.1, 0.2), 0.3),
    ):
        b = amontons.ModelBuilder()
        b.add_geom(None, floor, material=smooth)
        b.add_body(
            position=(0.01, 0.03, z), shape=shape, mass=1.0, linear_velocity=(3, 0.2, 0), material=smooth
        )
        sim = amontons.Simulation(b.build())
        sim.run(2.0)
        np.testing.assert_allclose(sim.state.linear_velocities[0], (3, 0.2, 0), atol=1e-6)
        assert sim.state.positions[0, 2] == pytest.approx(z, abs=1e-6)
        assert np.abs(sim.state.angular_velocities[0]).max() < 1e-6


@pytest.mark.parametrize("shape", [shapes.Box((0.1, 0.1, 0.1)), shapes.Cylinder(0.1, 0.1)])
def test_deep_overlap_is_undone_slowly(shape):
    # Half sunk into the ground and into each other: each overlap is undone at recovery_speed, so the upper
    # body rises at twice that at most, without a velocity of its own (a recovery by velocities flings it up
    # by centimetres), and both rest where they belong, but for the errors that are allowed at two contacts.
    b = amontons.ModelBuilder()
    b.add_geom(None, shapes.Box((1, 1, 0.5)), position=(0, 0, -0.5))
    b.add_body(position=(0, 0, 0.02), shape=shape, mass=1.0)
    b.add_body(position=(0.01, 0, 0.14), shape=shape, mass=1.0)
    sim = amontons.Simulation(b.build())
    rise, heights = [], [sim.state.positions[1, 2]]

    def look(s, _):
        rise.append(middle(s).state.linear_velocities[:, 2].max())
        heights.append(s.state.positions[1, 2])

    sim.run(2.0, after_step=look)
    assert max(np.diff(heights)) < (2 * sim.recovery_speed + 1e-6) * sim.dt
    assert max(rise) < 2.1e-3 * G * sim.dt  # what closes the residual of a solve, at two contacts
    np.testing.assert_allclose(sim.state.positions[:, 2], (0.1, 0.3), atol=2.1e-4 * sim.model.length)


@pytest.mark.parametrize("overlap", [8e-3, 1e-5])
def test_a_peg_that_is_too_wide_for_its_hole(overlap):
    # Four walls push it inwards from all sides: no velocity opens all of those gaps, and a step that asks for
    # one, as slow as it may be, has no solution. The deep overlap is beyond what the correction of positions
    # lets pass, the other is not. The wall below carries the peg, which stays, and no energy comes of it.
    b = amontons.ModelBuilder()
    half, wall = 0.02, 0.01
    for k in range(4):
        out = np.array([0, math.cos(k * math.pi / 2), math.sin(k * math.pi / 2)])
        b.add_geom(
            None,
            shapes.Box(tuple(np.where(np.abs(out) > 0.5, wall, 0.05))),
            position=tuple((half + wall - overlap) * out),
        )
    peg = b.add_body(shape=shapes.Box((0.06, half, half)), density=500.0, position=(0.01, 0, 0))
    sim = amontons.Simulation(b.build(), dt=5e-3)
    start = sim.state.positions[peg].copy()
    for _ in range(50):
        report = sim.step()
        assert report.converged
        assert report.kinetic_energy < 1e-12
    np.testing.assert_allclose(sim.state.positions[peg], start, atol=2 * overlap)


@pytest.mark.parametrize("plate", ["fixed", "dynamic", "mesh"])
@pytest.mark.parametrize("speed", [100.0, 1000.0])
def test_bullets_do_not_tunnel(plate, speed):
    # 0.5 m and 5 m per step through a plate of 1 cm, with spin, with and without restitution.
    for shape in (shapes.Sphere(0.005), shapes.Box((0.01, 0.005, 0.005)), shapes.Capsule(0.003, 0.01)):
        for e in (0.0, 0.8):
            material = Material(restitution=e)
            b = amontons.ModelBuilder(gravity=(0, 0, 0))
            if plate == "fixed":
                b.add_geom(None, shapes.Box((0.005, 0.5, 0.5)), position=(0.4, 0, 0), material=material)
            elif plate == "dynamic":
                b.add_body(
                    position=(0.4, 0, 0), shape=shapes.Box((0.005, 0.5, 0.5)), mass=10.0, material=material
                )
            else:
                square = np.array([[0.4, -1, -1], [0.4, -1, 1], [0.4, 1, 1], [0.4, 1, -1.0]])
                b.add_geom(None, shapes.Mesh(square, np.array([[0, 1, 2], [0, 2, 3]])), material=material)
            bullet = b.add_body(
                position=(-0.0137, 0.002, 0.013),
                shape=shape,
                mass=0.01,
                linear_velocity=(speed, 1, 0),
                angular_velocity=(0, 500, 0),
                material=material,
            )
            sim = amontons.Simulation(b.build())
            momentum = sim.forces.momentum()[0]
            sim.run(0.1)
            wall = sim.state.positions[0, 0] if plate == "dynamic" else 0.4
            assert sim.state.positions[bullet, 0] < wall
            if plate == "dynamic":
                np.testing.assert_allclose(sim.forces.momentum()[0], momentum, atol=1e-12 * speed)


def test_lift_and_paddle():
    # On a lift that accelerates at 2 m/s^2 a box weighs m (g + 2); a paddle pushes another at its own speed.
    b = amontons.ModelBuilder()
    b.add_geom(None, shapes.Plane(), position=(0, 0, -1))
    lift = b.add_body(motion="kinematic", position=(0, 0, -0.1), shape=shapes.Box((1, 1, 0.1)))
    box = shapes.Box((0.1, 0.1, 0.1))
    rider = b.add_body(position=(0, 0, 0.1), shape=box, mass=2.0)
    b.add_body(motion="kinematic", position=(-5.5, 0, -0.8), shape=box, linear_velocity=(0.5, 0, 0))
    pushed = b.add_body(position=(-5.0, 0, -0.9), shape=box, mass=2.0)
    sim = amontons.Simulation(b.build())

    def accelerate(s):
        s.state.linear_velocities[lift, 2] += 2 * s.dt

    sim.before_step.append(accelerate)
    sim.run(1.0)
    assert sim.forces.contact_forces()[0][rider, 2] == pytest.approx(2 * (G + 2), rel=1e-4)
    assert sim.state.linear_velocities[pushed, 0] == pytest.approx(0.5, abs=1e-5)


def test_a_long_rest_stays():
    # 15 boxes, each turned on the one below, for 20 s: no drift beyond the first second, no penetration.
    b = amontons.ModelBuilder()
    b.add_geom(None, shapes.Plane())
    for i in range(15):
        b.add_body(
            position=(0, 0, 0.1 + 0.2 * i),
            orientation=about((0, 0, 1), 0.3 * i),
            shape=shapes.Box((0.1, 0.1, 0.1)),
            mass=1.0,
        )
    sim = amontons.Simulation(b.build())
    sim.run(1.0)
    start = np.array(sim.state.positions)
    report = sim.run(19.0)
    assert np.abs(sim.state.positions - start).max() < 1e-6
    assert report.penetration < 1e-6


@pytest.mark.parametrize("mu", [0.0, 0.5])
@pytest.mark.parametrize("h", [1e-2, 1e-3])
def test_sliding_over_slabs_feels_no_joints(h, mu):
    # Boxes side by side, level: the way is 3 t, or v^2 / (2 mu g) up to h^2. A contact with the side of
    # the next slab, found before the body is above it, stops it at the joint. (What rolls: test_seams.py.)
    cube = np.array([[x, y, z] for x in (-0.1, 0.1) for y in (-0.1, 0.1) for z in (-0.1, 0.1)])
    for shape in (shapes.Box((0.1, 0.1, 0.1)), shapes.Cylinder(0.1, 0.1), shapes.Hull(cube)):
        for yaw in (0.0, 0.2):
            b = amontons.ModelBuilder()
            for i in range(5):
                b.add_geom(
                    None,
                    shapes.Box((0.5, 2, 0.2)),
                    position=(i, 0, -0.2),
                    material=Material(friction=mu),
                )
            b.add_body(
                position=(0.01, 0.03, 0.1),
                orientation=about((0, 0, 1), yaw),
                shape=shape,
                mass=1.0,
                linear_velocity=(3, 0, 0),
                material=Material(friction=mu),
            )
            sim = amontons.Simulation(b.build(), dt=h)
            sim.run(1.0)
            way = 3.0 if mu == 0 else 9 / (2 * mu * G)
            assert sim.state.positions[0, 0] - 0.01 == pytest.approx(way, abs=h * h * G)
            assert sim.state.positions[0, 2] == pytest.approx(0.1, abs=1e-6)


def test_a_step_up_still_stops():
    # The next slab stands 2 cm higher: its side is in the way, and the box must not climb through it.
    b = amontons.ModelBuilder()
    smooth = Material(friction=0.0)
    b.add_geom(None, shapes.Box((0.5, 2, 0.2)), position=(0, 0, -0.2), material=smooth)
    b.add_geom(None, shapes.Box((0.5, 2, 0.2)), position=(1, 0, -0.18), material=smooth)
    b.add_body(position=(0, 0, 0.1), shape=shapes.Box((0.1, 0.1, 0.1)), mass=1.0, linear_velocity=(0.5, 0, 0))
    sim = amontons.Simulation(b.build())
    deepest, furthest = [], []

    def watch(s, report):
        deepest.append(report.penetration)
        furthest.append(s.state.positions[0, 0])

    sim.run(1.5, after_step=watch)
    # The blow, below the centre of mass, tips it a little: the edge that it struck is the pivot.
    assert 0.399 < max(furthest) < 0.41
    assert furthest[-1] < 0.4
    assert max(deepest) < 1e-4
