"""Ropes that rub on pulleys, and belts, beside closed forms (Euler, Eytelwein)."""

import math

import numpy as np
import pytest
from amontons import InputError, ModelBuilder, Motor, Simulation, Transform
from amontons.parts import PathElement
from amontons.vi import Problem, methods, read_problem

G = 10.0
ALONG_Y = (math.sqrt(0.5), math.sqrt(0.5), 0, 0)  # turns the axis of a cylinder into y
DRUM = 0.2


def weights(builder, masses, x=(0.0, 0.4)):
    """Weights on vertical slides without shapes, at the height 0."""
    for i, mass in enumerate(masses):
        builder.add_body(f"w{i}", mass=mass, inertia=(mass,) * 3, position=(x[i], 0, 0))
        builder.add_prismatic_joint(f"w{i}", axis=(0, 0, 1), name=f"s{i}")


def hook(body):
    return (body, (0.0, 0.0, 0.0))


def drum(friction, body=None, at=(0.2, 0, 1.5), **more):
    return PathElement(
        "cylinder",
        body,
        Transform(at, ALONG_Y),
        DRUM,
        (0.2, 0, 2) if body is None else None,
        friction=friction,
        **more,
    )


def capstan(masses, friction, turns=0.0, dt=1e-3, length=3 + math.pi * DRUM):
    builder = ModelBuilder(gravity=(0, 0, -G))
    weights(builder, masses)
    length += 2 * math.pi * turns * DRUM
    path = [hook("w0"), drum(friction, turns=turns), hook("w1")]
    builder.add_tendon("rope", path=path, limits=(None, length))
    return Simulation(builder.build(), dt=dt, tolerance=1e-13)


# Breaks if the cone of the tensions, the angle or the De Saxce term is wrong: without that term the rope
# would lengthen or shorten as it slips.
def test_a_rope_slips_at_the_ratio_of_euler():
    sim = capstan((2.0, 1.0), 0.1)
    sim.run(0.2)
    ratio = math.exp(0.1 * math.pi)
    heavy, light = sim.forces.tensions("rope")
    assert heavy / light == pytest.approx(ratio, rel=1e-9)
    expected = G * (2 - ratio) / (2 + ratio)
    assert sim.qd == pytest.approx([-expected * 0.2, expected * 0.2], rel=1e-6)
    assert sim.forces.tendon_efforts["length"][0] == pytest.approx(3 + math.pi * DRUM, abs=1e-9)


# Breaks if a rope creeps on a rough drum.
def test_a_rope_sticks_on_a_rough_drum():
    sim = capstan((2.0, 1.0), 0.5)
    sim.run(0.5)
    assert np.abs(sim.qd).max() < 1e-11
    assert sim.forces.tensions("rope") == pytest.approx([2 * G, G], rel=1e-9)


# Two turns hold exp(mu (pi + 4 pi)) times the weight, and no more.
@pytest.mark.parametrize(("excess", "holds"), [(0.999, True), (1.001, False)])
def test_turns_on_a_capstan(excess, holds):
    ratio = math.exp(0.2 * 5 * math.pi)
    sim = capstan((excess * ratio, 1.0), 0.2, turns=2)
    sim.run(0.2)
    assert (np.abs(sim.qd).max() < 1e-9) == holds


# A slack rope has no tension and moves nothing.
def test_a_slack_rope_stays_slack():
    sim = capstan((2.0, 1.0), 0.3, length=3.3 + math.pi * DRUM)
    sim.run(0.05)
    assert sim.forces.tensions("rope") == pytest.approx([0, 0], abs=1e-12)
    assert sim.qd == pytest.approx([-0.5, -0.5], rel=1e-9)


def tackle(load, pull, friction, speed=0.0):
    """A load on a loop of rope between eyes: one on the load, one on the world."""
    builder = ModelBuilder(gravity=(0, 0, -G))
    weights(builder, (load, pull), x=(0.0, 0.0))
    eye = lambda body, at: PathElement("point", body, Transform(at), friction=friction)  # noqa: E731
    path = [(None, (0, 0, 2)), eye("w0", (0, 0, 0)), eye(None, (0, 0, 2)), hook("w1")]
    builder.add_tendon("rope", path=path, limits=(None, 6.0))
    sim = Simulation(builder.build(), dt=1e-3, tolerance=1e-12)
    sim.qd = [speed, -2 * speed]
    return sim


