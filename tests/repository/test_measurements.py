"""Readers of measurements and references of others, on small files of our own, and what is made of them."""

import json
import math
import pickle
import struct
import sys
import zipfile

import amontons
import numpy as np
import pytest
from scipy.io import savemat


@pytest.fixture
def measured(root, monkeypatch):
    """The package `measured` of the benchmarks."""
    monkeypatch.syspath_prepend(str(root / "benchmarks"))
    pytest.importorskip("rich")
    before = set(sys.modules)
    import measured
    from measured import adams, adams_files, clearances, damper, four_bar, impacts, masonry, tosses  # noqa: F401

    yield measured
    for name in set(sys.modules) - before:
        if name.split(".")[0] in ("measured", "common", "beside"):
            sys.modules.pop(name)


# ---- tosses --------------------------------------------------------------------------------------------

DESCRIPTION = (
    b"\x80\x02ctorch._utils\n_rebuild_tensor_v2\nq\x00((X\x07\x00\x00\x00storageq\x01ctorch\nDoubleStorage\n"
    b"q\x02X\x01\x00\x00\x000q\x03X\x03\x00\x00\x00cpuq\x04K\x27tq\x05QK\x00K\x03K\r\x86q\x06K\rK\x01\x86q\x07"
    b"\x89ccollections\nOrderedDict\nq\x08)Rq\ttq\nRq\x0b."
)
"""Of a tensor of 3 x 13 numbers."""


def toss_file(path, rows, description=DESCRIPTION):
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("archive/data.pkl", description)
        archive.writestr("archive/data/0", struct.pack(f"<{rows.size}d", *rows.ravel()))


def falling(times):
    """Rows of a cube that falls from 1 m and turns about its own z axis, which is tilted."""
    rows = np.zeros((len(times), 13))
    tilt = np.array([math.cos(0.3), math.sin(0.3), 0, 0])
    for row, t in zip(rows, times, strict=True):
        spin = [math.cos(t), 0, 0, math.sin(t)]  # 2 rad/s
        w, x, y, z = tilt
        row[:4] = [
            w * spin[0] - z * spin[3], x * spin[0] + y * spin[3], y * spin[0] - x * spin[3], w * spin[3]
        ]  # fmt: skip
        row[4:7] = [0.5 * t, 0, 1 - 4.905 * t * t]
        row[7:10], row[10:13] = [0, 0, 2], [0.5, 0, -9.81 * t]
    return rows


# Breaks when an archive is read in another shape, files get lost, or columns, axes of spins or rates are
# mistaken: a free cube then leaves the exact rows.
def test_tosses_are_read_and_followed(measured, tmp_path):
    rows = falling(np.arange(3) / 148)
    for name in ("2", "10"):
        toss_file(tmp_path / f"{name}.pt", rows)
    tosses = measured.tosses.read_tosses(tmp_path)
    assert [toss.name for toss in tosses] == ["2", "10"]
    np.testing.assert_array_equal(tosses[0].rows, rows)
    engine = next(measured.tosses.engines())
    position, angle = measured.tosses.Entrant(engine, 4).errors(tosses[0])
    # A step takes the velocity of its start or its end: at most g h t of position.
    assert position < 100 * 9.81 / 148**2 / 4 / 0.1048
    assert angle < 1e-3


# Breaks when an archive could run what its description names.
def test_archives_run_nothing(measured, tmp_path):
    class Harmful:
        def __reduce__(self):
            return print, ("ran",)

    toss_file(tmp_path / "1.pt", np.zeros(39), pickle.dumps(Harmful(), 2))
    with pytest.raises(amontons.FileError, match="no part of a tensor"):
        measured.tosses.read_tosses(tmp_path)


# ---- Adams ---------------------------------------------------------------------------------------------

SLIDE = """ADAMS/View model name: ours
UNITS/
, LENGTH = METER
PART/01, GROUND
MARKER/0102, PART = 01  ! the axis of the slide
, QP = 1, 2, 3
, REULER = 0D, 90D, 0D
PART/02, MASS = 2
, CM = 0201, IP = 0.1, 0.2, 0.3
MARKER/0201, PART = 02
, QP = 3, 2, 3
MARKER/0202, PART = 02
, QP = 1, 2, 3
, REULER = 0D, 90D, 0D
JOINT/1, TRANSLATIONAL
, I = 0102, J = 0202
"""


