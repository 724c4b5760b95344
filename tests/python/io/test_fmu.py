"""Functional mock-up units, validated and run by FMPy: what comes out are the bits of `Simulation.run`."""

import ctypes
import zipfile

import amontons
import numpy as np
import pytest
from amontons import ModelBuilder, Simulation, cli, scenes, shapes
from amontons.model.sensing import SENSORS
from typer.testing import CliRunner

fmpy = pytest.importorskip("fmpy")
from fmpy.fmi2 import FMU2Slave  # noqa: E402
from fmpy.fmi3 import FMU3Slave  # noqa: E402
from fmpy.validation import validate_fmu  # noqa: E402

ARM = """<mujoco><worldbody><geom name="floor" type="plane" size="5 5 .1"/>
<body name="base" pos="0 0 .3"><freejoint name="root"/><geom type="box" size=".2 .15 .05"/>
{legs}</body></worldbody><actuator>{motors}</actuator>
<sensor><jointpos name="angle" joint="j0"/></sensor></mujoco>"""
LEG = """<body name="leg{k}" pos="{x} {y} 0"><joint name="j{k}" axis="0 1 0" damping=".1"/>
<geom type="capsule" fromto="0 0 0 0 0 -.2" size=".03"/><site name="foot{k}" pos="0 0 -.2"/></body>"""
MOTOR = '<position name="m{k}" joint="j{k}" kp="20"/>'


def ball():
    builder = ModelBuilder()
    material = amontons.Material(friction=0.3, restitution=0.8)
    builder.add_geom(None, shapes.Plane(), material=material)
    builder.add_body("ball", position=(0, 0, 1.0), shape=shapes.Sphere(0.1), mass=1.0, material=material)
    return Simulation(builder.build(), dt=1e-2)