# A tackle of two parts has the efficiency (1/e + 1/e^2) / 2 with e = exp(mu pi). Breaks if places in series
# do not share the tension of the rope between them. Its knot has 1e-5 of a mass.
def test_block_and_tackle():
    friction, load, pull = 0.05, 3.0, 2.5
    e = math.exp(friction * math.pi)
    s = 1 / e + 1 / e**2
    sim = tackle(load, pull, friction)
    sim.run(0.1)
    a = G * (pull * s - load) / (load + 2 * pull * s)
    assert sim.qd == pytest.approx([a * 0.1, -2 * a * 0.1], rel=1e-4)
    first, second, third = sim.forces.tensions("rope")
    assert second / first == pytest.approx(e, rel=1e-9)
    assert third / second == pytest.approx(e, rel=1e-4)


# At uniform speed the knots are exact: load over pull is the efficiency times the number of parts.
def test_tackle_at_uniform_speed():
    friction, load = 0.05, 3.0
    e = math.exp(friction * math.pi)
    sim = tackle(load, load / (1 / e + 1 / e**2), friction, speed=0.3)
    sim.run(0.1)
    assert sim.qd == pytest.approx([0.3, -0.6], rel=1e-7)
    first, second, third = sim.forces.tensions("rope")
    assert [second / first, third / second] == pytest.approx([e, e], rel=1e-7)


def belt(load, friction=0.4, speed=20.0):
    """A driven pulley (radius 0.1) and one with a dry torque as its load (0.2), on an elastic belt."""
    builder = ModelBuilder(gravity=(0, 0, 0))
    path = []
    for name, radius, x in (("driver", 0.1, 0.0), ("driven", 0.2, 1.0)):
        builder.add_body(name, mass=1, inertia=(0.01,) * 3, position=(x, 0, 0))
        path.append(PathElement("cylinder", name, Transform(), radius, friction=friction))
    builder.add_revolute_joint(
        "driver", point=(0, 0, 0), axis=(0, 0, 1), name="in", motor=Motor("velocity", speed)
    )
    builder.add_revolute_joint("driven", point=(1, 0, 0), axis=(0, 0, 1), name="out", friction=load)
    tilt = 2 * math.asin(-0.1)
    length = 2 * math.sqrt(0.99) + 0.1 * (math.pi + tilt) + 0.2 * (math.pi - tilt)
    builder.add_tendon("belt", path=path, closed=True, stiffness=1e4, rest=length - 0.02)  # 200 N
    sim = Simulation(builder.build(), dt=1e-3, tolerance=1e-13)
    sim.run(2.0)
    return sim, math.exp(friction * (math.pi + tilt))


# Breaks if the belt creates or loses power: what the motor gives is what the load takes and what slips.
@pytest.mark.parametrize("load", [10.0, 40.0])
def test_power_of_a_belt_drive(load):
    sim, ratio = belt(load)
    tight, slack = sorted(sim.forces.tensions("belt"), reverse=True)
    driver, driven = sim.qd
    given = sim.forces.effort("in").motor * driver
    slipped = (tight - slack) * (0.1 * driver - 0.2 * driven)
    assert (tight + slack) / 2 == pytest.approx(200, rel=1e-5)
    taken = -sim.forces.joint_efforts["friction"][1] * driven
    most = 2 * 200 * math.tanh(math.log(ratio) / 2) * 0.2  # N m on the driven pulley
    if load < most:
        assert driven == pytest.approx(0.5 * driver, rel=1e-9)
        assert tight - slack == pytest.approx(load / 0.2, rel=1e-9)
    else:
        assert driven == pytest.approx(0, abs=1e-9)
        assert tight / slack == pytest.approx(ratio, rel=1e-9)
    assert given == pytest.approx(taken + slipped, rel=1e-8)


def winch(**joint):
    """A drum with two turns of rope, a load and a light weight at its tail."""
    builder = ModelBuilder(gravity=(0, 0, -G))
    weights(builder, (5.0, 0.1))
    builder.add_body("drum", mass=1, inertia=(0.02,) * 3, position=(0.2, 0, 1.5))
    builder.add_revolute_joint("drum", point=(0.2, 0, 1.5), axis=(0, 1, 0), name="drum", **joint)
    # The side point is one of the world: one of the drum would turn away with it.
    turned = PathElement(
        "cylinder", "drum", Transform((0, 0, 0), ALONG_Y), DRUM, (0.2, 0, 2), friction=0.4, turns=2
    )
    length = 3 + math.pi * DRUM * 5
    builder.add_tendon("rope", path=[hook("w0"), turned, hook("w1")], limits=(None, length))
    return Simulation(builder.build(), dt=1e-3, tolerance=1e-12)


