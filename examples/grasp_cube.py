"""A gripper takes a cube from a table, lifts it, holds it, and puts it back."""

from pathlib import Path

import amontons
import numpy as np

model = amontons.load_model(Path(__file__).parent / "models" / "gripper.xml")
simulation = amontons.Simulation(model, dt=2e-3)
turned = 0.2  # rad, about the vertical
simulation.reset("open", q={"cube": (0.002, 0.004, 0.025, np.cos(turned / 2), 0, 0, np.sin(turned / 2))})
open_width, closed = 0.05, 0.0  # m, of each finger


def move(lift: float, fingers: float, seconds: float) -> None:
    """Glide from the present controls to others, so that nothing is thrown."""
    start, first = simulation.controls, simulation.time

    def glide(sim: amontons.Simulation) -> None:
        s = min(1.0, (sim.time - first) / (0.7 * seconds))
        sim.controls = (1 - s) * start + s * np.array([lift, fingers, fingers])

    simulation.before_step[:] = [glide]
    simulation.run(seconds)


def cube() -> np.ndarray:
    """Its position and rotation in the world."""
    return simulation.q[model.coordinates["cube"].q]


move(-0.21, open_width, 1.0)
move(-0.21, closed, 0.5)
grip = simulation.sensors["left"][0], simulation.sensors["right"][0]
print(f"the fingers press with {grip[0]:.2f} and {grip[1]:.2f} N")

held = simulation.sensors["cube"].copy()  # in the axes of the left finger
move(0.05, closed, 1.0)
lifted = cube()[2]
simulation.run(1.0)
slip = np.linalg.norm(simulation.sensors["cube"] - held)
print(f"lifted to {lifted:.3f} m, it slips by {1e6 * slip:.2f} um in two seconds")
assert lifted > 0.25
assert slip < 1e-4

move(-0.21, closed, 1.0)
move(-0.21, open_width, 0.5)
move(0.0, open_width, 0.5)
print(f"back on the table at {np.round(cube()[:3], 3)} m")
assert abs(cube()[2] - 0.025) < 1e-4
seen = simulation.kinematics.ray((*cube()[:2], 0.2), (0, 0, -1))  # past the open fingers
assert model.geom_names[seen.geom] == "cube"
