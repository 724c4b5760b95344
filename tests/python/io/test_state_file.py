"""Simulations in files: everything comes back, and the motion goes on bit for bit."""

import json
import warnings
from dataclasses import replace

import amontons
import h5py
import numpy as np
import pytest
from amontons import Dof, Joint, Material, ModelBuilder, Motor, Simulation, Transform, shapes
from amontons.model.transforms import axis_angle
from amontons.parts import Keyframe, PathElement

CUBE = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=float)


def everything():
    """A model with every shape, kind of joint and part, in motion and in contact."""
    b = ModelBuilder(gravity=(0.1, 0, -9.81), friction_rule="maximum")
    floor = b.add_geom(None, shapes.Plane(), material=Material(0.3, 0.1, 1e-8))
    b.add_geom(None, shapes.HeightField(0.05 * np.eye(4), 2, 2), position=(0, 5, 0))
    hull = shapes.Hull(0.1 * CUBE)
    b.add_geom(None, shapes.Mesh(hull.vertices, hull.triangles), position=(0, -5, 0))
    solids = [
        shapes.Sphere(0.1),
        shapes.Box((0.1, 0.2, 0.1)),
        shapes.Capsule(0.1, 0.1),
        shapes.Cylinder(0.1, 0.1),
        shapes.Ellipsoid((0.1, 0.15, 0.1)),
        hull,
    ]
    moments = [{}, {"rolling_friction": 0.01}, {"torsional_friction": 0.01}, {"friction_across": 0.1}]
    for i, solid in enumerate(solids):
        b.add_body(
            material=Material(**moments[i % 4]),
            friction_direction=(1, 2, 0) if i % 4 == 3 else None,
            shape=solid,
            density=700.0,
            position=(0.5 * i, 0, 0.25),
            orientation=axis_angle((i, 1, 0.5), 0.3 * i),
            linear_velocity=(0.1 * i, 0.3, 0),
        )
    b.add_body("arm", shape=hull, density=500.0, position=(0, 2, 1))
    b.add_body("tool", shape=shapes.Sphere(0.1), mass=1.0, position=(0.5, 2, 1))
    b.add_revolute_joint("arm", point=(0, 2, 1), axis=(1, 2, 3), motor=Motor("velocity", 1.0, max_effort=2.0))
    b.add_prismatic_joint("tool", "arm", axis=(1, 0, 0), stiffness=100.0, damping=1.0, limits=(-0.1, 0.1))
    b.add_body("bob", shape=hull, density=500.0, position=(0, 3, 1))
    b.add_ball_joint("bob", point=(0.3, 3, 1), damping=0.1)
    b.add_body("end", shape=hull, density=500.0, position=(0, 3, 0.5))
    b.add_distance_joint("end", "bob", point_a=(0, 3, 0.5), point_b=(0, 3, 1), limits=(None, 0.6))
    frame = Transform((0, 0, 0.2), axis_angle((1, 1, 0), 0.2))
    b.add_joint(
        Joint("general", body_a="body0", body_b=None, frame_b=frame, dofs=[Dof("slide")] * 1, spherical=True)
    )
    b.add_tendon(
        "rope",
        path=[
            (None, (0, 2, 2)),
            PathElement("sphere", "arm", radius=0.05, side=(0, 1, 0)),
            ("tool", (0, 0, 0)),
        ],
        limits=(None, 1.2),
        stiffness=10.0,
        rest=(0.1, 0.2),
        damping=0.1,
        friction=0.01,
        armature=0.02,
    )
    b.add_tendon(joints={0: 1.0, 1: -0.5}, damping=0.2)
    b.add_actuator("drive", joint=0, gear=2.0, law="position", kp=1.0, control=0.3, control_limits=(-1, 1))
    b.add_actuator(
        "pull", tendon="rope", force_limits=(None, 3), dynamics="filter", time_constant=0.1, control=1.0
    )
    b.add_actuator("lift", body="bob", force=(0, 0, 1), torque=(0.1, 0, 0), position=(0.1, 0, 0), control=0.2)
    b.add_coupling(0, 1, coefficients=(0, 2.0, 0.5), compliance=1e-4)
    b.set_pair_material(floor, 3, Material(0.9))
    b.exclude("arm", "tool")
    b.add_body("belt", motion="kinematic", position=(5, 0, 0), angular_velocity=(0, 0, 1))
    b.add_geom("belt", shapes.Box((1, 1, 0.1)), surface_velocity=(1, 0, 0), category=2, mask=3)
    model = b.build()
    n, dofs = len(model.bodies), model.dofs
    key = Keyframe(
        "up",
        0.1,
        ((0.0, 0.1, 0.2),) * n,
        ((1.0, 0.0, 0.0, 0.0),) * n,
        *[((0.0,) * 3,) * n] * 2,
        (0.3,) * dofs,
        (0.3,) * len(model.control_names),
    )
    return replace(model, keyframes=(key,))