# A turning drum takes the rope along; the motor's power lifts both weights.
def test_winch_lifts():
    sim = winch(motor=Motor("velocity", control=2.0))
    sim.qd = [2 * DRUM, -2 * DRUM, 2.0]  # a rope without tension at its tail would not grip
    sim.run(0.2)
    load, tail, _ = sim.qd
    assert [abs(load), abs(tail)] == pytest.approx([2 * DRUM] * 2, rel=1e-7)
    assert load == pytest.approx(-tail, rel=1e-7)
    assert sim.forces.effort("drum").motor * 2.0 == pytest.approx((5 - 0.1) * G * load, rel=1e-4)


# The friction of its bearing holds the load without a motor, as a worm gear does.
def test_winch_holds_without_power():
    sim = winch(friction=10.0)
    sim.run(0.5)
    assert np.abs(sim.qd).max() < 1e-9
    assert sim.forces.tensions("rope") == pytest.approx([5 * G, 0.1 * G], rel=1e-6)


# Breaks if a method, the residual or a file does not know the set.
def test_all_methods_and_files_know_the_set(tmp_path):
    sim = capstan((2.0, 1.0), 0.1)
    sim.run(0.01)
    problem = sim.problem()
    assert [type(cone).__name__ for cone in problem.cones] == ["Bilateral", "PlanarFriction"]
    problem.write(tmp_path / "rope.npz")
    again = read_problem(tmp_path / "rope.npz")
    assert again.cones[1].mu == pytest.approx(math.tanh(0.1 * math.pi / 2), rel=1e-15)
    exact = problem.solve(tolerance=1e-13).x
    for method in set(methods()) - {"cg", "minres"}:  # which refuse inequalities
        for law in ("coulomb", "associated"):
            found = again.solve(method=method, law=law, tolerance=1e-9)
            assert found.status == "converged", (method, law)
            if law == "coulomb":
                assert found.x == pytest.approx(exact, rel=1e-6)
            assert again.residual(found.x, law=law) < 1e-8


# Two rays of tension that nothing may lengthen, under velocities that demand it: proven infeasible.
def test_infeasible_ropes_are_proven():
    from amontons.vi import PlanarFriction

    problem = Problem(np.zeros((2, 2)), np.array([-1.0, 0.0]), [PlanarFriction(0.3)], law="associated")
    assert problem.solve().status == "infeasible"


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"limits": None}, "needs a largest length or a stiffness"),
        ({"stiffness": 10.0}, "or a stiffness, not both"),
        ({"damping": 1.0}, "no lower limit, damping, armature or friction along it"),
        ({"path": [hook("w0"), PathElement("point", "w1", friction=0.1)]}, "take it off the ends"),
        ({"path": [hook("w0"), drum(-0.1), hook("w1")]}, "friction"),
        ({"closed": True}, "two cylinders on two bodies"),
        ({"path": [hook("w0"), PathElement("point", turns=1), hook("w1")]}, "only a cylinder takes turns"),
    ],
)  # fmt: skip
def test_wrong_ropes(change, message):
    builder = ModelBuilder()
    weights(builder, (1.0, 1.0))
    given = {"path": [hook("w0"), drum(0.1), hook("w1")], "limits": (None, 4.0)} | change
    builder.add_tendon("rope", **given)
    with pytest.raises(InputError, match=message):
        Simulation(builder.build())


# Breaks if a belt without a course is taken for one: its length would be no number.
@pytest.mark.parametrize(
    ("frame", "message"),
    [
        (Transform((1, 0, 0), ALONG_Y), "must be parallel"),
        (Transform((0.05, 0, 1)), "within the other"),
    ],
)
def test_belts_need_two_parallel_wheels(frame, message):
    builder = ModelBuilder()
    for name in ("a", "b"):
        builder.add_body(name, mass=1, inertia=(1, 1, 1))
    path = [PathElement("cylinder", "a", Transform(), 0.1), PathElement("cylinder", "b", frame, 0.2)]
    builder.add_tendon("belt", path=path, closed=True, stiffness=1e3, rest=1)
    with pytest.raises(InputError, match=message):
        builder.build()


def test_actuators_and_tensions_ask_for_the_right_tendon():
    builder = ModelBuilder()
    weights(builder, (1.0, 1.0))
    builder.add_tendon("rope", path=[hook("w0"), drum(0.1), hook("w1")], limits=(None, 4.0))
    builder.add_tendon("string", path=[hook("w0"), hook("w1")])
    with pytest.raises(InputError, match="it has one tension: read tendon_efforts"):
        Simulation(builder.build()).forces.tensions("string")
    builder.add_actuator("pull", tendon="rope")
    with pytest.raises(InputError, match="drive a pulley or a body at its end"):
        Simulation(builder.build())
