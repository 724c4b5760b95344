"""Loads of joints and contacts over a run, beside closed forms, and which of them are not determined."""

import copy
import math
import pickle

import amontons
import numpy as np
import pytest
from amontons import shapes

G = 9.81


def row(table, name, component):
    (found,) = table[(table[table.dtype.names[0]] == name) & (table["component"] == component)]
    return found


def pendulum(dt):
    """1.5 kg at 0.8 m, released from the horizontal about the y axis."""
    builder = amontons.ModelBuilder(gravity=(0, 0, -G))
    body = builder.add_body("bob", mass=1.5, inertia=(0.02, 0.02, 0.02), position=(0.8, 0, 0))
    builder.add_revolute_joint(body, point=(0, 0, 0), axis=(0, 1, 0), name="pivot")
    return amontons.Simulation(builder.build(), dt=dt, tolerance=1e-10)


# Breaks when a peak, its time, a mean, an impulse or an rms is wrong, or not in the axes of the joint.
def test_bearing_of_a_pendulum():
    h, m, l, inertia = 1e-3, 1.5, 0.8, 0.02
    simulation = pendulum(h)
    with simulation.forces.loads() as loads:
        simulation.run(0.6)
    # From the horizontal to the bottom: (I + m l^2) w^2 / 2 = m g l, and the bearing carries m g + m l w^2.
    about = inertia + m * l * l
    bottom = m * G + m * l * 2 * m * G * l / about
    # A quarter of a period is K(1/2) = 1.85407 times the time of small swings over 2 pi.
    quarter = 1.8540746773 / math.sqrt(m * G * l / about)
    frame = simulation.model.joints[0].frame_b.rotation
    down = np.array(amontons.Transform(rotation=frame).inverse()((0, 0, 1)))
    component = "fxfyfz"[2 * int(np.argmax(np.abs(down))) :][:2]
    found = row(loads.joints, "pivot", component)
    sign = down[np.argmax(np.abs(down))]
    assert abs(abs(down).max() - 1) < 1e-12
    assert sign * found["peak"] == pytest.approx(bottom, rel=2 * h / quarter)
    assert found["time"] == pytest.approx(quarter, abs=2 * h)
    # The sum of impulses is the change of momentum and what gravity gave; the velocity that is read may
    # belong to half a step beside the last impulse.
    up = m * simulation.state.linear_velocities[0, 2] + m * G * 0.6
    assert sign * found["impulse"] == pytest.approx(up, abs=h * bottom)
    assert found["mean"] == pytest.approx(found["impulse"] / 0.6, rel=1e-12)
    assert found["rms"] >= abs(found["mean"])
    assert loads.joints["determined"].all()
    assert loads.duration == pytest.approx(0.6)


# Breaks when rms is not the root of the mean square: a constant load has its own size as mean, rms and peak.
def test_constant_load():
    builder = amontons.ModelBuilder(gravity=(0, 0, -10))
    builder.add_body("held", mass=2, inertia=(1, 1, 1))
    builder.add_fixed_joint("held", name="weld")
    simulation = amontons.Simulation(builder.build(), dt=0.01)
    with simulation.forces.loads() as loads:
        simulation.run(0.5)
    found = row(loads.joints, "weld", "fz")
    for name in ("peak", "mean", "rms"):
        assert found[name] == pytest.approx(20, rel=1e-6)
    assert found["impulse"] == pytest.approx(10, rel=1e-6)


def slider_crank(dt, speed):
    """A crank of 50 mm, a rod of 200 mm and a piston of 0.4 kg along x, driven at a constant speed."""
    builder = amontons.ModelBuilder(gravity=(0, 0, 0))
    crank = builder.add_body(
        "crank", mass=1, inertia=(1e-3,) * 3, position=(0.025, 0, 0),
        linear_velocity=(0, 0.025 * speed, 0), angular_velocity=(0, 0, speed),
    )  # fmt: skip
    spin = -speed * 0.05 / 0.2
    rod = builder.add_body(
        "rod", mass=0.3, inertia=(1e-3,) * 3, position=(0.15, 0, 0),
        linear_velocity=(0, 0.025 * speed, 0), angular_velocity=(0, 0, spin),
    )  # fmt: skip
    piston = builder.add_body("piston", mass=0.4, inertia=(1e-3,) * 3, position=(0.25, 0, 0))
    motor = amontons.Motor("velocity", control=speed)
    z = (0, 0, 1)
    builder.add_revolute_joint(crank, point=(0, 0, 0), axis=z, name="shaft", motor=motor)
    builder.add_revolute_joint(rod, crank, point=(0.05, 0, 0), axis=z, name="pin")
    builder.add_revolute_joint(piston, rod, point=(0.25, 0, 0), axis=z, name="wrist")
    builder.add_prismatic_joint(piston, axis=(1, 0, 0), name="guide")
    return amontons.Simulation(builder.build(), dt=dt, tolerance=1e-10)