def advanced(sim, steps):
    with warnings.catch_warnings(action="ignore", category=amontons.StepWarning):
        for _ in range(steps):
            sim.step()
    return sim


@pytest.fixture(scope="module")
def saved(tmp_path_factory):
    sim = advanced(Simulation(everything(), dt=4e-3, tolerance=1e-5, max_substeps=2), 75)
    sim.state.forces[0] = (0.1, 0.2, 0.3)
    sim.set_control(0, 0.5)
    path = tmp_path_factory.mktemp("state") / "sim.h5"
    sim.save(path)
    return sim, path


# Breaks when a part of the model, an option or a number of the state does not come back exactly, or when a
# step depends on something that is not in the file.
def test_continues_bit_for_bit(saved):
    sim, path = saved
    again, threaded = Simulation.load(path), Simulation.load(path, threads=2)
    assert again.model == sim.model
    assert again.model.keyframes == sim.model.keyframes
    assert again.model.actuators == sim.model.actuators
    assert again.options == sim.options
    assert (again.time, again.steps) == (sim.time, sim.steps) == (pytest.approx(0.3), 75)
    before = sim._core.snapshot()
    for name, values in before.arrays.items():
        np.testing.assert_array_equal(values, again._core.snapshot().arrays[name], err_msg=name)
    advanced(sim, 10), advanced(again, 10), advanced(threaded, 10)
    assert len(sim.contacts) > 5
    for other in (again, threaded):
        for name, values in sim._core.snapshot().arrays.items():
            np.testing.assert_array_equal(values, other._core.snapshot().arrays[name], err_msg=name)
        np.testing.assert_array_equal(sim.contacts, other.contacts)
    sim._core.restore(before)  # for the other tests


# Breaks when a file from before there were moments is not read: its materials and geoms have fewer fields,
# its contacts eight columns.
def test_file_without_moments(tmp_path):
    sim = advanced(Simulation(amontons.scenes.stack(boxes=2)), 3)
    sim.save(tmp_path / "now.h5")
    model = json.loads(h5py.File(tmp_path / "now.h5")["model"][()])
    for geom in model["geoms"]:
        del geom["friction_direction"]
        for name in ("friction_across", "torsional_friction", "rolling_friction"):
            del geom["material"][name]

    def edit(file):
        contacts = file["state/contacts"][:, :8]
        replaced("state/contacts", contacts)(file)
        replaced("model", json.dumps(model).encode())(file)

    again = Simulation.load(change(tmp_path / "now.h5", tmp_path, edit))
    assert again.model == sim.model
    advanced(sim, 5), advanced(again, 5)
    np.testing.assert_array_equal(sim.state.positions, again.state.positions)


