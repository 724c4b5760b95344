# ruff: noqa: E501  (lines of files as they are written)
"""URDF with loops, files of xacro, and compiled models of MuJoCo."""

import math
import sys
import warnings

import amontons
import numpy as np
import pytest
from amontons import FileError, InputError, Limits, ModelWarning, UnsupportedWarning

mujoco = pytest.importorskip("mujoco")

TILT, LENGTH, CRANK, COUPLER = 0.02, 0.5, 2.0, 3.0
"""rad, m, kg, kg: a parallelogram that hangs from the world, a little out of the vertical"""


def link(name, mass, centre, length):
    """A thin rod along z or x."""
    big, small = mass * length**2 / 12, 1e-4
    moments = (small, big, big) if name == "coupler" else (big, big, small)
    inertia = " ".join(f'{key}="{value}"' for key, value in zip(("ixx", "iyy", "izz"), moments, strict=True))
    return (
        f'<link name="{name}"><inertial><origin xyz="{centre}"/><mass value="{mass}"/>'
        f'<inertia {inertia} ixy="0" ixz="0" iyz="0"/></inertial></link>'
    )


def hinge(name, parent, child, xyz, rpy):
    return (
        f'<joint name="{name}" type="continuous"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{xyz}" rpy="{rpy}"/><axis xyz="0 1 0"/></joint>'
    )


def parallelogram(folder, more, name="four_bar.urdf"):
    path = folder / name
    path.write_text(
        "<robot name='four_bar'><link name='world'/>"
        + link("left", CRANK, f"0 0 {-LENGTH / 2}", LENGTH)
        + link("right", CRANK, f"0 0 {-LENGTH / 2}", LENGTH)
        + link("coupler", COUPLER, "0.4 0 0", 0.8)
        + "<link name='tip'/><link name='end'/>"
        + hinge("a", "world", "left", "0 0 0", f"0 {TILT} 0")
        + hinge("b", "world", "right", "0.8 0 0", f"0 {TILT} 0")
        + hinge("c", "left", "coupler", f"0 0 {-LENGTH}", f"0 {-TILT} 0")
        + '<joint name="d" type="fixed"><parent link="coupler"/><child link="tip"/><origin xyz="0.8 0 0"/></joint>'
        + f'<joint name="e" type="fixed"><parent link="right"/><child link="end"/><origin xyz="0 0 {-LENGTH}"/></joint>'
        + more
        + "</robot>"
    )
    return path


LOOP = (
    '<loop name="close" type="{}"><predecessor link="coupler"><origin xyz="0.8 0 0"/></predecessor>'
    f'<successor link="right"><origin xyz="0 0 {-LENGTH}" rpy="0 {-TILT} 0"/></successor><axis xyz="0 1 0"/></loop>'
)


def load(path, **options):
    with warnings.catch_warnings(action="error"):
        warnings.filterwarnings("ignore", message=".*the base link")
        warnings.filterwarnings("ignore", message=".*moments of inertia")
        return amontons.load_model(path, **options)


# Breaks when a frame of a loop, its axis or its kind is read otherwise: the parallelogram then jams or opens.
# Small oscillations: w^2 = (m + M) g / ((2 m / 3 + M) L), theta = theta0 cos(w t); of second order in theta0 they
# are slower by theta0^2 / 16 = 2.5e-5, and the midpoint rule errs by (w dt)^2 / 24 of the phase.
@pytest.mark.parametrize("kind", ["revolute", "continuous", "spherical", "extended"])
def test_four_bar_swings(tmp_path, kind):
    if kind == "extended":
        pytest.importorskip("yaml")
        (tmp_path / "four_bar.yaml").write_text("closed_loop: [[tip, e]]\ntype: [3D]\nname_mot: a\n")
        model = load(parallelogram(tmp_path, ""), loops=tmp_path / "four_bar.yaml")
    else:
        model = load(parallelogram(tmp_path, LOOP.format(kind)))
    (loop,) = [joint for joint in model.joints if joint.closes_loop]
    assert model.nv == 3
    assert loop.spherical == (kind in ("spherical", "extended"))
    simulation = amontons.Simulation(model, dt=1e-3, tolerance=1e-10)
    simulation.run(0.7)
    rate = math.sqrt((CRANK + COUPLER) * 9.81 / ((2 * CRANK / 3 + COUPLER) * LENGTH))
    angle = simulation.kinematics.coordinate("a") + TILT
    assert angle == pytest.approx(TILT * math.cos(rate * 0.7), abs=1e-3 * TILT)
    np.testing.assert_allclose(simulation.kinematics.link("coupler")["orientation"], (1, 0, 0, 0), atol=1e-6)


# Breaks when a loop that is open in the pose of the file is passed over, or its size is wrong.
def test_open_loop_is_told(tmp_path):
    path = parallelogram(tmp_path, LOOP.format("revolute").replace('"0.8 0 0"', '"0.81 0 0"'))
    with pytest.warns(ModelWarning, match=r'loops that are open .* "close" 10 mm'):
        amontons.load_model(path)


