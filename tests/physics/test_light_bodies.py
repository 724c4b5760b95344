"""Links of a nanogram beside heavy bodies: joints carry the weight of the heavy ones without giving way."""

import amontons
import numpy as np
import pytest
from amontons import Material, ModelBuilder, shapes

LIGHT = [1e-9, 1e-8, 1e-6, 1e-3]
HEAVY = 16.8


def settled(model, dt=2e-3, duration=1.0, on_failure="raise"):
    """The last report of a run, and how far body 0 sank (m)."""
    sim = amontons.Simulation(model, dt=dt, on_failure=on_failure)
    start = sim.state.positions[0, 2]
    for _ in range(round(duration / dt)):
        report = sim.step()
    return report, start - sim.state.positions[0, 2]


def trunk_on_links(mass, links):
    """A trunk fixed on a row of light boxes, the lowest of which stands on the floor."""
    b = ModelBuilder()
    b.add_floor(material=Material(friction=1.0))
    top = 0.1 * links + 0.1
    below = b.add_body("trunk", position=(0, 0, top), shape=shapes.Box((0.2, 0.1, 0.1)), mass=HEAVY)
    for k in range(links):
        link = b.add_body(
            position=(0, 0, top - 0.15 - 0.1 * k), shape=shapes.Box((0.05, 0.05, 0.05)), mass=mass
        )
        b.add_fixed_joint(link, below)
        below = link
    return b.build()


# A row gives way by E x in each step, E = 1e-7 D M^-1 D' r, r = m_light / m_heaviest of the mechanism: the
# sag per second is 1e-7 g h (masses carried / heaviest) = 2e-9 m here. With r = 1 the trunk on 1e-6 kg sinks
# through its own base by 33 mm/s, and with r of the joint's own two bodies two light links in a row do.
@pytest.mark.parametrize("links", [1, 2, 3])
@pytest.mark.parametrize("mass", LIGHT)
def test_light_links_carry_a_trunk(mass, links):
    report, sink = settled(trunk_on_links(mass, links))
    assert report.joint_error < 1e-4
    assert report.penetration < 1e-4
    assert abs(sink) < 1e-4


@pytest.mark.parametrize("mass", LIGHT)
def test_a_light_loop_carries_a_trunk(mass):
    # A closed loop of four light links above the trunk: each of its rows is redundant. At 1e-9 kg one ulp of
    # an impulse moves a link by about the tolerance, and 2 of 500 steps say so.
    b = ModelBuilder()
    trunk = b.add_body(position=(0, 0, 1), shape=shapes.Box((0.2, 0.1, 0.1)), mass=HEAVY)
    links = [
        b.add_body(position=(x, 0, z), shape=shapes.Sphere(0.03), mass=mass)
        for x, z in ((-0.1, 1.2), (0.1, 1.2), (-0.1, 1.4), (0.1, 1.4))
    ]
    b.add_fixed_joint(links[0], trunk)
    b.add_fixed_joint(links[1], trunk)
    b.add_fixed_joint(links[2], links[0])
    b.add_fixed_joint(links[3], links[1])
    b.add_fixed_joint(links[2], links[3])
    b.add_fixed_joint(links[2], None)
    report, sink = settled(b.build(), on_failure="raise" if mass > 1e-9 else "ignore")
    assert report.joint_error < 1e-4
    assert abs(sink) < 1e-4


@pytest.mark.parametrize("mass", LIGHT)
def test_a_heavy_body_hangs_on_a_light_chain(mass):
    # Ball joints, each of which carries the weight: links of equal lightness in a row.
    b = ModelBuilder()
    above = None
    for k in range(5):
        link = b.add_body(position=(0, 0, -0.1 * k - 0.05), shape=shapes.Sphere(0.03), mass=mass)
        b.add_ball_joint(link, above, point=(0, 0, -0.1 * k))
        above = link
    load = b.add_body(position=(0, 0, -0.6), shape=shapes.Sphere(0.1), mass=HEAVY)
    b.add_ball_joint(load, above, point=(0, 0, -0.5))
    sim = amontons.Simulation(b.build(), dt=2e-3, on_failure="raise")
    for _ in range(500):
        report = sim.step()
    assert report.joint_error < 1e-4
    assert np.allclose(sim.state.positions[5], (0, 0, -0.6), atol=1e-4)


# Breaks when a joint that cannot hold comes apart without a word, or the warning names another one.
def test_a_joint_that_stays_apart_is_named():
    b = ModelBuilder(gravity=(0, 0, 0))
    body = b.add_body(position=(0, 0, 0), shape=shapes.Sphere(0.1), mass=1.0)
    b.add_ball_joint(body, None, point=(0.5, 0, 0), name="near")
    other = b.add_body(position=(3, 0, 0), shape=shapes.Sphere(0.1), mass=1.0)
    b.add_distance_joint(body, other, point_a=(0, 0, 0), point_b=(3, 0, 0), name="rod", length=2.0)
    b.add_ball_joint(other, None, point=(3, 0, 0), name="far")
    sim = amontons.Simulation(b.build())
    with pytest.warns(amontons.StepWarning, match=r'joint "(near|rod|far)" is apart by'):
        sim.run(0.5)
