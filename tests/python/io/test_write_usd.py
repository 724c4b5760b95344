"""Models written as USD: all of them comes back, other programs find the schema, and edits count."""

import re
from dataclasses import replace

import amontons
import numpy as np
import pytest
from amontons import FileError, UnsupportedWarning
from every_part import every_part
from problems import DATA, quiet, silent

Usd = pytest.importorskip("pxr.Usd", reason="needs usd-core")

OWN = ("arm.xml", "dog.urdf", "gripper.xml", "quadruped.xml")
ROBOTS = DATA / "robots"
SHARED = (
    "bullet3/kuka_iiwa/model.urdf", "bullet3/quadruped/minitaur.urdf", "bullet3/r2d2.urdf",
    "bullet3/racecar/racecar.urdf", "dm_suite/ball_in_cup.xml", "dm_suite/cheetah.xml", "dm_suite/finger.xml",
    "dm_suite/fish.xml", "dm_suite/humanoid.xml", "dm_suite/manipulator.xml", "dm_suite/pendulum.xml",
    "dm_suite/stacker.xml", "dm_suite/walker.xml",
    "example-robot-data/robots/bolt_description/robots/bolt.urdf",
    "example-robot-data/robots/double_pendulum_description/urdf/double_pendulum.urdf",
    "example-robot-data/robots/laikago_description/urdf/laikago.urdf",
    "example-robot-data/robots/solo_description/robots/solo12.urdf", "gymnasium/ant.xml",
    "gymnasium/half_cheetah.xml", "gymnasium/hopper.xml", "gymnasium/inverted_double_pendulum.xml",
    "gymnasium/pusher_v5.xml", "gymnasium/swimmer.xml", "gymnasium/walker2d_v5.xml", "mujoco/car/car.xml",
    "mujoco/replicate/stonehenge.xml", "mujoco/slider_crank/slider_crank.xml",
    "mujoco/surfacevel/treadmill.xml", "shadow_hand/right_hand.xml", "ufactory_xarm7/xarm7_nohand.xml",
    "unitree_go1/go1.xml",
)  # fmt: skip


def again(model, folder, name="model.usda"):
    quiet(amontons.write_model, model, folder / name)
    return quiet(amontons.load_model, folder / name)


def apart(one, other, duration=0.5):
    """The largest distance (m) and part of a quaternion between two motions at their ends."""
    ends = []
    for model in (one, other):
        simulation = amontons.Simulation(model, dt=5e-3)
        quiet(simulation.run, duration)
        ends.append(np.hstack((simulation.state.positions, simulation.state.orientations)))
    return np.abs(ends[0] - ends[1]).max()


# Breaks when a field of a part is lost, read into another one or rounded, in text or in binary form.
@pytest.mark.parametrize("suffix", [".usda", ".usdc", ".usd"])
def test_every_part_comes_back(tmp_path, suffix):
    model = every_part()
    assert again(model, tmp_path, f"model{suffix}") == model


# Breaks when sites, sensors, keyframes or controls of a robot file do not come back, or it moves otherwise.
@pytest.mark.parametrize("name", OWN)
def test_own_robots(root, tmp_path, name):
    pytest.importorskip("mujoco")
    model = amontons.load_model(root / "examples" / "models" / name)
    read = again(model, tmp_path)
    assert (read, read.sites, read.sensors, read.keyframes) == (
        model, model.sites, model.sensors, model.keyframes,
    )  # fmt: skip
    assert read.control_names == model.control_names
    assert apart(model, read) < 1e-9


# The same for robots of others. Breaks when a shape, a joint or a drive of theirs is lost on the way.
@pytest.mark.parametrize("name", SHARED)
def test_shared_robots(tmp_path, name):
    pytest.importorskip("mujoco")
    if not (ROBOTS / name).is_file():
        pytest.skip("no shared robots")
    model = quiet(amontons.load_model, ROBOTS / name)
    assert apart(model, again(model, tmp_path, "model.usdc")) < 1e-9


