"""Models as MJCF and URDF: read back they move alike, and what is lost is listed."""

import math

import amontons
import numpy as np
import pytest
from amontons import InputError, UnsupportedWarning
from amontons.io.models.trees_out import moved
from every_part import every_part
from problems import DATA, quiet

pytest.importorskip("mujoco")

ROBOTS = DATA / "robots"


def written(model, folder, suffix):
    lost = quiet(amontons.write_model, model, folder / f"model{suffix}")
    return quiet(amontons.load_model, folder / f"model{suffix}"), lost


def place(simulation, name, *, centres):
    model, link = simulation.model, simulation.kinematics.link(name)
    k = model.link_index(name) - len(model.bodies)
    part = model.links[k] if k >= 0 else model.bodies[k]
    frame = amontons.Transform(link["position"], link["orientation"])
    return np.array(frame(part.centre_of_mass) if centres else frame.position)


def apart(model, other, duration=0.3, *, centres=False, tolerance=1e-9):
    """The largest distance (m) of frames, or centres, of bodies of one name after the same time."""
    simulations = [amontons.Simulation(m, dt=2e-3, tolerance=tolerance) for m in (model, other)]
    for simulation in simulations:
        quiet(simulation.run, duration)
    ends = ([place(s, name, centres=centres) for name in model.body_names] for s in simulations)
    return max(np.abs(a - b).max() for a, b in zip(*ends, strict=True))


# Breaks when a frame, an axis, a law or an exclusion of a robot is written otherwise than it is read.
@pytest.mark.parametrize("name", ["arm.xml", "dog.urdf", "gripper.xml", "quadruped.xml"])
def test_robots_as_mjcf(root, tmp_path, name):
    model = quiet(amontons.load_model, root / "examples" / "models" / name)
    again, lost = written(model, tmp_path, ".xml")
    assert not [entry for entry in lost if entry.effect != "none"]
    assert again.control_names == model.control_names
    # The first step of the quadruped ends anywhere within its tolerance: rounding picks the method.
    assert apart(model, again, tolerance=1e-12) < (5e-8 if name == "quadruped.xml" else 1e-8)


# The same of robots of others, in contact too; test_mjcf_round_trips compares the parts of those of MJCF.
@pytest.mark.parametrize(("suffix", "near"), [(".xml", 1e-7), (".urdf", 1e-9)])
@pytest.mark.parametrize("name", ["bullet3/kuka_iiwa/model.urdf", "bullet3/r2d2.urdf"])
def test_shared_robots(tmp_path, name, suffix, near):
    if not (ROBOTS / name).is_file():
        pytest.skip("no shared robots")
    model = quiet(amontons.load_model, ROBOTS / name)
    assert apart(model, written(model, tmp_path, suffix)[0]) < near


# Breaks when a hinge off the origin, a slide, the other order of bodies, or a cube that floats above the
# world comes to lie elsewhere. The chain of three degrees of freedom starts away from zero.
@pytest.mark.parametrize("suffix", [".xml", ".urdf"])
def test_joints_of_all_kinds(tmp_path, suffix):
    builder = amontons.ModelBuilder(friction_rule="maximum", trees="auto")  # as what files give
    builder.add_geom(None, amontons.shapes.Box((3, 3, 0.1)), position=(0, 0, -0.1), name="ground")
    turn = amontons.axis_angle((1, 2, 3), 0.4)
    for k, name in enumerate("abcd"):
        builder.add_body(
            name,
            shape=amontons.shapes.Capsule(0.05, 0.1),
            density=700,
            position=(0.5 * k, 0, 1.5),
            orientation=turn,
        )
    builder.add_body("cube", shape=amontons.shapes.Box((0.1, 0.1, 0.1)), density=500, position=(-1, 0, 0.1))
    builder.add_revolute_joint(
        "a", point=(-0.1, 0.05, 1.6), axis=(0, 0.6, 0.8), limits=(-0.5, 0.4), damping=0.1
    )
    # The parent comes first here: the coordinate is that of a from b.
    builder.add_revolute_joint("a", "b", point=(0.25, 0.03, 1.5), axis=(1, 0, 1), friction=0.01)
    builder.add_prismatic_joint("c", "b", axis=(0, 1, 0.2), limits=(-0.1, 0.1))
    if suffix == ".xml":
        dofs = (
            amontons.Dof("hinge", (1, 0, 0), (0, 0.02, 0)),
            amontons.Dof("slide", (0, 1, 0), stiffness=90, rest=0.1),
            amontons.Dof("hinge", (0, 0.6, 0.8), (0.01, 0, 0)),
        )
        frame = amontons.Transform((-0.1, 0, 0.02), turn)
        chain = amontons.Transform()
        for dof, start in zip(dofs, (0.2, 0.05, -0.3), strict=True):
            chain = chain @ moved(dof, start)
        c, d = (amontons.Transform((0.5 * k, 0, 1.5), turn) for k in (2, 3))
        base = c.inverse() @ d @ frame @ chain.inverse()
        builder.add_joint(
            amontons.Joint("pair", body_a="d", body_b="c", frame_a=frame, frame_b=base, dofs=dofs)
        )
    model = builder.build()
    again, lost = written(model, tmp_path, suffix)
    assert not [str(entry) for entry in lost if entry.effect == "large"]
    # Links of URDF have their frames on their axes. Rows of joints hold to the tolerance, in frames of their
    # own.
    assert apart(model, again, centres=True) < 2e-6