# Breaks when a loaded simulation cannot be saved as the same file.
def test_second_generation(saved, tmp_path):
    _, path = saved
    Simulation.load(path).save(tmp_path / "again.h5")
    with h5py.File(path) as a, h5py.File(tmp_path / "again.h5") as b:
        names = []
        a.visit(names.append)
        for name in names:
            if isinstance(a[name], h5py.Dataset):
                np.testing.assert_array_equal(a[name][()], b[name][()], err_msg=name)


def change(path, tmp_path, edit):
    copy = tmp_path / "changed.h5"
    copy.write_bytes(path.read_bytes())
    with h5py.File(copy, "r+") as file:
        edit(file)
    return copy


def replaced(name, value):
    def edit(file):
        del file[name]
        file[name] = value

    return edit


DAMAGE = {
    "no format": (lambda f: f.__delitem__("format"), "is not a file that Simulation.save wrote"),
    "newer": (replaced("version", np.array([99])), "version 99"),
    "no model": (lambda f: f.__delitem__("model"), "/model cannot be read"),
    "broken model": (replaced("model", b'{"shapes": [}'), "/model cannot be read"),
    "model of nothing": (replaced("model", b"{}"), "/model cannot be read"),
    "options": (replaced("options", b"[1]"), "/options"),
    "unknown option": (replaced("options", b'{"speed": 1}'), "/options"),
    "no state": (lambda f: f.__delitem__("state"), "/state is missing"),
    "no positions": (lambda f: f.__delitem__("state/positions"), "positions is missing"),
    "short positions": (replaced("state/positions", np.zeros((2, 3))), "positions has shape (2, 3)"),
    "NaN": (replaced("state/positions", np.full((11, 3), np.nan)), "positions[0, 0] is not finite"),
    "integers": (replaced("state/forces", np.zeros((11, 3), int)), "must hold real numbers"),
    "no time": (replaced("state/time", np.array([1.0, 2.0])), "must be one number"),
    "contact": (replaced("state/contacts", np.full((1, 8), 99.0)), "does not have"),
}


# Breaks when a damaged file is taken, or its message does not start with the name of the file.
@pytest.mark.parametrize("case", DAMAGE)
def test_damaged_file(saved, tmp_path, case):
    edit, message = DAMAGE[case]
    path = change(saved[1], tmp_path, edit)
    with pytest.raises(amontons.FileError) as error:
        Simulation.load(path)
    assert str(error.value).startswith(str(path))
    assert message in str(error.value)


# Breaks when something that is no such file gives a traceback instead of a sentence.
def test_wrong_files(saved, tmp_path, root):
    sim, path = saved
    with pytest.raises(FileNotFoundError, match="no such file"):
        Simulation.load(tmp_path / "gone.h5")
    text = tmp_path / "text.h5"
    text.write_text("not HDF5")
    problem = next((root / "examples" / "problems").glob("*.hdf5"))
    for wrong, message in [
        (tmp_path, "is a directory"),
        (text, "is no HDF5 file"),
        (problem, "read it with amontons.vi.read_problem"),
    ]:
        with pytest.raises(amontons.FileError, match=message):
            Simulation.load(wrong)
    with pytest.raises(amontons.FileError, match="does not exist"):
        sim.save(tmp_path / "folder" / "sim.h5")
    with pytest.raises(
        amontons.InputError, match="unknown option 'speed' of a simulation; known are budget, device,"
    ):
        Simulation.load(path, speed=1)


# Breaks when a failure while writing leaves a partial file, or destroys the old one.
def test_failed_write(saved, tmp_path, monkeypatch):
    sim, _ = saved
    target = tmp_path / "sim.h5"
    target.write_text("old")

    def fail(*_):
        raise OSError("disk full")

    monkeypatch.setattr("amontons.io.recordings.saved_state.model_to_json", fail)
    with pytest.raises(OSError, match="disk full"):
        sim.save(target)
    assert [p.name for p in tmp_path.iterdir()] == ["sim.h5"]
    assert target.read_text() == "old"
