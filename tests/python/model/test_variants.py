"""Variants of a model: `Model.with_`."""

import warnings
from dataclasses import replace
from math import sqrt

import amontons
import numpy as np
import pytest
from amontons import Material, ModelBuilder, ModelWarning, Motor, Simulation, shapes
from amontons.parts import PairMaterial


def robot():
    """Two feet on a floor below a trunk with a knee, its motor, a servo and a ball."""
    builder = ModelBuilder()
    builder.add_floor(material=Material(friction=0.8))
    builder.add_body("trunk", shape=shapes.Box((0.2, 0.1, 0.1)), mass=5.0, position=(0, 0, 1))
    for side, x in (("left", -0.1), ("right", 0.1)):
        builder.add_body(f"{side}_foot", shape=shapes.Sphere(0.05), mass=0.5, material=Material(friction=0.6),
                         position=(x, 0, 0.5))  # fmt: skip
        builder.add_revolute_joint(f"{side}_foot", "trunk", axis=(0, 1, 0), point=(x, 0, 0.9),
                                   name=f"{side}_knee", damping=0.1, armature=0.01,
                                   motor=Motor("position", kp=20.0, kd=1.0))  # fmt: skip
    builder.add_body("head", shape=shapes.Sphere(0.05), mass=1.0, position=(0, 0, 1.2))
    builder.add_ball_joint("head", "trunk", point=(0, 0, 1.1), name="neck")
    builder.add_actuator("servo", joint="left_knee", law="position", kp=5.0, kd=0.5)
    return builder.build()


# Breaks when a number goes to other parts than those that the name or pattern says, or another one changes.
def test_numbers_go_where_the_names_say():
    model = robot()
    other = model.with_(
        friction={"*_foot": 0.3},
        mass_scale={"trunk": 1.2},
        damping={"left_knee": 0.5, "neck": 0.2},
        armature={"*_knee": 0.02},
        gain={"servo": 7.0, "right_knee": 30.0},
    )
    on_feet = [g.body >= 0 and "foot" in model.bodies[g.body].name for g in model.geoms]
    assert on_feet.count(True) == 2
    for geom, old, on_foot in zip(other.geoms, model.geoms, on_feet, strict=True):
        assert geom.material.friction == (0.3 if on_foot else old.material.friction)
    assert other.bodies[0].mass == pytest.approx(6.0)
    assert np.array(other.bodies[0].inertia) == pytest.approx(1.2 * np.array(model.bodies[0].inertia))
    left, right = (other.joints[other.joint_index(f"{side}_knee")] for side in ("left", "right"))
    assert [j.dofs[0].damping for j in (left, right)] == [0.5, 0.1]
    assert [j.dofs[0].armature for j in (left, right)] == [0.02, 0.02]
    assert (left.dofs[0].motor.kp, right.dofs[0].motor.kp) == (20.0, 30.0)
    assert other.joints[other.joint_index("neck")].ball_damping == 0.2
    assert other.actuators[0].gain == (7.0, 0, 0)
    assert other.actuators[0].bias == (0, -7.0, -0.5)
    again = other.with_(
        friction={"*_foot": 0.6},
        mass={"trunk": 5.0},
        damping={"left_knee": 0.1, "neck": 0.0},
        armature={"*_knee": 0.01},
        gain={"servo": 5.0, "right_knee": 20.0},
    )
    assert replace(again, bodies=model.bodies) == model  # inertia: but for rounding
    assert model.with_() == model


# Breaks when the factor of a link is that of its whole body, or its inertia is not moved along: the variant
# is the model of a file that says so.
def test_mass_of_a_link(tmp_path):
    text = """<mujoco><worldbody><body name="arm"><freejoint/>
      <geom type="box" size=".1 .2 .3" mass="2"/>
      <body name="hand" pos="0.5 0 0.1" euler="0 30 20"><geom type="box" size=".1 .05 .02" mass="{}"/></body>
    </body></worldbody></mujoco>"""
    models = []
    for mass in (1.0, 3.0):
        path = tmp_path / f"{mass}.xml"
        path.write_text(text.format(mass))
        models.append(amontons.load_model(path))
    heavy = models[0].with_(mass={"hand": 3.0})
    for name in ("mass", "centre_of_mass", "inertia"):
        for ours, theirs in ((heavy.bodies, models[1].bodies), (heavy.links, models[1].links)):
            assert np.array(getattr(ours[0], name)) == pytest.approx(np.array(getattr(theirs[0], name)))
    whole = models[0].with_(mass_scale={"arm": 2.0})
    assert whole.bodies[0].mass == pytest.approx(6.0)
    assert whole.links[0].mass == pytest.approx(2.0)


def pairs(material, rule="maximum"):
    model = replace(robot(), friction_rule=rule)
    floor, foot = 0, next(k for k, g in enumerate(model.geoms) if g.body == model.body_index("left_foot"))
    return replace(model, pair_materials=(PairMaterial(floor, foot, material),)), foot


