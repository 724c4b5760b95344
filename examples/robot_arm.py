"""A robot arm from an MJCF file pushes a box over the floor: keyframes, actuators, contact forces."""

from pathlib import Path

import amontons
import numpy as np

model = amontons.load_model(Path(__file__).parent / "models" / "arm.xml")  # pip install amontons[models]
print(model, "\nactuators:", ", ".join(model.actuators))

simulation = amontons.Simulation(model, dt=2e-3)
simulation.apply_keyframe("bent")
arm = {model.body_index(name) for name in ("upper_arm", "forearm", "hand")}
box = model.body_index("box")
start = simulation.state.positions[box].copy()
push = 0.0


def watch(sim: amontons.Simulation, report: amontons.Report) -> None:
    """The largest force that the arm exerts on the box."""
    global push
    for c in sim.contacts:
        if {int(c["body_a"]), int(c["body_b"])} in [{a, box} for a in arm]:
            push = max(push, float(np.linalg.norm(c["force"])))


for name, controls in (
    ("reach down", {"shoulder": 1.3, "elbow": -0.3}),
    ("stretch", {"shoulder": 0.9, "elbow": 0.0}),
    ("draw back", {"shoulder": 0.2, "elbow": -1.0}),
):
    for actuator, control in controls.items():
        simulation.set_control(actuator, control)
    report = simulation.run(1.5, watch)
    angles = {j: round(simulation.coordinate(j), 3) for j in ("shoulder", "elbow")}
    print(f"t = {report.time:.1f} s, {name}: angles {angles} rad, residual {report.residual:.1e}")

way = simulation.state.positions[box] - start
print(f"the box moved by {1e3 * way[0]:.0f} mm; the arm pushed with up to {push:.1f} N")
print("efforts (N m):", {e["joint"]: round(float(e["motor"]), 3) for e in simulation.joint_efforts})
