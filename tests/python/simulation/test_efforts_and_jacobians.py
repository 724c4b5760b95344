"""Arrays for all joints and links at once beside single values by name."""

import amontons
import numpy as np
import pytest
from amontons.shapes import Box, Capsule

ROUNDING = 1e-12


def swinging() -> amontons.Simulation:
    """Three links on a driven hinge, a sprung hinge with a limit and a slide; a site and a box on a floor."""
    builder = amontons.ModelBuilder()
    builder.add_floor(height=-1.0)
    above = None
    for k in range(3):
        body = builder.add_body(
            f"link {k}", shape=Capsule(0.03, 0.1), mass=1.0 + k, position=(0.3 * k + 0.15, 0, 0)
        )
        point = (0.3 * k, 0.0, 0.0)
        if k == 0:
            motor = amontons.Motor("position", kp=50.0, kd=5.0)
            builder.add_revolute_joint(body, above, point=point, axis=(0, 1, 0), motor=motor, name="driven")
        elif k == 1:
            options = dict(stiffness=3.0, damping=0.1, limits=(-1e-3, 1e-3), friction=0.2)
            builder.add_revolute_joint(body, above, point=point, axis=(0, 1, 0), name="sprung", **options)
        else:
            builder.add_prismatic_joint(body, above, axis=(1, 0, 0), name="slide", stiffness=200.0)
        above = body
    builder.add_site(above, position=(0.1, 0.02, 0.03), name="tip")
    builder.add_body("box", shape=Box((0.1, 0.1, 0.1)), mass=1.0, position=(0, 1, -0.9))
    return amontons.Simulation(builder.build(), dt=2e-3)


def test_efforts_are_the_sums_of_each_joint():
    """Fails if a part is left out of the sum, or the order is another one than that of joint_efforts."""
    sim = swinging()
    np.testing.assert_array_equal(sim.forces.efforts(), np.zeros(sim.model.dofs))
    with pytest.raises(amontons.InputError, match="call step"):
        sim.forces.effort("driven")
    sim.set_control("driven", 0.4)
    for _ in range(100):
        sim.step()
    names = ("driven", "sprung", "slide")
    by_name = [sim.forces.effort(name) for name in names]
    np.testing.assert_allclose(sim.forces.efforts(), [e.total for e in by_name], rtol=ROUNDING)
    assert all(e.time == sim.forces.instant.time for e in by_name)
    table = sim.forces.joint_efforts
    assert table["joint"].tolist() == [0, 1, 2]
    assert table["dof"].tolist() == [0, 0, 0]
    assert table["control"][0] == 0.4
    assert np.isnan(table["control"][1:]).all()
    assert abs(by_name[0].motor) > 0.1
    assert by_name[1].friction != 0
    assert by_name[2].passive != 0
    assert by_name[1].limit != 0  # the spring alone does not carry the links


def test_jacobians_of_all_links_move_them():
    """Fails if the frame of a link, the order of links or the rows of a point are confused."""
    sim = swinging()
    sim.qd = np.linspace(-1, 1, sim.model.nv)
    for _ in range(20):
        sim.step()
    jacobians, links = sim.kinematics.jacobians(), sim.kinematics.links
    assert jacobians.shape == (len(sim.model.link_names), 6, sim.model.nv)
    for jacobian, row, name in zip(jacobians, links, sim.model.link_names, strict=True):
        np.testing.assert_allclose(jacobian, sim.kinematics.jacobian(name), rtol=0, atol=ROUNDING)
        velocity = np.concatenate([row["linear_velocity"], row["angular_velocity"]])
        np.testing.assert_allclose(jacobian @ sim.qd, velocity, rtol=0, atol=ROUNDING)
        assert sim.kinematics.link(name) == row
    assert sim.kinematics.site("tip") == sim.kinematics.sites[0]
    tip = np.concatenate(
        [sim.kinematics.sites["linear_velocity"][0], sim.kinematics.sites["angular_velocity"][0]]
    )
    np.testing.assert_allclose(sim.kinematics.site_jacobian("tip") @ sim.qd, tip, rtol=0, atol=ROUNDING)


def test_tables_without_rows_have_their_fields():
    """Fails if bytes of no rows cannot be seen as a structured array."""
    sim = amontons.Simulation(swinging().model)
    for table in (sim.contacts, sim.forces.tendon_efforts, sim.forces.actuator_efforts):
        assert table.shape == (0,)
        assert table.dtype.names
    alone = amontons.ModelBuilder()
    alone.add_body(shape=Box((1, 1, 1)), mass=1.0)
    sim = amontons.Simulation(alone.build())
    assert sim.forces.joint_efforts.shape == (0,)
    assert sim.forces.efforts().shape == (0,)
    assert sim.kinematics.sites.shape == (0,)
    assert sim.kinematics.jacobians().shape == (1, 6, 6)


def test_contacts_are_foreseen_without_efforts():
    """A motor presses a light link that a heavy body holds; the floor below is out of reach.

    Fails if the effort is given to the link alone: it would move at 2000 m/s, and its contact gets rows.
    """
    builder = amontons.ModelBuilder(gravity=(0, 0, 0))
    builder.add_floor()
    light = builder.add_body(shape=Box((0.05, 0.05, 0.05)), mass=1e-3, position=(0, 0, 0.2))
    heavy = builder.add_body(shape=Box((0.2, 0.2, 0.2)), mass=1e3, position=(0, 0, 0.6))
    motor = amontons.Motor("effort", control=-1e3)
    builder.add_prismatic_joint(light, axis=(0, 0, 1), motor=motor)
    builder.add_fixed_joint(light, heavy)
    sim = amontons.Simulation(builder.build(), dt=2e-3)
    report = sim.step()
    assert report.contacts == 0
    speed = sim.state.linear_velocities[heavy][2]
    assert speed == pytest.approx(-1e3 * 2e-3 / (1e3 + 1e-3), rel=1e-6)  # m/s: the effort moves both
