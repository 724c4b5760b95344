"""A nut turns down a bolt by its own weight: threads are convex pieces, ten degrees of a turn each."""

import math

import numpy as np
from amontons import Material, ModelBuilder, Simulation, shapes

core, depth, pitch = 0.02, 0.006, 0.024  # m: radius of the bolt without its thread, thread, lead
play = 0.0003  # m between the flanks
steps = 36  # pieces of a turn


def thread(foot: float, crest: float, low: float, high: float, turns: int) -> list[shapes.Hull]:
    """Pieces whose section is a trapezoid: from `low` to `high` at its foot, half as wide at its crest."""
    pieces = []
    for k in range(turns * steps):
        corners = []
        for angle in (2 * math.pi * k / steps, 2 * math.pi * (k + 1) / steps):
            middle, half = pitch * angle / (2 * math.pi) + (low + high) / 2, (high - low) / 2
            for r, part in ((foot, half), (crest, half / 2)):
                corners += [(r * math.cos(angle), r * math.sin(angle), middle + s * part) for s in (-1, 1)]
        pieces.append(shapes.Hull(np.array(corners)))
    return pieces


builder = ModelBuilder()
oiled = Material(friction=0.0)
builder.add_geom(None, shapes.Cylinder(core, 0.09), position=(0, 0, 0.08), category=0, mask=0)
for piece in thread(core, core + depth, 0.0, pitch / 2, 7):
    builder.add_geom(None, piece, material=oiled)
nut = builder.add_body("nut", position=(0, 0, 4 * pitch))
for piece in thread(core + depth + 0.004, core + 0.001, pitch * 5 / 8 + play, pitch * 9 / 8 - play, 2):
    builder.add_geom(nut, piece, density=7800, material=oiled)
simulation = Simulation(builder.build(), dt=1e-3)


def place() -> tuple[float, float]:
    """Height (m) and angle (rad) of the nut."""
    w, _, _, z = simulation.state.orientations[nut]
    return simulation.state.positions[nut, 2], 2 * math.atan2(z, w)


simulation.run(0.1)  # it comes to lie on the thread
(height, angle), speed = place(), simulation.state.linear_velocities[nut, 2]
simulation.run(0.3)
fallen, turned = height - place()[0], angle - place()[1]
lead = fallen / turned * 2 * math.pi
body = simulation.model.bodies[nut]
# z = p / (2 pi) angle, so that the inertia of the turn resists the fall. Pieces are flat, the thread is not:
# the nut bumps over their edges and loses some of its energy there.
fastest = 9.81 / (1 + body.inertia[2][2] / body.mass * (2 * math.pi / pitch) ** 2)
found = 2 * (fallen + speed * 0.3) / 0.3**2
print(
    f"it falls by {1e3 * fallen:.2f} mm in {math.degrees(turned):.1f} degrees, {1e3 * lead:.2f} mm per turn"
)
print(f"with {found:.4f} m/s^2; a smooth thread without friction allows {fastest:.4f} m/s^2")
assert abs(lead - pitch) < 0.005 * pitch
assert 0.6 * fastest < found < fastest