def robot(tmp_path):
    legs = "".join(LEG.format(k=k, x=(-0.15, 0.15)[k % 2], y=(-0.12, 0.12)[k // 2]) for k in range(4))
    path = tmp_path / "robot.xml"
    path.write_text(ARM.format(legs=legs, motors="".join(MOTOR.format(k=k) for k in range(4))))
    return Simulation(amontons.load_model(path), dt=5e-3)


class Unit:
    """A unit that FMPy runs, with its variables by name."""

    def __init__(self, path, folder, start=0.0, early=False):
        self.messages = []
        self.description = fmpy.read_model_description(path)
        self.references = {v.name: v.valueReference for v in self.description.modelVariables}
        self.three = self.description.fmiVersion == "3.0"
        kind = FMU3Slave if self.three else FMU2Slave
        self.slave = kind(
            guid=self.description.guid if not self.three else self.description.instantiationToken,
            unzipDirectory=fmpy.extract(path, folder),
            modelIdentifier=self.description.coSimulation.modelIdentifier, instanceName="unit",
        )  # fmt: skip
        if self.three:
            self.slave.instantiate(earlyReturnAllowed=early, loggingOn=True, logMessage=self.note)
        else:
            self.slave.instantiate(loggingOn=True)
        if self.three:
            self.slave.enterInitializationMode(startTime=start)
        else:
            self.slave.setupExperiment(startTime=start)
            self.slave.enterInitializationMode()
        self.slave.exitInitializationMode()
        self.time = start

    def note(self, environment, status, category, message):
        self.messages.append(message.decode())

    def get(self, *names):
        call = self.slave.getFloat64 if self.three else self.slave.getReal
        return np.array(call([self.references[name] for name in names]))

    def count(self, name):
        call = self.slave.getInt32 if self.three else self.slave.getInteger
        return call([self.references[name]])[0]

    def set(self, **values):
        call = self.slave.setFloat64 if self.three else self.slave.setReal
        call([self.references[name.replace("__", ".")] for name in values], list(values.values()))

    def step(self, size):
        self.slave.doStep(currentCommunicationPoint=self.time, communicationStepSize=size)
        self.time += size

    def coordinates(self, kind="q"):
        return self.get(*[name for name in self.references if name.startswith(f"{kind}.")])


SUBJECTS = {
    "ball": lambda folder: ball(),
    "slider-crank": lambda folder: Simulation(scenes.make("slider_crank"), dt=5e-3),
    "robot": robot,
}


# Breaks when a unit makes other steps than the package, starts elsewhere, or describes itself wrongly.
@pytest.mark.parametrize("fmi", ["2.0", "3.0"])
@pytest.mark.parametrize("subject", SUBJECTS)
def test_unit_has_the_bits_of_run(tmp_path, subject, fmi):
    simulation = SUBJECTS[subject](tmp_path)
    path = tmp_path / "unit.fmu"
    amontons.write_fmu(simulation, path, fmi=fmi)
    assert validate_fmu(str(path)) == []
    unit = Unit(path, tmp_path / "unpacked")
    for _ in range(30):
        unit.step(3 * simulation.dt)
        simulation.run(3 * simulation.dt)
        np.testing.assert_array_equal(unit.coordinates("q"), simulation.q)
        np.testing.assert_array_equal(unit.coordinates("qd"), simulation.qd)
    if subject != "slider-crank":
        assert unit.count("contacts.began") > 0


# Breaks when a restored unit continues differently, or its counters are forgotten.
@pytest.mark.parametrize("fmi", ["2.0", "3.0"])
def test_state_comes_back_bit_for_bit(tmp_path, fmi):
    path = tmp_path / "unit.fmu"
    amontons.write_fmu(robot(tmp_path), path, fmi=fmi, outputs=["q.*", "contact_force.*", "contacts*"])
    unit = Unit(path, tmp_path / "unpacked")
    get, put, pack, unpack = (
        getattr(unit.slave, name[unit.three])
        for name in (("getFMUstate", "getFMUState"), ("setFMUstate", "setFMUState"),
                     ("serializeFMUstate", "serializeFMUState"),
                     ("deSerializeFMUstate", "deserializeFMUState"))
    )  # fmt: skip
    names = [n for n in unit.references if n.startswith(("q.", "contact_force."))]
    unit.step(0.1)
    saved = get()
    data = pack(saved)
    before = unit.get(*names), unit.count("contacts.began")
    unit.step(0.2)
    after = unit.get(*names), unit.count("contacts.began")
    other = Unit(path, tmp_path / "other")
    for one, state in ((unit, saved), (other, None)):
        if state is None:
            state = getattr(other.slave, unpack.__name__)(data)
        getattr(one.slave, put.__name__)(state)
        one.time = 0.1
        np.testing.assert_array_equal(one.get(*names), before[0])
        assert one.count("contacts.began") == before[1]
        one.step(0.2)
        np.testing.assert_array_equal(one.get(*names), after[0])
        assert one.count("contacts.began") == after[1]


# Breaks when damaged bytes of a state are taken.
def test_damaged_states_are_refused(tmp_path):
    path = tmp_path / "unit.fmu"
    amontons.write_fmu(ball(), path)
    slave = Unit(path, tmp_path / "unpacked").slave
    data = slave.serializeFMUState(slave.getFMUState())
    for wrong in (data[:-8], data[:40], data[:200] + bytes([data[200] ^ 1]) + data[201:]):
        with pytest.raises(Exception, match="error|failed|Error"):
            slave.deserializeFMUState(wrong)


# Breaks when inputs do not act, or act other than in the package: one unit pulls the other by a spring.
def test_two_units_coupled(tmp_path):
    path = tmp_path / "unit.fmu"
    ours = [ball(), ball()]
    amontons.write_fmu(ours[0], path, inputs=["load.ball.fx"], outputs=["body.ball.x", "q.*"])
    units = [Unit(path, tmp_path / str(k)) for k in range(2)]
    for _ in range(40):
        gap = units[0].get("body.ball.x")[0] - units[1].get("body.ball.x")[0] - 0.5
        for unit, simulation, force in zip(units, ours, (-3 * gap, 3 * gap), strict=True):
            unit.set(load__ball__fx=force)
            simulation.state.forces[0, 0] = force
            unit.step(simulation.dt)
            simulation.step()
            np.testing.assert_array_equal(unit.coordinates(), simulation.q)
    assert units[0].get("body.ball.x")[0] > 0.01


# Breaks when a communication step that is no multiple of dt is made in silence.
def test_steps_between_are_refused(tmp_path):
    path = tmp_path / "unit.fmu"
    amontons.write_fmu(ball(), path)
    unit = Unit(path, tmp_path / "unpacked")
    with pytest.raises(Exception, match="fmi3DoStep"):
        unit.step(0.015)


# Breaks when the library in a unit needs Python, or shows more than the functions of the interface.
def test_library_stands_alone(tmp_path):
    path = tmp_path / "unit.fmu"
    amontons.write_fmu(ball(), path)
    with zipfile.ZipFile(path) as archive:
        (name,) = (n for n in archive.namelist() if n.startswith("binaries/"))
        archive.extract(name, tmp_path)
    library = ctypes.CDLL(str(tmp_path / name))
    library.fmi3GetVersion.restype = ctypes.c_char_p
    assert library.fmi3GetVersion() == b"3.0"
    data = (tmp_path / name).read_bytes()
    assert b"libpython" not in data
    assert b"PyInit_" not in data


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"inputs": ["control.none"]}, "no 'control.none'"),
        ({"outputs": "q.*"}, "outputs: give a list"),
        ({"fmi": "1.0"}, "fmi"),
    ],
)
def test_wrong_input_is_told(tmp_path, given, message):
    with pytest.raises(amontons.InputError, match=message):
        amontons.write_fmu(ball(), tmp_path / "unit.fmu", **given)
    assert not (tmp_path / "unit.fmu").exists()


