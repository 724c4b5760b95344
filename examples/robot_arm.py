"""A robot arm from an MJCF file pushes a box over the floor: keyframe, actuators, a controller, forces."""

from pathlib import Path

import amontons
import numpy as np

model = amontons.load_model(Path(__file__).parent / "models" / "arm.xml")  # pip install amontons[models]
print(model, "actuators:", ", ".join(model.actuator_names))

simulation = amontons.Simulation(model, dt=2e-3)
simulation.apply_keyframe("bent")
box, hand = model.link_index("box"), model.link_index("hand")
simulation.state.positions[box, 0] = 0.3  # m; the arrays of the state may be written

times = [0.0, 1.0, 2.0, 3.0, 5.0, 6.0]  # s
shoulder = [0.5, 1.2, 2.0, 2.0, 1.2, 0.4]  # rad
elbow = [-1.2, -2.5, -2.5, -1.55, -0.7, -1.2]


def control(sim: amontons.Simulation) -> None:
    """Called before each step; controls are in the units of the file."""
    sim.set_control("shoulder", np.interp(sim.time, times, shoulder))
    sim.set_control("elbow", np.interp(sim.time, times, elbow))


def watch(sim: amontons.Simulation, report: amontons.Report) -> None:
    """Adds up the force of the hand on the box."""
    forces = [c["force"] for c in sim.contacts if {int(c["link_a"]), int(c["link_b"])} == {hand, box}]
    pushes.append(abs(sum(forces)[0]) if forces else 0.0)
    if sim.steps % 500 == 0:
        s, e, x = (
            sim.kinematics.coordinate("shoulder"),
            sim.kinematics.coordinate("elbow"),
            sim.state.positions[box, 0],
        )
        print(f"{sim.time:.0f} s: shoulder at {s:5.2f}, elbow at {e:5.2f} rad, box at {x:.3f} m")


pushes: list[float] = []
simulation.before_step.append(control)
simulation.run(6.0, after_step=watch)
print(f"the hand pushed with {np.median([p for p in pushes if p]):.2f} N (median)")
for drive in simulation.forces.actuator_efforts:
    name, angle = model.actuator_names[drive["actuator"]], drive["length"]
    print(f"{name} holds {angle:.3f} of {drive['control']:.3f} rad with {drive['effort']:.2f} N m")