def pin_force(angle, speed):
    """Force on the rod at the crank pin, in the axes of the crank: Newton and Euler of rod and piston."""
    r, l = 0.05, 0.2
    s = r * np.sin(angle) / l
    tilt = -np.arcsin(s)
    rate = -r * speed * np.cos(angle) / (l * np.cos(tilt))
    turn = (r * speed**2 * np.sin(angle) + l * rate**2 * np.sin(tilt)) / (l * np.cos(tilt))
    crank = np.array([np.cos(angle), np.sin(angle)])
    along, across = np.array([np.cos(tilt), np.sin(tilt)]), np.array([-np.sin(tilt), np.cos(tilt)])
    pin = -r * speed**2 * crank
    middle, end = (pin + d * (turn * across - rate**2 * along) for d in (l / 2, l))
    # Unknown: force at the pin (2), at the wrist on the rod (2), of the guide (1).
    half = l / 2 * along
    rows = np.array([
        [1, 0, 1, 0, 0], [0, 1, 0, 1, 0],
        [half[1], -half[0], -half[1], half[0], 0],
        [0, 0, -1, 0, 0], [0, 0, 0, -1, 1],
    ])  # fmt: skip
    right = [0.3 * middle[0], 0.3 * middle[1], 1e-3 * turn, 0.4 * end[0], 0.4 * end[1]]
    fx, fy, *_ = np.linalg.solve(rows, right)
    return np.array([crank @ [fx, fy], crank[0] * fy - crank[1] * fx])


# Breaks when reactions are not turned into the axes of the body that carries the joint, or those of a loop
# are taken for redundant.
def test_slider_crank():
    h, speed = 2e-4, 20.0
    simulation = slider_crank(h, speed)
    turn = 2 * math.pi / speed
    with simulation.forces.loads() as loads:
        simulation.run(turn)
    exact = np.array([pin_force(speed * t, speed) for t in np.arange(0, turn, h)])
    table, frame = loads.joints, simulation.model.joints[1].frame_b.rotation
    for k, axis in enumerate(((1, 0, 0), (0, 1, 0))):
        inside = np.array(amontons.Transform(rotation=frame).inverse()(axis))
        n = int(np.argmax(np.abs(inside)))
        found, values = row(table, "pin", ("fx", "fy", "fz")[n]), inside[n] * exact[:, k]
        size = np.abs(exact).max()
        # The force changes by at most its size times the speed of the crank and a few harmonics in a step.
        near = 6 * speed * h * size
        assert abs(found["peak"]) == pytest.approx(np.abs(values).max(), abs=near)
        assert found["rms"] == pytest.approx(np.sqrt(np.mean(values**2)), abs=near)
        assert found["determined"]
    # A plane mechanism in space: what acts across the plane has many solutions.
    across = np.array(amontons.Transform(rotation=frame).inverse()((0, 0, 1)))
    assert not row(table, "pin", ("fx", "fy", "fz")[int(np.argmax(np.abs(across)))])["determined"]
    assert row(table, "shaft", "effort")["determined"]


def door(**upper):
    """20 kg on two balls 1.6 m apart, its centre at 0.5 m."""
    builder = amontons.ModelBuilder(gravity=(0, 0, -10))
    body = builder.add_body("door", mass=20, inertia=(1, 1, 1), position=(0.5, 0, 1))
    builder.add_ball_joint(body, point=(0, 0, 0.2), name="low")
    builder.add_ball_joint(body, point=(0, 0, 1.8), name="high", **upper)
    simulation = amontons.Simulation(builder.build(), dt=1e-3)
    with simulation.forces.loads() as loads:
        simulation.run(0.1)
    return loads.joints


# Breaks when a share that nothing determines is told as a load, or one that is determined is marked.
def test_door_on_two_hinges():
    table = door()
    for name, sign in (("low", 1), ("high", -1)):
        assert row(table, name, "fx")["mean"] == pytest.approx(sign * 20 * 10 * 0.5 / 1.6, rel=1e-5)
        assert [bool(row(table, name, c)["determined"]) for c in ("fx", "fy", "fz")] == [True, True, False]
    assert row(table, "low", "fz")["mean"] + row(table, "high", "fz")["mean"] == pytest.approx(200, rel=1e-5)