WATCHED = """<mujoco><worldbody><geom name="floor" type="plane" size="5 5 .1"/>
<body name="base" pos="0 0 .45"><freejoint name="root"/><geom name="hull" type="box" size=".2 .15 .05"/>
<site name="middle" pos=".02 .01 0" euler="10 20 30"/>
<body name="leg" pos=".1 0 0"><joint name="hip" axis="0 1 0" range="-20 20" damping=".1" frictionloss=".05"/>
<geom name="shank" type="capsule" fromto="0 0 -.05 0 0 -.3" size=".03"/>
<site name="foot" type="sphere" size=".08" pos="0 0 -.3"/>
<site name="room" type="box" size=".1 .2 .3"/>
<body name="tail" pos="0 0 -.1"><joint name="ball" type="ball" damping=".1"/><geom size=".04" pos="0 .1 0"/>
</body></body></body>
<body name="ring" pos="1 0 .3"><joint name="swing" axis="0 1 0"/><geom name="bob" size=".05" pos="0 0 -.1"/>
</body></worldbody>
<equality><connect body1="tail" body2="ring" anchor=".3 0 0" active="false"/></equality>
<tendon><fixed name="line" range="-.1 .1" limited="true"><joint joint="hip" coef="1"/>
<joint joint="swing" coef=".5"/></fixed></tendon>
<actuator><position name="push" joint="hip" kp="20" gear="2"/><motor name="pull" tendon="line"/></actuator>
<sensor>{sensors}</sensor></mujoco>"""
AT_SITES = ("accelerometer", "velocimeter", "gyro", "magnetometer", "force", "torque", "touch", "rangefinder")
OF_FRAMES = (
    "framepos", "framequat", "framexaxis", "frameyaxis", "framezaxis", "framelinvel", "frameangvel",
)  # fmt: skip
OF_PARTS = {
    "hip": ("jointpos", "jointvel", "jointactuatorfrc", "jointlimitpos", "jointlimitvel", "jointlimitfrc"),
    "ball": ("ballquat", "ballangvel"),
    "push": ("actuatorpos", "actuatorvel", "actuatorfrc"),
    "line": ("tendonpos", "tendonvel", "tendonactuatorfrc", "tendonlimitpos", "tendonlimitvel",
             "tendonlimitfrc"),
}  # fmt: skip


def watched(folder):
    """A mechanism with a sensor of each kind, those of frames with a reference and without."""
    lines = [f'<{k} name="{k}_{s}" site="{s}"/>' for k in AT_SITES for s in ("middle", "foot")]
    for kind in (*OF_FRAMES, "framelinacc", "frameangacc"):
        lines.append(f'<{kind} name="{kind}" objtype="site" objname="foot"/>')
        if kind in OF_FRAMES:
            seen = 'objtype="site" objname="foot" reftype="body" refname="ring"'
            lines.append(f'<{kind} name="{kind}_seen" {seen}/>')
    for part, kinds in OF_PARTS.items():
        owner = {"hip": "joint", "ball": "joint", "push": "actuator", "line": "tendon"}[part]
        lines += [f'<{kind} name="{kind}" {owner}="{part}"/>' for kind in kinds]
    lines += [f'<{k} name="{k}" body="leg"/>' for k in ("subtreecom", "subtreelinvel", "subtreeangmom")]
    lines += ['<clock name="clock" cutoff=".3"/>']
    lines += ['<insidesite name="insidesite" site="room" objtype="body" objname="tail"/>']
    path = folder / "watched.xml"
    path.write_text(WATCHED.format(sensors="".join(lines)))
    simulation = Simulation(amontons.load_model(path), dt=5e-3)
    simulation.set_control("push", 0.6)
    simulation.set_control("pull", 0.2)
    return simulation


# Breaks when a unit reads a sensor or an effort other than the package: both compute the same formula.
@pytest.mark.filterwarnings("ignore::amontons.ModelWarning", "ignore::amontons.StepWarning")
def test_sensors_and_efforts_are_those_of_the_package(tmp_path):
    pytest.importorskip("mujoco")
    simulation = watched(tmp_path)
    kinds = {sensor.kind for sensor in simulation.model.sensors}
    assert kinds == set(SENSORS)
    path = tmp_path / "unit.fmu"
    amontons.write_fmu(simulation, path, outputs=["sensor.*", "effort.*", "actuator.*", "reaction.*"])
    assert validate_fmu(str(path)) == []
    unit = Unit(path, tmp_path / "unpacked")
    felt = dict.fromkeys(kinds, 0.0)
    for _ in range(50):
        unit.step(2 * simulation.dt)
        simulation.run(2 * simulation.dt)
        readings = simulation.sensors
        for sensor in simulation.model.sensors:
            names = [n for n in unit.references if n == f"sensor.{sensor.name}" or
                     n.startswith(f"sensor.{sensor.name}.")]  # fmt: skip
            ours = readings[sensor.name]
            # Products of a few numbers of both readings: rounding of sums about the origin.
            np.testing.assert_allclose(unit.get(*names), ours, rtol=1e-9, atol=1e-9, err_msg=sensor.name)
            felt[sensor.kind] = max(felt[sensor.kind], float(abs(ours).max()))
        effort = simulation.forces.effort("hip")
        parts = effort.motor, effort.passive, effort.friction, effort.limit
        names = [f"effort.hip.{part}" for part in ("motor", "passive", "friction", "limit")]
        np.testing.assert_array_equal(unit.get(*names), parts)
        np.testing.assert_array_equal(
            unit.get("actuator.push", "actuator.pull"), simulation.forces.actuator_efforts["effort"]
        )
    assert [kind for kind, size in felt.items() if size == 0] == []  # each has read something