def without_ours(path):
    """The scene as a program sees it that knows UsdPhysics alone."""
    stage = Usd.Stage.Open(str(path))
    for prim in stage.Traverse():
        for found in prim.GetAuthoredProperties():
            if found.GetName().startswith("amontons:"):
                prim.RemoveProperty(found.GetName())
    plain = path.with_name("plain.usda")
    stage.Export(str(plain))
    return plain


# Breaks when masses, frames, axes, limits or springs that others read from the schema mean another motion: it
# has single precision, 6e-8, which 0.1 s of a swinging chain multiply by less than 100.
@pytest.mark.parametrize("kind", ["springs", "slides", "servo"])
def test_other_programs_read_the_same(tmp_path, kind):
    builder = amontons.ModelBuilder(gravity=(0.3, 0, -9.81), friction_rule="mean")
    for k in range(3):
        builder.add_body(
            f"b{k}", shape=amontons.shapes.Box((0.1, 0.02, 0.03)), density=800, position=(0.2 * k, 0, 1),
            orientation=amontons.axis_angle((1, 0, 0), 0.3 * k),
        )  # fmt: skip
    motor = amontons.Motor("position", 0.4, kp=30, kd=1) if kind == "servo" else amontons.Motor()
    spring = {"stiffness": 2.0, "rest": 0.3, "damping": 0.1} if kind == "springs" else {}
    if kind == "slides":
        builder.add_joint(
            amontons.Joint(
                "planar", body_a="b0", body_b=None, frame_b=amontons.Transform((0, 0, 1)),
                dofs=(
                    amontons.Dof("slide", (0, 0, 1), stiffness=50), amontons.Dof("slide", (1, 0, 0)),
                    amontons.Dof("hinge", (0, -1, 0)),
                ),
            )
        )  # fmt: skip
    else:
        builder.add_revolute_joint("b0", point=(-0.1, 0, 1), axis=(0.6, 0.8, 0), motor=motor, **spring)
    builder.add_revolute_joint(
        "b0", "b1", point=(0.1, 0, 1), axis=(0, 1, 0), limits=(-0.1, 2), motor=motor, **spring
    )
    builder.add_ball_joint("b1", "b2", point=(0.3, 0, 1))
    model = builder.build()
    quiet(amontons.write_model, model, tmp_path / "model.usda")
    plain = quiet(amontons.load_model, without_ours(tmp_path / "model.usda"))
    plain = replace(plain, trees=model.trees)  # the schema has no form of joints
    assert plain.body_names == model.body_names
    assert not plain.unread
    assert 0 < apart(model, plain, 0.1) < 5e-6


# Breaks when an edit of a prim is passed over, or takes more with it than that prim.
def test_edits_count(tmp_path):
    model = every_part()
    file = tmp_path / "model.usda"
    quiet(amontons.write_model, model, file)
    stage = Usd.Stage.Open(str(file))
    stage.GetPrimAtPath("/model/b1").GetAttribute("physics:mass").Set(77.0)
    stage.GetPrimAtPath("/model/b2").GetAttribute("xformOp:translate").Set((1, 2, 3))
    stage.GetPrimAtPath("/model/gravity").GetAttribute("physics:gravityMagnitude").Set(1.5)
    stage.Save()
    read = quiet(amontons.load_model, file)
    assert read.bodies[1].mass == 77
    assert read.bodies[1].name == "b1"
    assert read.bodies[2].pose.position == (1, 2, 3)
    assert np.linalg.norm(read.gravity) == pytest.approx(1.5)
    assert read.bodies[3:] == model.bodies[3:]
    assert read.joints == model.joints
    assert read.couplings == model.couplings


# Breaks when the two coefficients of UsdPhysics become one, or Stribeck's curve goes unsaid.
def test_static_friction(tmp_path):
    builder = amontons.ModelBuilder()
    steel = amontons.Material(friction=0.3, friction_static=0.5)
    for k, material in enumerate((steel, replace(steel, stribeck_speed=0.1))):
        builder.add_body(
            f"b{k}", shape=amontons.shapes.Sphere(0.1), mass=1, position=(k, 0, 0), material=material
        )
    lost = quiet(amontons.write_model, builder.build(), tmp_path / "m.usda")
    assert [str(entry) for entry in lost] == ['geom "geom1": Stribeck\'s curve of its friction']
    bare = re.sub(r"\n *custom string amontons:[^\n]*", "", (tmp_path / "m.usda").read_text())
    (tmp_path / "bare.usda").write_text(bare)
    for geom in quiet(amontons.load_model, tmp_path / "bare.usda").geoms:
        assert (geom.material.friction, geom.material.friction_static) == pytest.approx((0.3, 0.5))


