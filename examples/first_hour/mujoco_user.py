"""The first hour of a MuJoCo user: an MJCF arm by qpos, ctrl and qfrc_applied, and many of it at once."""

from pathlib import Path

import amontons
import numpy as np

MODELS = Path(__file__).parent.parent / "models"

model = amontons.load_model(MODELS / "arm.xml")  # mujoco.MjModel.from_xml_path
data = amontons.Simulation(model, dt=2e-3)  # mujoco.MjData; the time step belongs to it
print("nq", model.nq, "nv", model.nv, "controls", ", ".join(model.control_names))

# mj_resetDataKeyframe: keyframes, bodies, joints, controls have names and numbers.
data.reset("bent")
print("qpos", data.q.round(3), "ctrl", data.controls.round(3))

# A loop as of mj_step: ctrl before the step, sensors and contacts after it.
while data.time < 1.0:
    data.set_control("elbow", -0.4 - 0.3 * np.sin(2 * np.pi * data.time))
    data.step()
hand = data.kinematics.link("hand")["position"]
elbow = data.forces.effort("elbow").motor
print(f"hand at {hand.round(3)} m, {len(data.contacts)} contacts, elbow {elbow:.2f} N m")

# The same with a function that is called before each step, and one that is called after it.
angles = []
data.reset("bent")
data.run(
    1.0,
    before_step=lambda d: d.set_control("elbow", -0.4 - 0.3 * np.sin(2 * np.pi * d.time)),
    after_step=lambda d, report: angles.append(d.kinematics.coordinate("elbow")),
)
assert np.allclose(data.kinematics.link("hand")["position"], hand)


def carry(d: amontons.Simulation) -> None:
    """qfrc_applied = qfrc_bias of the arm, which unloads its servos; what floats keeps its weight."""
    d.state.joint_forces[:2] = d.forces.bias_forces()[:2]


data.reset("bent")
data.run(2.0)
loaded = data.forces.effort("shoulder").motor
data.run(2.0, before_step=carry)
unloaded = data.forces.effort("shoulder").motor
print(f"shoulder servo: {loaded:.3f} N m, {unloaded:.3f} N m with its weight carried")
assert abs(unloaded) < 0.05 * abs(loaded)

# mujoco.rollout: 16 worlds from one state, each with its own row of controls, on all cores.
data.state.joint_forces = 0
random = np.random.default_rng(seed=0)
controls = random.uniform((0.0, -1.0), (1.0, 0.0), (16, 20, 2))
worlds = amontons.rollout(model, [data] * 16, controls, repeat=10)
ends = worlds.q[:, -1, 0]  # of the shoulder
print(f"after 0.4 s the shoulders are at {ends.min():.3f} to {ends.max():.3f} rad")
