"""Sensors of a model beside those of MuJoCo."""

import math

import amontons
import numpy as np
from amontons import Simulation


def compare_sensors(mujoco, monkeypatch, path, seed):
    """Both in one state with one acceleration, without contacts and limits, which MuJoCo makes otherwise."""
    model, m = amontons.load_model(path), mujoco.MjModel.from_xml_path(str(path))
    m.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
    d = mujoco.MjData(m)
    rng = np.random.default_rng(seed)
    sim = Simulation(model)
    d.qpos[:] = m.qpos0
    mujoco.mj_integratePos(m, d.qpos, 0.5 * rng.normal(size=m.nv), 1.0)
    d.qvel[:] = rng.normal(size=m.nv)
    sim.q, sim.qd = d.qpos, d.qvel
    d.qpos[:], d.qvel[:] = sim.q, sim.qd  # with loops closed
    mujoco.mj_forward(m, d)
    d.qacc[:] = rng.normal(size=m.nv)
    qdd = d.qacc.copy()
    mujoco.mj_rnePostConstraint(m, d)
    for stage in (mujoco.mj_sensorPos, mujoco.mj_sensorVel, mujoco.mj_sensorAcc):
        stage(m, d)

    monkeypatch.setattr(Simulation, "qdd", property(lambda self: qdd))
    readings, compared = sim.sensors, set()
    for i in range(m.nsensor):
        name = m.sensor(i).name or f"sensor_{i}"
        if name not in readings:
            continue
        kind = next(s.kind for s in model.sensors if s.name == name)
        reference = d.sensordata[m.sensor_adr[i] :][: m.sensor_dim[i]]
        value = readings[name]
        if kind.endswith("quat"):  # q and -q are one rotation
            value = value * math.copysign(1, value @ reference)
        if kind == "rangefinder" and reference[0] < 0 < value[0]:
            continue  # MuJoCo's planes end where they are drawn
        scale = max(1.0, np.abs(reference).max())
        np.testing.assert_allclose(value, reference, atol=1e-10 * scale, err_msg=f"{name}: {kind}")
        compared.add(kind)
    np.testing.assert_allclose(sim.kinematics.sites["position"], d.site_xpos, atol=1e-12)
    return model, compared
