"""The scenes that all engines get, and what should come of each."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import amontons
import amontons.scenes
import numpy as np
from amontons import shapes
from amontons.model.builder import ModelBuilder
from amontons.model.shapes import Box, Sphere
from common import DATA, ROOT
from measured.toss_data import EDGE, GIVEN, RATE, add_cube, read_tosses

from .plain import Body, Frame, Geom, Joint, Scene, Unsupported

ANGLE = math.degrees(math.atan(0.5))  # of friction, for mu 0.5
GRAVITY = 9.81
TOSSED = DATA / "measured" / "cube_tosses"


@dataclass(frozen=True)
class Case:
    """A scene, or a model file, and what should come of it."""

    key: str
    name: str
    make: Callable[[], amontons.Model]
    dt: float
    duration: float  # s
    rests: bool = False
    """whether the bodies should stay where they are"""
    goes: float | None = None
    """how far the first body should come (m)"""
    ends: float | None = None
    """how fast the first body should be at the end (m/s)"""
    lifts: bool = False
    """whether to tell how high the first body rises, which it should not"""
    conserves: bool = False
    """whether energy, momentum and angular momentum should stay what they are, as far as they can"""
    dissipates: bool = False
    """whether energy can only be lost"""
    turns: tuple[float, float] | None = None
    """the angle that the first body should turn by (rad, at most pi), and the radius (m) that it counts at"""
    follows: Callable[[], Any] | None = None
    """measured positions (m) at equal times of the run, for each time a row per body"""
    pieces: bool = False
    """whether short pieces are compared with tiny steps: where the motion has one answer"""
    repeats: bool = False
    """whether it is begun anew, on two threads where an engine has them"""
    keyframe: str = ""
    """of a file, that it starts from and whose controls it keeps"""
    quick: bool = False
    """whether it is part of the quick run, and of the check of CI"""
    path: Path | None = None

    def scene(self, model: amontons.Model) -> Scene:
        """Plain data of the model; for a file its name and those of its bodies."""
        if self.path is None:
            return plain(model)
        return Scene(path=str(self.path), names=tuple(model.body_names), keyframe=self.keyframe)


def plain(model: amontons.Model) -> Scene:
    """Raises Unsupported for what plain scenes do not have."""
    bodies = tuple(
        Body(b.name, b.motion == "dynamic", b.mass, tuple(map(tuple, np.asarray(b.inertia).tolist())),
             tuple(b.centre_of_mass), frame(b.pose), tuple(b.linear_velocity), tuple(b.angular_velocity))
        for b in model.bodies
    )  # fmt: skip
    geoms = tuple(
        Geom(g.body, *shape(g.shape), frame(g.frame), g.material.friction, g.material.restitution,
             g.category, g.mask)
        for g in model.geoms
    )  # fmt: skip
    if len({g.friction for g in geoms}) > 1:  # engines combine two coefficients by rules of their own
        raise Unsupported("several coefficients of friction")
    return Scene(tuple(model.gravity), bodies, geoms, tuple(joint(j) for j in model.joints))


def frame(pose: amontons.Transform) -> Frame:
    return Frame(tuple(map(float, pose.position)), tuple(map(float, pose.rotation)))


def shape(s: Any) -> tuple[str, tuple[float, ...]]:
    if isinstance(s, shapes.Box):
        return "box", tuple(s.half)
    if isinstance(s, shapes.Sphere):
        return "sphere", (s.radius,)
    if isinstance(s, shapes.Capsule):
        return "capsule", (s.radius, s.half_length)
    if isinstance(s, shapes.Hull):
        return "hull", tuple(np.ravel(s.vertices).tolist())
    if isinstance(s, shapes.Plane):
        return "plane", ()
    raise Unsupported(f"a {type(s).__name__}")


def joint(j: amontons.Joint) -> Joint:
    """A ball or a hinge without motor, stop or spring."""
    a, b = frame(j.frame_a), frame(j.frame_b)
    if j.kind == "chain" and j.spherical and not j.dofs:
        return Joint(j.name, "ball", j.body_a, j.body_b, a.position, b.position, (0.0, 0.0, 0.0))
    if j.kind == "chain" and not j.spherical and [d.kind for d in j.dofs] == ["hinge"]:
        (dof,) = j.dofs
        if dof.motor.kind == "none" and not any(dof.anchor):
            axis = tuple((a(dof.axis) - np.array(a.position)).tolist())
            return Joint(j.name, "hinge", j.body_a, j.body_b, a.position, b.position, axis)
    raise Unsupported(f'a joint like "{j.name}"')


def about_y(angle: float) -> tuple[float, ...]:
    return math.cos(angle / 2), 0.0, math.sin(angle / 2), 0.0


def bridge(*, planks: int = 30, ratio: float = 1000.0, sag: float = 0.5) -> amontons.Model:
    """A bridge of `planks` hinged planks of 2 kg between two anchors 6 m apart, hanging on a circle that is
    `sag` m deep, and a ball `ratio` times as heavy as a plank that lies in its middle."""
    b = ModelBuilder()
    half = 3.0
    radius = (half**2 + sag**2) / (2 * sag)
    reach = math.asin(half / radius)
    angles = np.linspace(-reach, reach, planks + 1)
    pins = radius * np.column_stack([np.sin(angles), np.zeros(planks + 1), 1 - np.cos(angles)])
    material = amontons.Material(friction=0.5)
    thickness, below = 0.02, None
    for i in range(planks):
        along = pins[i + 1] - pins[i]
        length = float(np.linalg.norm(along))
        tilt = -math.atan2(along[2], along[0])
        size = (0.45 * length, 0.4, thickness)
        plank = b.add_body(
            f"plank {i}", position=tuple((pins[i] + pins[i + 1]) / 2), orientation=about_y(tilt),
            shape=Box(size), density=2.0 / (8 * size[0] * size[1] * size[2]), material=material,
        )  # fmt: skip
        b.add_revolute_joint(plank, below, point=tuple(pins[i]), axis=(0, 1, 0), name=f"pin {i}")
        below = plank
    b.add_revolute_joint(below, None, point=tuple(pins[-1]), axis=(0, 1, 0), name="end")
    ball = 0.4
    # With an even number of planks the ball lies on the two in the middle, which it touches in their faces.
    lowest = pins[:, 2].min() + thickness + ball + 2e-3
    weight = 2.0 * ratio / (4 / 3 * math.pi * ball**3)
    b.add_body("ball", position=(0.0, 0.0, lowest), shape=Sphere(ball), density=weight, material=material)
    return b.build()


def frame_of_hinges(*, ratio: float = 1.0) -> amontons.Model:
    """A plane frame of four bars with a fifth parallel to two of them, all on hinges: one degree of freedom,
    and seven redundant rows. The lower bar is held by two hinges of the world; the upper ones swing."""
    b = ModelBuilder()
    length = 1.0
    lean = math.radians(30)
    top = np.array([length * math.sin(lean), 0.0, length * math.cos(lean)])

    def bar(name: str, start: Any, end: Any, mass: float) -> int:
        start, end = np.array(start, dtype=float), np.array(end, dtype=float)
        along = end - start
        angle = -math.atan2(along[2], along[0])
        half = float(np.linalg.norm(along)) / 2
        return b.add_body(
            name, position=tuple((start + end) / 2), mass=mass,
            inertia=tuple(mass * x for x in (0.0008 / 3, (half**2 + 0.0004) / 3, (half**2 + 0.0004) / 3)),
            orientation=about_y(angle),
        )  # fmt: skip

    feet = [(x, 0.0, 0.0) for x in (0.0, length, 2 * length)]
    legs = [bar(f"leg {i}", foot, foot + top, 1.0) for i, foot in enumerate(feet)]
    beam = bar("beam", top, feet[2] + top, ratio)
    for leg, foot in zip(legs, feet, strict=True):
        b.add_revolute_joint(leg, None, point=foot, axis=(0, 1, 0))
    b.add_revolute_joint(beam, legs[0], point=tuple(top), axis=(0, 1, 0))
    for leg, foot in list(zip(legs, feet, strict=True))[1:]:
        b.add_revolute_joint(leg, beam, point=tuple(foot + top), axis=(0, 1, 0), name=f"head {leg}")
    return b.build()


def spun_ellipsoid() -> amontons.Model:
    """A free body of three different inertias, turning near its middle axis: it tumbles for ever."""
    b = ModelBuilder(gravity=(0, 0, 0))
    b.add_body(mass=1.0, inertia=(0.4, 0.7, 1.0), angular_velocity=(0.05, 6.0, 0.05))
    return b.build()


def rod(*, mu: float = 1.5, lean: float = 30.0, speed: float = 2.0) -> amontons.Model:
    """Painleve's rod: a slender one, `lean` degrees from the plumb line, whose tip is pushed along a rough
    floor against its lean. With this mu the accelerations of rigid Coulomb contact have no solution; impulses
    do."""
    b = ModelBuilder()
    material = amontons.Material(friction=mu)
    b.add_geom(None, shapes.Plane(), material=material)
    half, radius = 0.5, 0.01
    a = math.radians(lean)
    body = b.add_body(
        "rod", position=(0.0, 0.0, half * math.cos(a) + radius), mass=1.0,
        inertia=(half**2 / 3, half**2 / 3, 1e-3), orientation=about_y(a),
        linear_velocity=(speed, 0.0, 0.0),
    )  # fmt: skip
    b.add_geom(body, Sphere(radius), position=(0, 0, -half), material=material)
    b.add_geom(body, Sphere(radius), position=(0, 0, half), material=material)
    return b.build()


def tongs(*, mu: float = 0.8, reach: float = 0.5, lean: float = 0.15) -> amontons.Model:
    """A cube of 1 kg that hangs between the pads of two fingers of 5 kg, each on a hinge `reach` above it and
    `lean` nearer to the middle. Their weight, and the cube's, press the pads: N r = (5 g / 2 + F) lean with
    F = g / 2. The pressure may lie anywhere on a pad, r = `reach` -+ 5 cm: it slides below mu 0.5, and holds
    above 0.62."""
    b = ModelBuilder()
    material = amontons.Material(friction=mu)
    half, pad = 0.1, 0.02
    cube = b.add_body("cube", mass=1.0, inertia=(2 * half**2 / 3,) * 3)
    b.add_geom(cube, Box((half,) * 3), material=material)
    for side in (-1.0, 1.0):
        tip = np.array([side * half, 0.0, 0.0])
        pivot = tip + np.array([-side * lean, 0.0, reach])
        middle = (tip + pivot) / 2
        inertia = 5.0 * (reach**2 + lean**2) / 12
        finger = b.add_body(f"finger {side:+g}", position=tuple(middle), mass=5.0, inertia=(inertia,) * 3)
        at = tip + np.array([side * pad, 0.0, 0.0]) - middle
        b.add_geom(finger, Box((pad, half / 2, half / 2)), position=tuple(at), material=material)
        b.add_revolute_joint(finger, None, point=tuple(pivot), axis=(0, 1, 0), name=f"hinge {side:+g}")
    return b.build()


def spun_disc(*, mu: float = 0.2, spin: float = 10.0, radius: float = 0.2) -> amontons.Model:
    """A disc of 1 kg on three feet at its rim, spun about its axis. All pressure is at the rim, whatever the
    split, and so the torque is mu m g R."""
    b = ModelBuilder()
    material, foot, height = amontons.Material(friction=mu), 0.02, 0.05
    b.add_geom(None, shapes.Plane(), material=material)
    across = radius**2 / 4
    disc = b.add_body(
        "disc", position=(0.0, 0.0, height), mass=1.0, inertia=(across, across, 2 * across),
        angular_velocity=(0.0, 0.0, spin),
    )  # fmt: skip
    for k in range(3):
        a = 2 * math.pi * k / 3
        at = (radius * math.cos(a), radius * math.sin(a), foot - height)
        b.add_geom(disc, Sphere(foot), position=at, material=material)
    return b.build()


def spun_down(mu: float = 0.2, spin: float = 10.0, radius: float = 0.2) -> float:
    """The angle that the disc turns by until it stops: w^2 R / (4 mu g) (rad)."""
    return spin**2 * radius / (4 * mu * GRAVITY)


TOSSES, SAMPLES, APART = 9, 60, 4.0
"""Tosses in a scene, samples of each that count, and their distance (m)."""


def measured_tosses() -> list[Any]:
    """The first ones of the data folder."""
    long_enough = [t.rows for t in read_tosses(TOSSED) if len(t.rows) > SAMPLES]
    return long_enough[:TOSSES]


def tosses() -> amontons.Model:
    """Cubes side by side that begin as measured ones were tossed onto a table."""
    b = ModelBuilder()
    material = amontons.Material(friction=GIVEN[0], restitution=GIVEN[1])
    b.add_geom(None, shapes.Plane(), material=material)
    for k, rows in enumerate(measured_tosses()):
        b.add_geom(add_cube(b, f"cube {k}", rows[0], APART * k), Box((EDGE / 2,) * 3), material=material)
    return b.build()


def tossed() -> Any:
    """(samples, bodies, 3)."""
    places = np.stack([rows[1 : SAMPLES + 1, 4:7] for rows in measured_tosses()], axis=1)
    return places + APART * np.arange(len(places[0]))[:, None] * (1.0, 0.0, 0.0)


def slid(angle: float, mu: float, duration: float) -> float:
    """Way of a box down a slope: a t^2 / 2 (m)."""
    a = GRAVITY * (math.sin(math.radians(angle)) - mu * math.cos(math.radians(angle)))
    return a * duration**2 / 2


def _scene(scene: str, **parameters: Any) -> Callable[[], amontons.Model]:
    return lambda: amontons.scenes.get(scene).make(**parameters)


def inclines() -> Iterator[Case]:
    """A cube on a slope below the angle of friction at which it stays, and just above."""
    for part in (0.2, 0.5, 0.9, 0.99):
        angle = part * ANGLE
        yield Case(f"incline-{part:g}", f"incline, {part:g} of the angle",
                   _scene("incline", angle=angle, mu=0.5), 5e-3, 2.0, rests=True,
                   quick=part == 0.99)  # fmt: skip
    steep = {"angle": 1.01 * ANGLE, "mu": 0.5}
    yield Case("incline-1.01", "incline, 1.01 of the angle", _scene("incline", **steep), 5e-3, 2.0,
               goes=slid(**steep, duration=2.0), quick=True)  # fmt: skip


CASES = (
    *inclines(),
    Case("launch", "launched cube", _scene("sliding_cube", speed=3.0), 5e-3, 1.0,
         goes=9.0 / (2 * 0.5 * GRAVITY), lifts=True, quick=True, pieces=True),
    Case("roll", "skidding ball", _scene("rolling_sphere", speed=3.0), 5e-3, 1.0, ends=15.0 / 7, lifts=True,
         pieces=True),
    Case("stack", "stack of 10", _scene("stack", boxes=10), 5e-3, 2.0, rests=True, quick=True, repeats=True),
    Case("plates-1", "plates 1:1", _scene("plates", ratio=1.0), 1e-2, 2.0, rests=True),
    Case("plates-100", "plates 1:100", _scene("plates", ratio=1e2), 1e-2, 2.0, rests=True, quick=True),
    Case("plates-1000", "plates 1:1000", _scene("plates", ratio=1e3), 1e-2, 2.0, rests=True, quick=True),
    Case("cards", "card house", _scene("card_house"), 5e-3, 2.0, rests=True),
    Case("arch", "arch near its threshold", _scene("arch", mu=0.6, thickness=0.25), 5e-3, 2.0, rests=True),
    Case("grasp", "cube in tongs", tongs, 5e-3, 2.0, rests=True, quick=True),
    Case("disc", "spinning disc", spun_disc, 5e-3, 1.0, turns=(spun_down(), 0.2), pieces=True,
         quick=True),
    Case("rod", "Painleve's rod", rod, 1e-3, 0.4, dissipates=True),
    Case("chain", "chain 1000:1", _scene("chain", links=40), 5e-3, 2.0, conserves=True, quick=True,
         pieces=True),
    Case("bridge", "bridge 1000:1", bridge, 5e-3, 2.0, dissipates=True, quick=True, pieces=True,
         repeats=True),
    Case("four-bar", "four-bar", _scene("four_bar", driven=False), 2e-3, 2.0, conserves=True, quick=True,
         pieces=True),
    Case("loops", "redundant loops", frame_of_hinges, 2e-3, 2.0, conserves=True),
    Case("ellipsoid", "tumbling body", spun_ellipsoid, 5e-3, 5.0, conserves=True, pieces=True),
    Case("wall", "wall at rest", _scene("wall_at_rest"), 5e-3, 0.5, rests=True),
    Case("wall-hit", "wall, hit", _scene("wall"), 5e-3, 0.6, dissipates=True),
    Case("spheres", "1000 spheres", _scene("spheres_in_box", count=1000, mu=0.5), 5e-3, 1.0, dissipates=True,
         repeats=True),
)  # fmt: skip

ROBOTS = (
    ("quadruped", ROOT / "examples" / "models" / "quadruped.xml", "robot quadruped", ""),
    ("humanoid", DATA / "robots" / "gymnasium" / "humanoid.xml", "robot humanoid", ""),
    ("go1", DATA / "robots" / "unitree_go1" / "scene.xml", "robot go1", ""),
    ("go1-stands", DATA / "robots" / "unitree_go1" / "scene.xml", "robot go1, standing", "home"),
)
"""Key, file, name, and the keyframe whose controls hold it; without one it has no controls and falls."""


def keys() -> list[str]:
    """Of all scenes, those that are not here too."""
    return [*(c.key for c in CASES), *(key for key, *_ in ROBOTS), "tosses"]


def with_data() -> Iterator[Case]:
    for key, path, name, keyframe in ROBOTS:
        if not path.exists():
            print(f"beside: {name} is left out: there is no {path.name} of it in the data folder")
            continue
        yield Case(
            key, name, lambda path=path: amontons.load_model(path), 2e-3,  # type: ignore[misc]
            5.0 if keyframe else 2.0, rests=bool(keyframe), keyframe=keyframe,
            quick=path.is_relative_to(ROOT), path=path,
        )  # fmt: skip
    if TOSSED.is_dir():
        yield Case("tosses", "measured tosses", tosses, 1 / RATE, SAMPLES / RATE, follows=tossed)
    else:
        print("beside: measured tosses are left out: there is no measured/cube_tosses in the data folder")


@cache
def cases() -> tuple[Case, ...]:
    return (*CASES, *with_data())
