"""Which contacts began and ended in a step."""

import pickle

import amontons
import pytest
from amontons import Material, ModelBuilder, Simulation, shapes


# Breaks when an event is missed, told twice or late, or names another pair: a ball that falls 0.5 m onto the
# floor and bounces touches it in one step at a time. Falls of 0.5 m, 0.125 m, ... end where the speed of
# 3.13 m/s / 2^n is below the threshold of bounces, 4 g dt = 0.08 m/s, at n = 6: then it stays.
def test_bouncing_ball():
    builder = ModelBuilder()
    rubber = Material(restitution=0.5)
    builder.add_geom(None, shapes.Plane(), material=rubber, name="floor")
    builder.add_body("ball", shape=shapes.Sphere(0.1), density=1000, material=rubber, position=(0, 0, 0.6))
    sim = Simulation(builder.build(), dt=2e-3)
    assert len(sim.contact_events.began) == len(sim.contact_events.ended) == 0
    began, ended, touching = [], [], False
    for _ in range(1000):
        sim.step()
        events = sim.contact_events
        assert len(events.began) + len(events.ended) <= 1
        force = sim.forces.contact_forces()[0][0, 2]
        for event in events.began:
            assert not touching
            assert force > 0
            assert {int(event["body_a"]), int(event["body_b"])} == {0, -1}
            assert {sim.model.geom_names[event[side]] for side in ("geom_a", "geom_b")} == {"floor", "geom1"}
            assert {int(event["link_a"]), int(event["link_b"])} == {0, -1}
            touching = True
            began.append(sim.time)
        for _ in events.ended:
            assert touching
            assert force == 0
            touching = False
            ended.append(sim.time)
    # sqrt(2 h / g) = 0.3193 s; the step that ends after it is the first that touches.
    assert began[0] == pytest.approx(0.3193, abs=2 * sim.dt)
    assert touching
    assert len(began) == len(ended) + 1 >= 5
    assert ended[-1] < 1.9


# Breaks when a copy goes on with other events than its original, or a restart tells those of before it.
def test_events_of_copies():
    builder = ModelBuilder()
    builder.add_geom(None, shapes.Plane())
    builder.add_body("box", shape=shapes.Box((0.1, 0.1, 0.1)), mass=1, position=(0, 0, 0.1))
    sim = Simulation(builder.build())
    sim.step()
    assert len(sim.contact_events.began) == 1  # of four points of one pair
    sim.step()
    assert len(sim.contact_events.began) == 0
    copied, unpickled = sim.copy(), pickle.loads(pickle.dumps(sim))
    for world, count in ((copied, 0), (unpickled, 1)):
        world.step()
        assert len(world.contact_events.began) == count
        assert len(world.contact_events.ended) == 0
    sim.reset()
    sim.step()
    assert len(sim.contact_events.began) == 1
    assert isinstance(sim.contact_events, tuple)
    assert amontons.Simulation.contact_events.__doc__