# Breaks when a loop is left open unsaid: a four-bar with hinges, and a rod.
def test_loops_as_mjcf(tmp_path):
    builder = amontons.ModelBuilder(trees="auto")
    for name, x in (("left", 0.0), ("right", 0.8)):
        builder.add_body(name, mass=1, inertia=(0.02, 0.02, 0.001), position=(x, 0, -0.25))
        builder.add_revolute_joint(name, point=(x, 0, 0), axis=(0, 1, 0))
    builder.add_body("bar", mass=2, inertia=(0.01, 0.1, 0.1), position=(0.4, 0, -0.5))
    builder.add_body("weight", mass=0.5, inertia=(0.01, 0.01, 0.01), position=(0.4, 0, -0.8))
    builder.add_revolute_joint("bar", "left", point=(0, 0, -0.5), axis=(0, 1, 0))
    builder.add_revolute_joint("bar", "right", point=(0.8, 0, -0.5), axis=(0, 1, 0), name="close")
    builder.add_distance_joint(
        "weight", "bar", point_a=(0.4, 0, -0.8), point_b=(0.4, 0, -0.5), limits=(0, 0.3)
    )
    model = builder.build()
    again, lost = written(model, tmp_path, ".xml")
    assert lost == ()
    simulations = [amontons.Simulation(m, dt=2e-3, tolerance=1e-9) for m in (model, again)]
    for simulation in simulations:
        simulation.state.linear_velocities[model.body_index("weight")] = (0.5, 0, 0)
        simulation.run(0.5)
    ends = [s.kinematics.link("weight")["position"] for s in simulations]
    np.testing.assert_allclose(ends[0], ends[1], atol=1e-5)


# Breaks when something that a format has no element for is left out unsaid.
def test_losses(tmp_path):
    with pytest.warns(UnsupportedWarning, match="are lost for MuJoCo"):
        lost = amontons.write_model(every_part(), tmp_path / "model.xml")
    said = "\n".join(map(str, lost))
    for what in (
        "restitution and compliance", "depends on the direction", "friction_rule", "a mesh",
        'geom14": its static friction', '"pin": its static friction', '"shaft": the bearing',
        "its backlash", '"rope": friction on its path', '"belt": friction on its path',
    ):  # fmt: skip
        assert what in said
    with pytest.raises(InputError, match="turns about a point; URDF has joints with axes"):
        amontons.write_model(every_part(), tmp_path / "model.urdf")


# Breaks when the angles of URDF are those of another order, or wrong where roll and yaw are one.
@pytest.mark.parametrize("pitch", [0.3, math.pi / 2, -math.pi / 2])
def test_angles(pitch):
    from amontons.io.models.urdf_out import roll_pitch_yaw

    turn = amontons.from_euler("xyz", (0.4, pitch, -0.7))
    again = amontons.from_euler("xyz", roll_pitch_yaw(amontons.Transform(rotation=turn)))
    assert abs(np.dot(turn, again)) == pytest.approx(1, abs=1e-12)


