"""A granular researcher: grains fill a flat hopper, a gate opens, they run out; pictures and a table."""

import tempfile
from pathlib import Path

import amontons
import numpy as np
from amontons import Material, ModelBuilder, Simulation, shapes
from PIL import Image

OUTLET, HEIGHT, SLOPE, LONG = 0.075, 0.07, np.radians(55), 0.11  # m, m, rad, half a slope (m)
folder = Path(tempfile.mkdtemp())
rng = np.random.default_rng(1)
glass = Material(friction=0.5)
builder = ModelBuilder()
builder.add_floor(material=Material(friction=0.8))
for side in (-1, 1):  # two slopes, and panes of glass 50 mm apart
    middle = (side * (OUTLET / 2 + LONG * np.cos(SLOPE)), 0, HEIGHT + LONG * np.sin(SLOPE))
    turn = (np.cos(SLOPE / 2), 0, -side * np.sin(SLOPE / 2), 0)  # about y
    slope = shapes.Box((LONG, 0.025, 0.002))
    builder.add_geom(None, slope, material=glass, position=middle, orientation=turn)
    inwards = (np.sqrt(0.5), side * np.sqrt(0.5), 0, 0)  # about x: the normal of a plane is its z axis
    builder.add_geom(None, shapes.Plane(), position=(0, 0.025 * side, 0), orientation=inwards)
plate = shapes.Box((0.05, 0.02, 0.002))
gate = builder.add_body("gate", motion="kinematic", shape=plate, position=(0, 0, HEIGHT - 0.006))
grains = []  # 15 to 20 mm thick
for row in range(11):
    for x in np.arange(-0.068, 0.07, 0.045):
        for y in (-0.0125, 0.0125):
            place = (x + rng.normal(0, 1e-3), y, 0.22 + 0.04 * row)
            grain = shapes.Sphere(rng.uniform(0.0075, 0.01))
            grains.append(builder.add_body(shape=grain, density=2500, material=glass, position=place))
simulation = Simulation(builder.build(), dt=4e-3, tolerance=1e-3)

simulation.run(0.8)  # they settle
view = dict(azimuth=-90, elevation=0, target=(0, 0, 0.16), width=0.5)
Image.fromarray(amontons.render(simulation, (600, 400), forces=True, **view)).save(folder / "full.png")
contacts = simulation.contacts
forces = np.linalg.norm(contacts["force"][contacts["state"] != "open"], axis=1)
print(
    f"{len(grains)} grains, {len(forces)} contacts, largest force {forces.max() / forces.mean():.1f} x mean"
)

simulation.state.linear_velocities[gate] = (2.0, 0, 0)  # m/s
rows = []
for _ in range(300):
    report = simulation.step()
    below = np.count_nonzero(simulation.state.positions[grains, 2] < HEIGHT)
    began = len(simulation.contact_events.began)
    rows.append((simulation.time, below, report.contacts, began, report.kinetic_energy))
table = np.array(rows)
header = "time,below,contacts,began,kinetic_energy"
np.savetxt(folder / "discharge.csv", table, delimiter=",", header=header, comments="", fmt="%.6g")
Image.fromarray(amontons.render(simulation, (600, 400), **view)).save(folder / "empty.png")
first, last = np.interp((0.2 * len(grains), 0.7 * len(grains)), table[:, 1], table[:, 0])
print(f"{0.5 * len(grains) / (last - first):.0f} grains/s; {int(table[-1, 1])} ran out")
print("full.png, empty.png, discharge.csv in", folder)
