"""Rocking blocks against the equation of Housner (1963), and ground motions of files."""

import math

import amontons
import numpy as np
import pytest
from amontons import FileError, InputError
from amontons.studies import GroundMotion, pulse, read_ground_motion, shake
from blocks import column
from scipy.integrate import solve_ivp

BREADTH, HEIGHT = 0.2, 1.0
SLENDER = math.atan2(BREADTH, HEIGHT)
RADIUS = math.hypot(BREADTH, HEIGHT) / 2
P2 = 3 * 9.81 / (4 * RADIUS)
"""p^2 of Housner: m g R over the moment of inertia 4/3 m R^2 about a corner"""


def rocks(start, push, until):
    """Angles of a block on its corner, theta'' = -p^2 (sin(alpha - theta) - a / g cos(alpha - theta))."""

    def rate(t, y):
        a = push(t) / 9.81
        return y[1], -P2 * (math.sin(SLENDER - y[0]) - a * math.cos(SLENDER - y[0]))

    def falls_back(t, y):
        return y[0] if t > 1e-3 else 1.0

    def falls_over(t, y):
        return math.pi / 2 - y[0]

    falls_back.terminal = falls_over.terminal = True
    return solve_ivp(
        rate, (0, until), (start, 0.0), events=(falls_back, falls_over), rtol=1e-9, max_step=1e-3
    )


# A block released at half of its critical angle is back after the time of Housner's equation.
# Breaks if the inertia, the pivot or the order of the step is wrong.
def test_a_released_block_rocks_back():
    angle, dt = SLENDER / 2, 1e-3
    exact = rocks(angle, lambda t: 0.0, 5.0).t_events[0][0]
    builder = amontons.ModelBuilder()
    material = amontons.Material(friction=1.0)
    builder.add_floor(material=material)
    place = (RADIUS * math.sin(SLENDER - angle), 0, RADIUS * math.cos(SLENDER - angle))
    half = amontons.shapes.Box((BREADTH / 2, 0.3, HEIGHT / 2))
    turn = amontons.axis_angle((0, 1, 0), -angle)
    builder.add_body(
        "block",
        shape=half,
        density=2400,
        position=(-place[0], 0, place[2]),
        orientation=turn,
        material=material,
    )
    simulation = amontons.Simulation(builder.build(), dt=dt)
    while 2 * math.asin(abs(simulation.state.orientations[0, 2])) > 1e-3 and simulation.time < 2 * exact:
        simulation.step()
    assert simulation.time == pytest.approx(exact, abs=0.02 * exact)


# A rectangular pulse of 0.3 s overturns the block from the amplitude on that Housner's equation gives.
# Breaks if the supports move wrongly, or if the pulse is lost between steps.
def test_a_pulse_overturns_from_its_amplitude_on():
    duration = 0.3

    def overturns(amplitude):
        return bool(len(rocks(0.0, lambda t: amplitude if t < duration else 0.0, 6.0).t_events[1]))

    low, high = 9.81 * BREADTH / HEIGHT, 30.0
    assert overturns(high)
    while high - low > 1e-2:
        middle = (low + high) / 2
        low, high = (low, middle) if overturns(middle) else (middle, high)
    blocks = column(BREADTH, HEIGHT, mu=2.0)
    for factor, fallen in ((0.9, ()), (1.1, ("block",))):
        found = shake(blocks, pulse((-factor * high, 0, 0), duration), dt=2e-3, after=3.0)
        assert found.fallen == fallen, (factor, high)


# A record of a file moves the supports as its double integral; the exact one of a sine.
def test_a_record_is_integrated(tmp_path):
    t = np.linspace(0, 2, 401)
    path = tmp_path / "record.csv"
    path.write_text("time,ax,ay\n" + "\n".join(f"{x},{math.sin(3 * x) / 9.80665},0.1" for x in t))
    motion = read_ground_motion(path, unit="g")
    found = motion.displacement(np.array([0.0, 1.0, 2.0]))
    exact = [x / 3 - math.sin(3 * x) / 9 for x in (0.0, 1.0, 2.0)]
    assert found[:, 0] == pytest.approx(exact, abs=2e-5)
    assert found[:, 1] == pytest.approx([0, 0.1 * 9.80665 / 2, 0.1 * 9.80665 * 2], rel=1e-9)
    path.write_text("0,1\n1,x\n")
    with pytest.raises(FileError, match="line 2"):
        read_ground_motion(path)
    path.write_text("0,1\n")
    with pytest.raises(FileError, match="two or more"):
        read_ground_motion(path)
    with pytest.raises(InputError, match="increasing"):
        GroundMotion([0, 0], np.zeros((2, 3)))