# Breaks when a robot looks otherwise to readers of URDF: a mesh on a body that starts turned, and a colour.
def test_visuals_as_urdf(tmp_path):
    builder = amontons.ModelBuilder()
    turn = amontons.axis_angle((1, 2, 3), 0.4)
    shape = amontons.shapes.Box((0.1, 0.1, 0.1))
    builder.add_body("cube", shape=shape, density=500, position=(0, 0, 1), orientation=turn)
    builder.add_revolute_joint("cube", point=(0, 0.3, 1), axis=(1, 0, 0))
    corners = [(0, 0, 0), (0.2, 0, 0), (0, 0.2, 0), (0, 0, 0.2)]
    wedge = amontons.parts.TriangleMesh(corners, [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)])
    builder.add_visual("cube", wedge, position=(0, 0, 0.1), colour=(0.75, 0.25, 0.5, 1))
    builder.add_visual("cube", amontons.shapes.Sphere(0.1), position=(0.1, 0, 0))
    model = builder.build()
    again, lost = written(model, tmp_path, ".urdf")
    assert not [entry for entry in lost if "visual" in str(entry)]
    mesh, ball = again.visuals
    assert (mesh.colour, ball.shape, ball.colour) == ((0.75, 0.25, 0.5, 1), amontons.shapes.Sphere(0.1), None)
    for one, other in zip(model.visuals, (mesh, ball), strict=True):
        assert places(model, one) == places(again, other)


def places(model, visual):
    """The corners of a visual, or its centre, in the world."""
    points = getattr(visual.shape, "vertices", np.zeros((1, 3))).astype(float).tolist()
    frame = model.bodies[0].pose @ visual.frame
    return sorted(tuple(round(x, 5) + 0.0 for x in frame(tuple(point))) for point in points)


# Breaks when a joint with several degrees of freedom is refused, or its axes, limits or names are others in a
# row of joints: masses and places off the start are the same.
@pytest.mark.parametrize(
    "name", ["mujoco/humanoid/humanoid.xml", "gymnasium/humanoid.xml", "dm_suite/fish.xml"]
)
def test_rows_of_joints_as_urdf(tmp_path, name):
    if not (ROBOTS / name).is_file():
        pytest.skip("no shared robots")
    model = quiet(amontons.load_model, ROBOTS / name)
    again, _ = written(model, tmp_path, ".urdf")
    plain = [key for key, each in model.coordinates.items() if each.dof >= 0]
    assert [key for key, each in again.coordinates.items() if each.dof >= 0] == plain
    found = []
    for m in (model, again):
        simulation = amontons.Simulation(m)
        simulation.set_q({key: 0.1 + 0.02 * k for k, key in enumerate(plain)})
        at = [m.coordinates[key].qd.start for key in plain]
        weights = simulation.forces.mass_matrix()[np.ix_(at, at)] - np.diag(
            [armature(m, key) for key in plain]
        )
        limits = [(dof.lower, dof.upper) for dof in (degree(m, key) for key in plain)]
        found.append((weights, [place(simulation, body, centres=True) for body in model.body_names], limits))
    for one, other in zip(*found, strict=True):
        np.testing.assert_allclose(one, other, atol=1e-9)


def degree(model, key):
    coordinate = model.coordinates[key]
    return model.joints[coordinate.joint].dofs[coordinate.dof]


def armature(model, key):
    return degree(model, key).armature


# Breaks when links of a URDF lose name, mass, place or fixed joint, or what hangs on them hangs elsewhere.
@pytest.mark.parametrize(
    "name",
    [
        "bullet3/r2d2", "bullet3/racecar/racecar", "bullet3/quadruped/minitaur",
        "example-robot-data/robots/laikago_description/urdf/laikago",
        "example-robot-data/robots/solo_description/robots/solo12",
    ],
)  # fmt: skip
def test_links_as_urdf(tmp_path, name):
    if not (ROBOTS / f"{name}.urdf").is_file():
        pytest.skip("no shared robots")
    model = quiet(amontons.load_model, ROBOTS / f"{name}.urdf")
    again, lost = written(model, tmp_path, ".urdf")
    assert not [entry for entry in lost if "links" in str(entry)]
    assert again.link_names == model.link_names
    found = []
    for m in (model, again):
        simulation = amontons.Simulation(m)
        # Frames of bodies are on their axes in a URDF that amontons wrote; those of links stay.
        places = [simulation.kinematics.link(link.name)["position"] for link in m.links]
        found.append((places, [link.mass for link in m.links], [body.mass for body in m.bodies]))
    for one, other in zip(*found, strict=True):
        np.testing.assert_allclose(one, other, atol=1e-9)
    assert [(link.joint, link.carrier) for link in model.links] == [(k.joint, k.carrier) for k in again.links]
