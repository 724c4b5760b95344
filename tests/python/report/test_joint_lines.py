"""Joints as lines of a picture."""

import amontons
import numpy as np
from amontons import Simulation, scenes
from amontons.report.joint_lines import REACH, joint_lines


def lines_of(simulation, thickness=0.1):
    s = simulation.state
    return joint_lines(simulation.model, s.positions, s.orientations, thickness)


# Breaks when a string is not drawn from the ball to its support: each is as long as the joint says.
def test_strings_lead_to_their_supports():
    simulation = Simulation(scenes.newtons_cradle(raised=2), dt=1e-3)
    start, end, widths, colours = lines_of(simulation)
    assert start.shape == (10, 3)
    assert widths.shape == (10,)
    assert colours.shape == (10, 3)
    lengths = [joint.lower_distance for joint in simulation.model.joints]
    # Both ends are sums of a few numbers below 1 m: 1e-15 each.
    np.testing.assert_allclose(np.linalg.norm(end - start, axis=1), lengths, atol=1e-14)


# Breaks when the pin of a hinge is not along its axis, or the rod does not follow the body as it turns.
def test_pin_and_rod_of_a_hinge():
    simulation = Simulation(scenes.pendulum(angle=40), dt=1e-3)
    simulation.run(0.3)
    start, end, _, _ = lines_of(simulation)
    rod, pin = end[0] - start[0], end[1] - start[1]
    assert abs(np.linalg.norm(rod) - 0.5) < 1e-12  # half the length of the bar
    # The hinge may be off its axis by the joint error of a step, below 1e-6 of the length.
    np.testing.assert_allclose(pin, (0, 2 * REACH * 0.1, 0), atol=1e-6)
    np.testing.assert_allclose(end[0], 0, atol=1e-5)


# Breaks when `render` does not pass the request on: the strings are dark where the ground was white.
def test_render_draws_joints():
    simulation = Simulation(scenes.newtons_cradle(), dt=1e-3)
    view = {"target": (0.2, 0, -0.25), "width": 1.2}
    without, with_joints = (amontons.render(simulation, (120, 90), joints=j, **view) for j in (False, True))
    drawn = (without != with_joints).any(axis=2)
    assert drawn.sum() > 100  # ten strings of some 40 pixels each, at least a quarter of them seen
    assert with_joints[drawn].mean() < without[drawn].mean()