# Breaks when a scene that lost a part is read as if it had all, or the message is missing.
def test_parts_that_went(tmp_path):
    file = tmp_path / "model.usda"
    quiet(amontons.write_model, every_part(), file)
    stage = Usd.Stage.Open(str(file))
    stage.RemovePrim("/model/joints/pin")
    stage.Save()
    with pytest.warns(UnsupportedWarning, match="prims came, went or changed"):
        read = amontons.load_model(file)
    assert read.unread[0].effect == "large"
    assert "pin" not in read.joint_names
    stage.GetPrimAtPath("/model/b1").GetAttribute("amontons:part").Set("{")
    stage.Save()
    with pytest.raises(FileError, match="amontons:part is damaged"):
        amontons.load_model(file)


# Breaks when what other programs do not find is not told with its effect, or what they find is.
def test_losses_are_told(tmp_path):
    with pytest.warns(UnsupportedWarning, match="are lost for other programs than amontons") as caught:
        lost = amontons.write_model(every_part(), tmp_path / "model.usda")
    assert len(caught) == 1
    assert {str(entry) for entry in lost if entry.effect == "large"} >= {"model: 2 couplings of coordinates"}
    assert [entry.effect for entry in lost] == sorted(
        (entry.effect for entry in lost), key=("large", "small", "none").index
    )
    builder = amontons.ModelBuilder()
    builder.add_body("a", shape=amontons.shapes.Sphere(0.1), density=1)
    assert silent(amontons.write_model, builder.build(), tmp_path / "ball.usda") == ()


# Breaks when programs of USD do not see what a body looks like, see its colliders too, or collide with it.
def test_visuals_are_prims(tmp_path):
    from pxr import UsdGeom, UsdPhysics

    builder = amontons.ModelBuilder()
    builder.add_body("cup", shape=amontons.shapes.Sphere(0.1), density=1, position=(0, 0, 1))
    triangle = amontons.parts.TriangleMesh([(0, 0, 0), (0.1, 0, 0), (0, 0.1, 0)], [(0, 1, 2)])
    builder.add_visual("cup", triangle, position=(0, 0, 0.2), colour=(1, 0.5, 0, 0.25))
    builder.add_visual(None, amontons.shapes.Box((1, 1, 0.1)))
    builder.add_body("bare", shape=amontons.shapes.Sphere(0.1), density=1)
    model = builder.build()
    assert amontons.write_model(model, tmp_path / "model.usda") == ()
    stage = Usd.Stage.Open(str(tmp_path / "model.usda"))
    mesh = UsdGeom.Mesh(stage.GetPrimAtPath("/model/cup/visual_0"))
    np.testing.assert_array_equal(mesh.GetPointsAttr().Get(), triangle.vertices)
    assert not mesh.GetPrim().HasAPI(UsdPhysics.CollisionAPI)
    assert not mesh.GetPrim().HasAPI(UsdPhysics.MeshCollisionAPI)
    assert tuple(mesh.GetDisplayColorAttr().Get()[0]) == (1, 0.5, 0)
    assert mesh.GetDisplayOpacityAttr().Get()[0] == 0.25
    place = UsdGeom.XformCache().GetLocalToWorldTransform(mesh.GetPrim())
    assert tuple(place.ExtractTranslation()) == (0, 0, 1.2)
    assert stage.GetPrimAtPath("/model/visual_1").GetTypeName() == "Cube"
    purposes = {
        prim.GetParent().GetName(): UsdGeom.Imageable(prim).GetPurposeAttr().Get()
        for prim in stage.Traverse()
        if prim.HasAPI(UsdPhysics.CollisionAPI)
    }
    assert purposes == {"cup": "guide", "bare": "default"}
    read = again(model, tmp_path)
    assert read == model
    assert len(read.visuals) == 2
