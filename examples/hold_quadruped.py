"""A quadruped rises and holds its pose by PD control of its joints; a push does not throw it over."""

from pathlib import Path

import amontons
import numpy as np

model = amontons.load_model(Path(__file__).parent / "models" / "quadruped.xml")
simulation = amontons.Simulation(model, dt=2e-3)
simulation.reset("stand")
standing = simulation.q
simulation.reset("crouch")
crouching = simulation.q

# Each motor has the name of its joint: where the joints' entries are in q and qd.
joints = [model.coordinates[name] for name in model.actuator_names]
in_q = np.array([joint.q.start for joint in joints])
in_qd = np.array([joint.qd.start for joint in joints])
stiffness, damping = 80.0, 2.0  # N m/rad, N m s/rad


def hold(simulation: amontons.Simulation) -> None:
    """Torques towards a pose that goes from crouching to standing within a second."""
    s = min(simulation.time, 1.0)
    target = (1 - s) * crouching + s * standing
    simulation.controls = stiffness * (target - simulation.q)[in_q] - damping * simulation.qd[in_qd]


simulation.before_step.append(hold)
trunk = model.body_index("trunk")
simulation.run(2.0)
feet = simulation.contacts["force"][:, 2]
print(f"it stands {simulation.q[2]:.3f} m high on {len(feet)} feet")
print(f"which carry {feet.sum():.1f} of {model.total_mass * 9.81:.1f} N")
print(f"largest torque {abs(simulation.controls).max():.1f} N m")
assert abs(simulation.q[2] - standing[2]) < 0.03

simulation.state.forces[trunk] = (0, 60, 0)  # N, at the centre of mass
simulation.run(0.2)
simulation.state.forces[trunk] = 0
tilt: list[np.ndarray] = []
simulation.run(2.0, after_step=lambda sim, report: tilt.append(sim.q[4:6].copy()))
print(
    f"pushed, it rolls by {2 * np.degrees(np.abs(tilt).max()):.1f} degrees and moves {simulation.q[1]:.3f} m"
)
print(f"gyroscope {np.abs(simulation.sensors['gyro']).max():.1e} rad/s at the end")
assert abs(simulation.q[2] - standing[2]) < 0.03
