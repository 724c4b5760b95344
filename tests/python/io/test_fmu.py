"""Functional mock-up units, validated and run by FMPy: what comes out are the bits of `Simulation.run`."""

import ctypes
import zipfile

import amontons
import numpy as np
import pytest
from amontons import ModelBuilder, Simulation, scenes, shapes

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

    def __init__(self, path, folder, start=0.0):
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
        self.slave.instantiate()
        if self.three:
            self.slave.enterInitializationMode(startTime=start)
        else:
            self.slave.setupExperiment(startTime=start)
            self.slave.enterInitializationMode()
        self.slave.exitInitializationMode()
        self.time = start

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


# Breaks when a sensor that a unit cannot read is dropped in silence, or one that it reads is named.
def test_sensors_left_out_are_named(tmp_path):
    path = tmp_path / "robot.xml"
    sensor = '<sensor><accelerometer name="shake" site="foot0"/>'
    leg = LEG.format(k=0, x=0, y=0)
    path.write_text(ARM.format(legs=leg, motors=MOTOR.format(k=0)).replace("<sensor>", sensor))
    simulation = Simulation(amontons.load_model(path))
    with pytest.warns(amontons.UnsupportedWarning, match="the sensors shake; docs/fmu.md"):
        amontons.write_fmu(simulation, tmp_path / "unit.fmu")