def write_case(folder, name, model, columns):
    (folder / f"test_{name}.adm").write_text(model)
    for quantity, values in columns.items():
        lines = [f"# {name}", "#", "Time\tX\tY\tZ"]
        lines += ["\t".join(f"{x:+.9e}" for x in row) for row in values]
        (folder / f"{name}_ADAMS_{quantity}.txt").write_text("\n".join(lines) + "\n")


# Breaks when markers, Euler angles, parts, or signs and points of reactions are wrong: a body of 2 kg on a
# horizontal slide rests, and the ground carries its weight at a lever of 2 m.
def test_models_of_adams(measured, tmp_path):
    times = np.arange(0, 0.2, 0.01)
    still = np.tile([3.0, 2, 3], (len(times), 1))
    weight = 2 * 9.80665
    columns = {
        "Pos": np.column_stack([times, still]),
        "Rforce": np.column_stack([times, np.tile([0, 0, -weight], (len(times), 1))]),
        "Rtorque": np.column_stack([times, np.tile([0, 2 * weight, 0], (len(times), 1))]),
    }
    write_case(tmp_path, "Ours_Case07", SLIDE, columns)
    write_case(tmp_path, "Screw_Case01", SLIDE.replace("TRANSLATIONAL", "SCREW"), columns)
    cases, unread = measured.adams_files.read_cases(tmp_path)
    assert len(unread) == 1
    assert unread[0].startswith("Screw_Case01")
    assert "SCREW" in unread[0]
    (case,) = cases
    (part,) = case.parts.values()
    assert part.mass == 2
    assert part.moments == (0.1, 0.2, 0.3)
    (joint,) = case.connections.values()
    np.testing.assert_allclose(joint.rotation.apply([0, 0, 1]), [0, -1, 0], atol=1e-12)
    record = measured.adams.run(case, 5e-3)
    for row in measured.adams.compare(case, record, 5e-3):
        assert row["rms"] < 1e-4 * weight, row  # the tolerance of a solve
        assert row["met"] == "yes"


RACK = """PART/01, GROUND
MARKER/0101, PART = 01, REULER = 90D, 90D, -90D
MARKER/0102, PART = 01
PART/02, MASS = 1, CM = 0201, IP = 0.04, 0.1, 0.1
MARKER/0201, PART = 02, REULER = 90D, 90D, -90D
PART/03, MASS = 1, CM = 0301, IP = 0.1, 0.1, 0.04
MARKER/0301, PART = 03, QP = 0, 0.1, 0
JOINT/01, REVOLUTE, I = 0101, J = 0201
JOINT/02, TRANSLATIONAL, I = 0102, J = 0301
JOINT/03, RACKPIN, I = 0201, J = 0301, PD = 0.5
"""


# Breaks when a rack is coupled to its pinion the wrong way round, or results of the second part or reaction
# go to the first: the rack falls with m g / (m + I / r^2) and turns the pinion by its travel over r.
def test_rack_and_pinion(measured, tmp_path):
    times, g, r = np.arange(0, 0.2, 0.01), 9.80665, 0.25
    a = g / (1 + 0.1 / r**2)
    nothing = np.zeros_like(times)
    columns = {
        "Pos": np.column_stack([times, nothing, nothing, nothing]),
        "PosRack": np.column_stack([times, nothing, nothing + 0.1, -a * times**2 / 2]),
        "Avel_Pinion": np.column_stack([times, -a * times / r, nothing, nothing]),
        # A coupling is of coordinates: the bearing carries the weight of the pinion and no force of teeth.
        "Rforce1": np.column_stack([times, nothing, nothing, nothing - g]),
        "Rforce2": np.column_stack([times, nothing, nothing, nothing]),
    }
    write_case(tmp_path, "Rack_Case01", RACK, columns)
    ((case,), unread) = measured.adams_files.read_cases(tmp_path)
    assert not unread
    h = 1e-3
    found = {
        row["quantity"]: row["rms"] for row in measured.adams.compare(case, measured.adams.run(case, h), h)
    }
    assert set(found) == set(columns)
    # Velocities and positions belong to instants that differ by at most a step.
    assert found["Pos"] < 1e-9
    assert found["PosRack"] < a * h * 0.2
    assert found["Avel_Pinion"] < a * h / r
    assert found["Rforce1"] < 1e-6 * g
    assert found["Rforce2"] < 1e-6


PROGRAM = """
    test_name = "TranSpring_Case05";
    TestTranSpring(ChVector3d(0, 0, 0), ChVector3d(0, 2, 0), ChCoordsys<>(ChVector3d(0, 2, 0), QUNIT), 100, 5,
                   sim_step, out_step, test_name);
    test_passed &= ValidateReference(test_name, "Pos", 1e-3);
    test_passed &= ValidateReference(test_name, "Vel", 3e-4);
    ref_test_name = "Other_Case01";
    TestOther(QuatFromAngleX(-CH_PI_2), test_name);
    test_passed &= ValidateReference(test_name, "Pos", 7e-1);
    double mass = 1.5;
    ChVector3d inertiaXX(0.04, 0.1, 0.2);
"""


