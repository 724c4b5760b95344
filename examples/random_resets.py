"""Many quadrupeds start from random poses, held by the same controller: which stay on their feet?"""

from pathlib import Path

import amontons
import numpy as np

model = amontons.load_model(Path(__file__).parent / "models" / "quadruped.xml")
rng = np.random.default_rng(seed=7)
worlds, rows, dt = 12, 100, 2e-3

simulation = amontons.Simulation(model, dt=dt)
simulation.reset("stand")
standing = simulation.q
joints = [model.coordinates[name] for name in model.actuators]
in_q = np.array([joint.q.start for joint in joints])
in_qd = np.array([joint.qd.start for joint in joints])

states = []
for _ in range(worlds):
    # A random turn about the vertical, a tilt, a drop, joints off by up to 0.3 rad, and a push.
    q = standing.copy()
    half = rng.uniform((-0.15, -0.15, -np.pi / 2), (0.15, 0.15, np.pi / 2))
    q[2] += rng.uniform(0.02, 0.1)
    q[3:7] = np.array([1, *np.tan(half)]) / np.linalg.norm([1, *np.tan(half)])
    q[in_q] += rng.uniform(-0.3, 0.3, len(in_q))
    velocity = (*rng.uniform(-0.5, 0.5, 2), 0, 0, 0, 0)
    simulation.reset(q=q, qd={"trunk": velocity})
    states.append(simulation.copy())

# One row of controls at a time for all worlds, from what each of them is like.
for row in range(rows):
    q, qd = (np.array([getattr(world, name) for world in states]) for name in ("q", "qd"))
    controls = 80.0 * (standing - q)[:, in_q] - 2.0 * qd[:, in_qd]
    result = amontons.rollout(model, states, controls[:, None], repeat=5)
    states = result.simulations
    if row % 25 == 24:
        heights = result.q[:, -1, 2]
        print(f"t = {states[0].time:.2f} s: heights {heights.min():.3f} to {heights.max():.3f} m")

upright = [world.site("imu")["orientation"] for world in states]
tilts = [2 * np.degrees(np.arcsin(np.hypot(*q[1:3]))) for q in upright]
print(
    f"{sum(tilt < 10 for tilt in tilts)} of {worlds} stand upright, tilted by {max(tilts):.1f} degrees at most"
)