# Breaks when a wrong loop gives no message with the file and the thing, or one that another program reads.
@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            ('type="revolute"', 'type="helical"'),
            r'four_bar.urdf:1: <loop name="close">: type="helical"; known',
        ),
        (
            ('predecessor link="coupler"', 'predecessor link="nobody"'),
            r'<predecessor> names no link \("nobody"\)',
        ),
        (('predecessor link="coupler"', 'predecessor link="right"'), "joins a link to itself"),
        (('<axis xyz="0 1 0"/></loop>', '<axis xyz="0 0 0"/></loop>'), "has no direction"),
        (
            ('origin xyz="0.8 0 0"/></predecessor', 'origin xyz="0.8 0"/></predecessor'),
            "xyz is not three numbers",
        ),
    ],
)
def test_wrong_loops(tmp_path, change, message):
    text = LOOP.format("revolute")
    assert change[0] in text
    with pytest.raises(FileError, match=message):
        load(parallelogram(tmp_path, text.replace(*change)))


# Breaks when a coupling of URDF+ is dropped unsaid.
def test_couplings_are_listed(tmp_path):
    more = '<coupling name="belt"><predecessor link="left"/><successor link="right"/><ratio value="2"/></coupling>'
    with pytest.warns(UnsupportedWarning, match="a coupling of URDF"):
        model = amontons.load_model(parallelogram(tmp_path, more))
    assert model.unread[0].effect == "large"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("closed_loop: [[tip, nobody]]", '"nobody", which is no link and no joint'),
        ("closed_loop: [[tip]]", r"closed_loop\[0\] must be two names"),
        ("closed_loop: [[tip, e]]\ntype: [2D]", '"2D"; known are 3D and 6D'),
        ("closed_loop: [[", "is no YAML"),
        ("3", "holds no table"),
    ],
)
def test_wrong_extended_files(tmp_path, text, message):
    pytest.importorskip("yaml")
    (tmp_path / "loops.yaml").write_text(text)
    with pytest.raises(FileError, match=message):
        load(parallelogram(tmp_path, ""), loops=tmp_path / "loops.yaml")


# Breaks when loops= is taken for files that have no use for it.
def test_loops_of_other_files(root, tmp_path):
    with pytest.raises(InputError, match="loops is for URDF"):
        load(root / "examples" / "models" / "arm.xml", loops="x.yaml")
    with pytest.raises(FileNotFoundError):
        load(parallelogram(tmp_path, ""), loops=tmp_path / "none.yaml")


# Breaks when xacro is not run, or its absence, its errors and its danger are not told.
def test_xacro(tmp_path, monkeypatch):
    path = tmp_path / "arm.urdf.xacro"
    plain = parallelogram(tmp_path, "").read_text()
    text = plain.replace("<robot ", '<robot xmlns:xacro="http://www.ros.org/wiki/xacro" ', 1)
    path.write_text(text.replace(f'mass value="{COUPLER}"', 'mass value="${2 * 2.5}"'))
    with pytest.raises(FileError, match="xacro evaluates what the file says"):
        load(path, limits=Limits(folder=tmp_path))
    with monkeypatch.context() as patch:
        patch.setitem(sys.modules, "xacro", None)
        with pytest.raises(InputError, match=r"pip install amontons\[ros\]"):
            load(path)
    pytest.importorskip("xacro", reason="needs xacro")
    model = load(path)
    assert model.bodies[model.body_index("coupler")].mass == 5
    path.write_text(text.replace(f'mass value="{COUPLER}"', 'mass value="${nothing}"'))
    with pytest.raises(FileError, match="xacro cannot expand it"):
        load(path)


# Breaks when a compiled model loses a part of what its XML says: both move alike, bit for bit.
@pytest.mark.parametrize("name", ["arm.xml", "gripper.xml", "quadruped.xml"])
def test_compiled_models(root, tmp_path, name):
    source = root / "examples" / "models" / name
    mujoco.mj_saveModel(mujoco.MjModel.from_xml_path(str(source)), str(tmp_path / "model.mjb"))
    model, again = amontons.load_model(source), amontons.load_model(tmp_path / "model.mjb")
    assert again == model
    assert again.keyframes == model.keyframes
    assert again.sensors == model.sensors


# Breaks when a part that is not read is lost unsaid because there is no element to name, or damage crashes.
def test_compiled_model_lists_and_refuses(tmp_path):
    model = mujoco.MjModel.from_xml_string(
        "<mujoco><worldbody><body name='finger'><joint name='knuckle'/><geom size='0.1'/></body></worldbody>"
        "<actuator><muscle name='flexor' joint='knuckle' lengthrange='0 1'/></actuator></mujoco>"
    )
    path = tmp_path / "muscle.mjb"
    mujoco.mj_saveModel(model, str(path))
    with pytest.warns(UnsupportedWarning, match="flexor"):
        assert amontons.load_model(path).unread[0].effect == "large"
    data = path.read_bytes()
    for damaged in (data[:100], b"", b"x" * 500, data[:-50]):
        path.write_bytes(damaged)
        with pytest.raises(FileError, match="is no compiled model"):
            amontons.load_model(path)
    path.write_bytes(data)
    with pytest.raises(FileError, match=r"limits\.memory"):
        amontons.load_model(path, limits=Limits(memory=10))
    with pytest.raises(FileError, match=r"a \.mjb cannot be confined"):
        amontons.load_model(path, limits=Limits(folder=tmp_path))