# Breaks when arguments or tolerances of a program go to another case, or a vector is read wrong.
def test_programs_of_cases(measured, tmp_path):
    (tmp_path / "spring.txt").write_text(PROGRAM)
    calls = measured.adams_files.read_programs(tmp_path)
    assert set(calls) == {"TranSpring_Case05", "Other_Case01"}
    assert calls["TranSpring_Case05"].tolerances == {"Pos": 1e-3, "Vel": 3e-4}
    assert calls["Other_Case01"].tolerances == {"Pos": 0.7}
    turned = calls["Other_Case01"].arguments[0]
    np.testing.assert_allclose(turned.apply([0, 1, 0]), [0, 0, -1], atol=1e-12)
    parts, connections = measured.adams_files.FROM_CALL["TranSpring"](calls["TranSpring_Case05"])
    assert parts["part"].mass == 1.5
    assert connections["spring"].numbers == {"stiffness": 100, "damping": 5}


# ---- impacts -------------------------------------------------------------------------------------------


# Breaks when a law of impact is wrong where it is known: a central impact of unit mass reverses the normal
# velocity by the restitution, in every law, and friction stops a slow slip and slows a fast one by mu times
# the normal impulse.
@pytest.mark.parametrize("slip", [0.1, 5.0])
def test_laws_of_impact(measured, slip):
    A, u = np.eye(2)[None], np.array([[-2.0, slip]])
    for name, law in measured.impacts.LAWS.items():
        normal, tangent = law(A, u, 0.3, 0.5)[0]
        assert normal == pytest.approx(3.0, rel=1e-6), name
        assert tangent == pytest.approx(-min(slip, 0.3 * 3.0), rel=1e-6), name


# Breaks when states or rows of a file are mistaken, or an impact that the impulse explains has an error.
def test_impacts_are_read(measured, tmp_path):
    before, normal, tangent = np.array([0.5, -2.0, 3.0]), np.array([0, 1, 0.01]), np.array([1, 0, -0.03])
    mass = np.array([1, 1, measured.impacts.HOMOGENEOUS])
    after = before + (4.0 * normal - 0.2 * tangent) / mass
    row = np.zeros(1, [("states", object), ("n", object), ("d", object)])
    # The file has the third entry of d with the other sign.
    row[0] = (np.array([[0, 0, 0, *before, 0, 0, 0, *after]]), normal[None], (tangent * [1, 1, -1])[None])
    savemat(tmp_path / "one.mat", {"bounces": row})
    found = measured.impacts.read_impacts(tmp_path / "one.mat")
    impulses = measured.impacts.any_impulse(found)
    np.testing.assert_allclose(impulses, [[4.0, -0.2]], rtol=1e-9)
    assert measured.impacts.errors(found, impulses)[0] < 1e-9


# ---- friction damper -----------------------------------------------------------------------------------


# Breaks when units, cycles or the sign of the force are mistaken, or clearance does nothing: the model with
# clearance is right but for a few samples a cycle.
def test_damper(measured, tmp_path):
    rate, clearance, friction = 200, 0.2, 1.0  # Hz, inch, kip
    t = np.arange(0, 4, 1 / rate)
    x = np.sin(2 * np.pi * t)
    band, force = np.zeros_like(x), np.zeros_like(x)
    for k in range(1, len(t)):
        band[k] = np.clip(band[k - 1], x[k] - clearance / 2, x[k] + clearance / 2)
        force[k] = friction * np.sign(band[k] - band[k - 1])
    rows = np.column_stack([t, x, force, np.gradient(x, t)])
    path = tmp_path / "1Hz of ours.json"
    path.write_text(json.dumps({"data": rows.tolist()}))
    sines = measured.damper.read_sines(path)
    assert sines.cycles == 4
    assert sines.scatter() < 0.15 * friction * measured.damper.KIP
    size = friction * measured.damper.KIP
    near = measured.damper.error(sines, size, clearance * measured.damper.INCH)
    far = measured.damper.error(sines, size, 0.0)
    # Without clearance the force is wrong while the rod crosses it: arccos(1 - clearance) / pi of the time.
    assert far == pytest.approx(size * math.sqrt(math.acos(1 - clearance) / math.pi), rel=0.05)
    assert near < 0.3 * size