# Breaks when a pair with a material of its own keeps the friction that its geoms had, which is why randomised
# friction did nothing in models of files.
@pytest.mark.parametrize("rule", ["geometric_mean", "maximum", "mean"])
def test_pairs_follow_their_geoms(rule):
    combine = {"geometric_mean": lambda a, b: sqrt(a * b), "maximum": max, "mean": lambda a, b: (a + b) / 2}
    old = combine[rule](0.8, 0.6)
    model, _ = pairs(Material(friction=old, compliance=1e-5), rule)
    found = model.with_(friction={"*_foot": 1.1}).pair_materials[0].material
    assert found == Material(friction=combine[rule](0.8, 1.1), compliance=1e-5)
    of_one, _ = pairs(Material(friction=0.6), rule)  # of the foot alone, by its priority
    assert of_one.with_(friction={"left_foot": 0.2}).pair_materials[0].material.friction == 0.2


# Breaks when a variant of friction crosses the static one, or a pair forgets it.
def test_static_friction_changes_in_proportion():
    steel = Material(friction=0.4, friction_static=0.5, stribeck_speed=0.1)
    model, foot = pairs(steel)
    found = model.with_(friction={(model.geom_names[0], "left_foot"): 0.8}).pair_materials[0].material
    assert (found.friction, found.friction_static, found.stribeck_speed) == (0.8, 1.0, 0.1)
    geoms = [replace(geom, material=steel) for geom in model.geoms]
    of_geoms = replace(model, geoms=tuple(geoms), pair_materials=())
    assert of_geoms.with_(friction={"*": 0.2}).geoms[foot].material.friction_static == pytest.approx(0.25)
    slid = of_geoms.with_(friction={(model.geom_names[0], "left_foot"): 0.0}).pair_materials[0].material
    assert (slid.friction, slid.friction_static, slid.stribeck_speed) == (0.0, 0.0, 0.1)


# Breaks when a friction that a pair has by itself is changed by a rule that it never followed, or stays
# without a word; when naming the pair does not set it, or a pair without a material gets none.
def test_pairs_of_their_own():
    model, foot = pairs(Material(friction=0.33))
    with pytest.warns(ModelWarning, match="friction of pairs of their own stays"):
        other = model.with_(friction={"*_foot": 1.1})
    assert other.pair_materials == model.pair_materials
    floor = model.geom_names[0]
    named = model.with_(friction={(floor, "*_foot"): 0.2})
    assert [(p.geom_a, p.geom_b) for p in named.pair_materials] == [(0, foot), (0, foot + 1)]
    assert [p.material.friction for p in named.pair_materials] == [0.2, 0.2]


# Breaks when a friction below that of the floor changes nothing and nobody says so, or what does is warned
# of.
def test_a_value_that_changes_no_contact():
    model = replace(robot(), friction_rule="maximum")
    with pytest.warns(ModelWarning, match="changes no contact"):
        model.with_(friction={"*_foot": 0.3})
    with warnings.catch_warnings(action="error"):
        model.with_(friction={"*_foot": 0.9})
        model.with_(friction={"*": 0.3})


WRONG = {
    "no name": ({"friction": {"fot": 0.4}}, 'there is no geom or body "fot"'),
    "no mapping": ({"friction": 0.4}, "friction is 0.4; give values by name"),
    "no number": ({"damping": {"left_knee": "much"}}, 'damping of "left_knee"'),
    "negative": ({"friction": {"left_foot": -1}}, "friction is -1; it must not be negative"),
    "twice": ({"friction": {"left_foot": 1, "left_*": 2}}, "two patterns name"),
    "no mass": ({"mass": {"trunk": 0}}, "both must be positive"),
    "no gain": ({"gain": {"hip": 1}}, 'there is no control "hip"'),
    "pair of one": ({"friction": {("left_foot", "left_foot"): 1}}, "no two geoms of different bodies"),
}


# Breaks when a slip is taken or the message does not name it.
@pytest.mark.parametrize("case", WRONG)
def test_wrong(case):
    given, message = WRONG[case]
    with pytest.raises(amontons.InputError) as error:
        robot().with_(**given)
    assert message in str(error.value)


def test_a_box_stops_by_the_friction_of_the_variant():
    # v^2 / (2 mu g) is the way of a box that slides on the floor: breaks when contacts use the old friction.
    # The first step moves at once by what friction has left of v: half a step of way is the tolerance.
    builder = ModelBuilder()
    builder.add_floor(material=Material(friction=0.5))
    builder.add_body("box", shape=shapes.Box((0.1, 0.1, 0.05)), mass=1.0, position=(0, 0, 0.05),
                     linear_velocity=(1.0, 0, 0), material=Material(friction=0.5))  # fmt: skip
    model = builder.build()
    for mu in (0.2, 0.4):
        sim = Simulation(model.with_(friction={"*": mu}), dt=1e-3)
        sim.run(1.0)
        assert sim.state.positions[0, 0] == pytest.approx(1 / (2 * mu * 9.81), abs=1e-3)
