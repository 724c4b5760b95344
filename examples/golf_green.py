"""Balls roll over greens of different speed: golfers measure how far a ball of 1.83 m/s goes."""

from amontons import Material, ModelBuilder, Simulation, shapes

radius, speed, g = 0.0213, 1.83, 9.81  # m, m/s, m/s^2: ball and ramp of a stimpmeter
greens = {"slow": 1.9e-3, "medium": 1.5e-3, "fast": 1.1e-3}  # rolling friction (m)

builder = ModelBuilder()
builder.add_geom(None, shapes.Plane(), material=Material(friction=0.5))
for i, (name, rolling) in enumerate(greens.items()):
    builder.add_body(
        name,
        shape=shapes.Sphere(radius),
        mass=0.0459,
        position=(0, 0.2 * i, radius),
        linear_velocity=(speed, 0, 0),
        angular_velocity=(0, speed / radius, 0),
        material=Material(friction=0.5, rolling_friction=rolling),
    )
simulation = Simulation(builder.build(), dt=2e-3)
simulation.run(0.5)

print("moments at the contacts, of mu_r N:")
for c in simulation.contacts:
    name = simulation.model.body_names[c["body_a"]]
    print(f"{name:8} {c['torque'][1]:.3e} of {greens[name] * c['force'][2]:.3e} N m, {c['state']}")

report = simulation.run(7.0)
print(f"\nafter {simulation.time:.1f} s the balls lie still, kinetic energy {report.kinetic_energy:.0e} J")
for (name, rolling), x in zip(greens.items(), simulation.state.positions[:, 0], strict=True):
    # m v' = -F and 2/5 m R^2 w' = F R - mu_r m g with v = w R
    deceleration = 5 / 7 * g * rolling / radius
    print(f"{name:8} {x:.3f} m, closed form {speed**2 / (2 * deceleration):.3f} m")