# Breaks when a step that misses its tolerance is silent, or a unit that may return early goes on.
def test_missed_steps_warn_and_return_early(tmp_path):
    builder = ModelBuilder()
    builder.add_floor()
    for k in range(6):
        builder.add_body(
            shape=shapes.Box((0.1, 0.1, 0.05)), density=1000, position=(0.02 * k, 0, 0.05 + 0.1 * k)
        )
    hard = Simulation(builder.build(), dt=5e-3, max_iterations=1, method="p-spg-fb", on_failure="ignore")
    path = tmp_path / "unit.fmu"
    amontons.write_fmu(hard, path)
    unit = Unit(path, tmp_path / "unpacked", early=True)
    result = unit.slave.doStep(currentCommunicationPoint=0.0, communicationStepSize=0.05)
    early, last = result[2:]
    assert early
    assert last == pytest.approx(hard.dt)  # after the first step, which missed
    assert "missed its tolerance" in unit.messages[-1]
    assert unit.count("steps.missed") == 1
    other = Unit(path, tmp_path / "other")
    *_, early, last = other.slave.doStep(currentCommunicationPoint=0.0, communicationStepSize=0.05)
    assert not early
    assert last == pytest.approx(0.05)
    assert "missed its tolerance" in other.messages[-1]
    assert other.count("steps.missed") == 10


# Breaks when the library of a wheel goes elsewhere, or a file that is none is taken.
def test_wheels_bring_other_systems(tmp_path):
    wheel = tmp_path / "amontons-9.9.9-cp312-abi3-win_amd64.whl"
    with zipfile.ZipFile(wheel, "w") as archive:
        archive.writestr("amontons/amontons_fmu.dll", b"library of windows")
    arm = tmp_path / "amontons-9.9.9-cp312-abi3-macosx_11_0_arm64.whl"
    with zipfile.ZipFile(arm, "w") as archive:
        archive.writestr("amontons/amontons_fmu.dylib", b"library of macOS")
    path = tmp_path / "unit.fmu"
    arguments = ["fmu", "stack", "-o", str(path), "--wheel", str(wheel), "--wheel", str(arm)]
    result = CliRunner().invoke(cli.app, arguments)
    assert result.exit_code == 0, result.stderr
    with zipfile.ZipFile(path) as archive:
        assert archive.read("binaries/x86_64-windows/unit.dll") == b"library of windows"
        assert archive.read("binaries/aarch64-darwin/unit.dylib") == b"library of macOS"
    with pytest.raises(amontons.InputError, match="FMI 2.0 has no name for aarch64-darwin"):
        amontons.write_fmu(ball(), path, fmi="2.0", wheels=[arm])
    empty = tmp_path / "amontons-1-cp312-abi3-linux_x86_64.whl"
    with zipfile.ZipFile(empty, "w") as archive:
        archive.writestr("amontons/__init__.py", "")
    for wrong in (empty, tmp_path / "gone-linux_x86_64.whl"):
        with pytest.raises(amontons.FileError, match="is no wheel of amontons with a library for units"):
            amontons.write_fmu(ball(), path, wheels=[wrong])


# Breaks when a sensor that a unit cannot read is dropped in silence.
def test_sensors_left_out_are_named(tmp_path):
    pytest.importorskip("mujoco")
    path = tmp_path / "hand.xml"
    path.write_text(
        '<mujoco><worldbody><body name="arm"><joint axis="0 1 0"/><geom size=".1"/><body name="hand" '
        'pos="0 0 -.3"><geom size=".1"/><site name="wrist"/></body></body></worldbody>'
        '<sensor><force name="grip" site="wrist"/></sensor></mujoco>'
    )
    with pytest.warns(amontons.UnsupportedWarning, match="does not read the sensors grip"):
        amontons.write_fmu(Simulation(amontons.load_model(path)), tmp_path / "unit.fmu")