# ---- masonry -------------------------------------------------------------------------------------------


def assembly_file(path, offsets):
    """Unit cubes on top of each other, each moved along x."""
    corners = [(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)]
    faces = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    nodes = {}
    for k, offset in enumerate(offsets):
        vertex = {str(i): {"x": x + offset, "y": y, "z": z + k} for i, (x, y, z) in enumerate(corners)}
        face = {str(i): corner for i, corner in enumerate(faces)}
        nodes[str(k)] = {"block": {"data": {"vertex": vertex, "face": face}}}
    path.write_text(json.dumps({"data": {"graph": {"data": {"node": nodes}}}}))


# Breaks when blocks are read at other places, the support moves, or the verdict is turned round.
@pytest.mark.parametrize(("offset", "stands"), [(0.45, True), (0.55, False)])
def test_assemblies(measured, tmp_path, offset, stands):
    assembly_file(tmp_path / "pair.json", (0, offset))
    blocks = measured.masonry.assembly(tmp_path / "pair.json")
    assert all(block.is_convex for block in blocks.blocks)
    moved, fell = measured.masonry.watch(blocks, 1.0)
    assert math.isnan(fell) == stands
    assert (moved < 1e-3) == stands


# Breaks when stones slip or turn where statics lets them stand: 0.1074 of the radius (Milankovitch), within
# the interval of the search and what falls too slowly to be seen.
def test_thinnest_arch(measured):
    assert measured.masonry.thinnest_arch(16, 2e-3) == pytest.approx(0.1074, abs=3e-3)


# ---- clearances ----------------------------------------------------------------------------------------


# Breaks when columns go to another body, or the mechanism starts with open joints.
def test_slider_crank_with_clearance(measured, tmp_path):
    names, values = [], []
    states = (
        [0.0765, 0, 0, 1, 0, 0, 0, 0, 0, 11.475, 0, -150, 0],
        [0.306, 0, 0, 1, 0, 0, 0, 0, 0, 11.475, 0, 75, 0],
        [0.459, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0],
    )
    for body, state in enumerate(states):
        for k, value in enumerate(state):
            names.append(f"{'position' if k < 7 else 'velocity'}{len(names)}_ds_{body}")
            values.append(str(value))
    (tmp_path / "slider_crank.ref").write_text("\t".join(names) + "\n" + "\t".join(values) + "\n")
    read = measured.clearances.read_states(tmp_path / "slider_crank.ref")
    dt, crank = 1e-4, 150  # s, rad/s
    found = measured.clearances.run(read, dt, 0.01)
    # The slider stays in its guide, within the depth to which contacts may overlap.
    assert np.abs(found["places"][:, 2]).max() < 1.01 * measured.clearances.CLEARANCE
    assert found["touches"] > 0
    # Velocities of an instant go on from v- to v+ by half a step. If they turn by a in a step, their square
    # is |(3 v+ - v-) / 2|^2 = (1 + 3 a^2 / 4) v^2. A step with a blow keeps v+; the next one has this again.
    assert np.diff(found["energies"]).max() < 0.75 * (crank * dt) ** 2 * found["energies"][0]


# Breaks when the linkage is not the one that the controller knows, or a bearing lets its journal out.
def test_four_bar_with_clearances_follows_its_controller(measured):
    bars = measured.four_bar
    crank = 0.5 * math.pi
    coupler, rocker = bars.closed(crank)
    ends = [length * np.exp(1j * a) for length, a in zip((1, 4, 2.5), (crank, coupler, rocker), strict=True)]
    assert abs(ends[0] + ends[1] - 3 - ends[2]) < 1e-12  # it closes
    middles = [ends[0] + ends[1] / 2, ends[2] / 2]
    poses = np.array([crank, coupler, rocker, *(x for z in middles for x in (z.real, z.imag))])
    found = bars.run(poses, 1e-3, 1.0, 0.05)
    wanted = [bars.wanted(0.05 * k)[0] for k in range(1, 21)]
    assert np.abs(found["angles"][4:, 0] - wanted[4:]).max() < 0.2  # from 1.6 rad at the start
    assert found["places"].max() < 1.05 * bars.CLEARANCE
    # Three clearances shift coupler and rocker by more, the more parallel both are.
    for angle, *others in found["angles"]:
        coupler, rocker = bars.closed(angle)
        least = 3 * bars.CLEARANCE / (2.5 * abs(math.sin(coupler - rocker)))
        assert np.abs(np.array(others) - (coupler, rocker)).max() < 1.1 * least
