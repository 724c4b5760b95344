"""An arm draws a circle: inverse kinematics by Jacobians on a copy, then computed torques."""

import numpy as np
from amontons import ModelBuilder, Motor, Simulation, shapes

builder = ModelBuilder()
drive = Motor("effort", max_effort=200.0)  # N m
builder.add_body("shoulder", shape=shapes.Cylinder(0.08, 0.1), mass=4, position=(0, 0, 0.1))
builder.add_body("upper", shape=shapes.Capsule(0.04, 0.15), mass=3, position=(0, 0, 0.4))
builder.add_body("lower", shape=shapes.Capsule(0.03, 0.15), mass=2, position=(0, 0, 0.75))
builder.add_revolute_joint("shoulder", axis=(0, 0, 1), point=(0, 0, 0), name="turn", motor=drive)
builder.add_revolute_joint("upper", "shoulder", axis=(0, 1, 0), point=(0, 0, 0.22), name="lift", motor=drive)
builder.add_revolute_joint("lower", "upper", axis=(0, 1, 0), point=(0, 0, 0.58), name="bend", motor=drive)
builder.add_site("lower", position=(0, 0, 0.2), name="tip")
model = builder.build()
simulation = Simulation(model, dt=2e-3)
simulation.set_q({"lift": 0.4, "bend": 1.2})
duration, dt = 4.0, simulation.dt
times = np.arange(0, duration + 3 * dt, dt)

# Where the tip shall be: once round a circle, slowly at both ends.
phase = 2 * np.pi * (times / duration - np.sin(2 * np.pi * times / duration) / (2 * np.pi))
start = simulation.kinematics.site("tip")["position"]
circle = start + 0.15 * np.stack([np.cos(phase) - 1, np.sin(phase), 0 * phase], axis=1)

# Joint angles for it: Newton's method, in a simulation that never steps.
thinking, postures = simulation.copy(), []
for point in circle:
    for _ in range(4):
        error = point - thinking.kinematics.site("tip")["position"]
        thinking.q = thinking.q + np.linalg.solve(thinking.kinematics.site_jacobian("tip")[:3], error)
    postures.append(thinking.q)
path = np.array(postures)
speeds = np.gradient(path, dt, axis=0)
accelerations = np.gradient(speeds, dt, axis=0)


def track(simulation: Simulation) -> None:
    """tau = M (qdd + kp e + kd e') + c: the errors die out like those of a damped spring."""
    k = min(simulation.steps, len(path) - 1)
    error, rate = path[k] - simulation.q, speeds[k] - simulation.qd
    simulation.controls = simulation.forces.inverse_dynamics(accelerations[k] + 400 * error + 40 * rate)


errors, torques = [], []
simulation.before_step.append(track)
while simulation.time < duration:
    simulation.step()
    errors.append(np.linalg.norm(simulation.kinematics.site("tip")["position"] - circle[simulation.steps]))
    torques.append(np.abs(simulation.forces.joint_efforts["motor"]).max())
print(
    f"the tip stays within {1e3 * max(errors):.2f} mm of the circle, and ends {1e3 * errors[-1]:.2f} mm off"
)
print(f"largest torque {max(torques):.1f} N m")
assert max(errors) < 2e-3
