"""A robot from a URDF file on a floor, with a second one beside it, a table and a ball on the table."""

import warnings
from pathlib import Path

import amontons
from amontons import Material, ModelBuilder, Motor, shapes

warnings.simplefilter("ignore", amontons.ModelWarning)  # that the base of the file floats
dog = amontons.load_model(Path(__file__).parent / "models" / "dog.urdf")  # pip install amontons[models]

# One line is enough for the robot alone. Its lowest shape touches the plane z = 0.
alone = amontons.on_floor(dog)
print(alone, "and the floor is", alone.geom_names[-1])

ball = ModelBuilder()
ball.add_body("ball", shape=shapes.Sphere(0.05), density=300)
builder = ModelBuilder()
builder.add_floor(material=Material(friction=0.8))
builder.add_body("table", motion="static", shape=shapes.Box((0.2, 0.2, 0.15)), position=(0.6, 0, 0.15))
builder.add_model(dog, on="floor", prefix="rex_")
builder.add_model(dog, on="floor", prefix="fido_", position=(0, 1, 0), orientation=(0, 0, 0, 1))
builder.add_model(ball.build(), on="table", position=(0.6, 0, 0))

# A URDF has no motors, only their largest efforts: here are servos, N m per rad and per rad/s.
legs = [name.removesuffix("knee") for name in builder.build().joint_names if name.endswith("knee")]
for leg in legs:
    builder.set_motor(leg + "hip", Motor("position", kp=80, kd=4))
    builder.set_motor(leg + "knee", Motor("position", kp=80, kd=4))
model = builder.build()
print(model)


def crouch(simulation: amontons.Simulation) -> None:
    """Bends the knees within a second; called before each step."""
    bend = min(simulation.time, 1.0)
    for leg in legs:
        simulation.set_control(leg + "hip", 0.6 * bend)
        simulation.set_control(leg + "knee", -1.2 * bend)


simulation = amontons.Simulation(model)
simulation.before_step.append(crouch)
for _ in range(4):
    report = simulation.run(0.5)
    rex, fido = (simulation.state.positions[model.body_index(name)] for name in ("rex_trunk", "fido_trunk"))
    print(f"{simulation.time:.1f} s: trunks at {rex[2]:.3f} and {fido[2]:.3f} m, {report.contacts} contacts")