# Breaks when a joint with compliance counts as redundant: its deflection decides what it carries.
def test_compliance_determines_shares():
    assert door(compliance=1e-6)["determined"].all()


def table_on_legs(count):
    """A disc of 12 kg on legs with spheres at their ends."""
    builder = amontons.ModelBuilder(gravity=(0, 0, -10))
    builder.add_geom(None, shapes.Plane(), name="floor")
    body = builder.add_body("top", mass=12, inertia=(1, 1, 1), position=(0, 0, 0.5))
    for k in range(count):
        angle = 2 * math.pi * k / count
        at = (0.4 * math.cos(angle), 0.4 * math.sin(angle), -0.45)
        builder.add_geom(body, shapes.Sphere(0.05), position=at, name=f"leg {k}")
    simulation = amontons.Simulation(builder.build(), dt=5e-3)
    with simulation.forces.loads() as loads:
        simulation.run(0.1)
    return loads.contacts


# Breaks when contacts are left out of the redundancy, or three legs are taken for more than enough.
def test_legs_of_a_table():
    three = table_on_legs(3)
    normal = three[three["component"] == "normal"]
    assert normal["determined"].all()
    np.testing.assert_allclose(normal["mean"], 40, rtol=1e-5)
    # Tangential forces of sticking points can press against each other.
    assert not three[three["component"] == "friction"]["determined"].any()
    four = table_on_legs(4)
    assert not four[four["component"] == "normal"]["determined"].any()
    assert four[four["component"] == "normal"]["mean"].sum() == pytest.approx(120, rel=1e-5)


# Breaks when a stopped collection goes on, a copy of a simulation adds to it, or copies and pickles fail.
def test_collection_ends():
    simulation = pendulum(1e-3)
    loads = simulation.forces.loads()
    simulation.run(0.01)
    other = simulation.copy()
    other.run(0.01)
    copy.deepcopy(simulation)
    pickle.loads(pickle.dumps(simulation)).run(0.01)
    assert loads.duration == pytest.approx(0.01)
    loads.stop()
    loads.stop()
    simulation.run(0.01)
    assert loads.duration == pytest.approx(0.01)
    assert len(loads) == len(loads.joints) + len(loads.contacts) == 7
    assert "0.01 s" in repr(loads)


# Breaks when what is no model gives an error of the library's inside.
def test_loads_of_no_model():
    with pytest.raises(amontons.InputError, match="Loads: model is a NoneType"):
        amontons.results.Loads(None)


# Breaks when a locked direction of a joint is missing, twice there, or taken at another place: the number of
# independent changes that put no sum on any body is that of the rows of the step less their rank.
@pytest.mark.parametrize("scene", ["four_bar", "slider_crank", "chain"])
def test_redundancy_is_that_of_the_rows(scene):
    from amontons.simulation import determinacy
    from amontons.simulation.loads import pose_of

    options = {"four_bar": {"driven": False}, "slider_crank": {}, "chain": {"links": 8}}[scene]
    simulation = amontons.Simulation(amontons.scenes.make(scene, **options), dt=1e-3)
    simulation.run(0.05)
    rows = simulation.problem().A.jacobian().toarray()
    values = np.linalg.svd(rows / np.linalg.norm(rows, axis=1, keepdims=True), compute_uv=False)
    redundant = len(rows) - int(np.sum(values > 1e-6 * values.max()))
    model, pose = simulation.model, pose_of(simulation)
    columns = [c for j in range(len(model.joints)) for c in determinacy._of_joint(model, pose, j)]
    free = determinacy._null_space(model, pose, columns)
    assert free.shape == (len(columns), redundant)
    assert len(columns) == len(rows)


# Breaks when trees take the time of a decomposition, or their reactions are called redundant.
def test_trees_are_determined():
    simulation = amontons.Simulation(amontons.scenes.chain(links=60), dt=5e-3)
    with simulation.forces.loads() as loads:
        simulation.run(0.02)
    assert loads.joints["determined"].all()


# Breaks when a large pile is judged at a great cost instead of being marked.
def test_large_piles_are_marked(monkeypatch):
    from amontons.simulation import determinacy

    monkeypatch.setattr(determinacy, "MOST", 2)
    assert not table_on_legs(3)["determined"].any()
    assert not door()["determined"].all()
