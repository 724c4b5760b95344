"""A tracked vehicle on a field of loose slabs."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..model.builder import ModelBuilder
from ..model.model import Model
from ..model.parts import Dof, Joint, Material, Motor
from ..model.shapes import Box, Cylinder, Plane
from ..model.transforms import Transform
from .geometry import X, Y, Z, about, add_part, require
from .registry import scene
from .track_path import Circle, close

_GROUND, _SHOE, _GUIDE, _WHEEL, _HULL = 1, 2, 4, 8, 16
"""Collision categories: wheels touch shoes and their guides, the ground touches shoes, slabs and the hull."""


PAINT, STEEL, CONCRETE = (0.44, 0.5, 0.37, 1.0), (0.3, 0.31, 0.34, 1.0), (0.72, 0.7, 0.66, 1.0)
"""Red, green, blue and opacity in pictures: the hull, shoes, slabs."""
HULL_MASS, HULL_BOX, HULL_POSITION = 3500.0, Box((1.5, 0.5, 0.25)), (0.0, 0.0, 0.72)


@dataclass(frozen=True)
class Track:
    """Sizes of a track and its running gear (m, kg, N, N/m, N s/m, N m); heights are above the ground."""

    shoes: int = 40
    pitch: float = 0.18
    gap: float = 0.056  # between shoes, where the teeth of the sprocket enter
    width: float = 0.36
    half_thickness: float = 0.015
    shoe_density: float = 7800.0
    guide_height: float = 0.08
    guide_clearance: float = 0.015
    gauge: float = 1.5  # from track to track
    wheels: int = 5
    wheel_radius: float = 0.21
    wheel_half_width: float = 0.11
    wheel_spacing: float = 0.45
    wheel_density: float = 1500.0
    spring: float = 60e3
    damper: float = 6e3
    travel: float = 0.12
    overhang: float = 0.5  # of sprocket and idler over the outer wheels
    teeth: int = 9
    tooth_half_thickness: float = 0.008
    sprocket_height: float = 0.5
    idler_height: float = 0.46
    tension: float = 10e3
    tension_spring: float = 120e3
    tension_damper: float = 8e3
    torque: float = 2e3

    @property
    def pin_radius(self) -> float:
        """Radius of the pins on the sprocket: the corners of a polygon with a side per tooth."""
        return self.pitch / (2 * math.sin(math.pi / self.teeth))

    @property
    def hub_radius(self) -> float:
        """The flats of the polygon of shoes lie on the hub."""
        return self.pin_radius * math.cos(math.pi / self.teeth) - self.half_thickness

    @property
    def wheel_x(self) -> list[float]:
        """Road wheels, from behind."""
        return [(i - (self.wheels - 1) / 2) * self.wheel_spacing for i in range(self.wheels)]

    @property
    def bend_radius(self) -> float:
        """Radius of the pins where the track bends around an outer road wheel, so that no flat enters it."""
        return math.hypot(self.wheel_radius + self.half_thickness, self.pitch / 2)

    def wheel_z(self, i: int) -> float:
        """Inner wheels stand on the track; the outer ones hang higher, by what their bends need."""
        outer = i in (0, self.wheels - 1)
        return self.half_thickness + (self.bend_radius if outer else self.wheel_radius + self.half_thickness)

    def circles(self, idler_x: float) -> list[Circle]:
        """Around which the pins run."""
        x = self.wheel_x
        return [
            (x[0] - self.overhang, self.sprocket_height, self.pin_radius),
            (x[0], self.wheel_z(0), self.bend_radius),
            (x[-1], self.wheel_z(0), self.bend_radius),
            (idler_x, self.idler_height, self.pin_radius),
        ]


@scene(dt=5e-3, duration=12.0, method="apgd", tolerance=1e-3, margin=5e-3)
def tracked_vehicle(
    *,
    speed: float = 2.5,
    turn: float = 0.0,
    slabs: int = 24,
    slab_thickness: float = 0.06,
    shoes: int = 40,
    wheels: int = 5,
    mu: float = 0.8,
    seed: int = 1,
) -> Model:
    """A tracked vehicle of 5 t drives along x over a field of loose rigid slabs.

    Two tracks of `shoes` shoes (0.18 m pitch, 0.36 m wide, 10 kg) joined by hinges run around a toothed
    sprocket behind, an idler on a spring tensioner in front and `wheels` sprung road wheels. The sprockets
    keep the speed of `speed` m/s with at most 2 kN m each; `turn` in (-1, 1) lets the left track run slower
    and the right one faster. `slabs` slabs, about 0.5 x 2.4 m and `slab_thickness` m thick, lie at random
    angles, 0.9 m apart.
    """
    require(-1 < turn < 1, "tracked_vehicle", "turn must be in (-1, 1)")
    require(wheels >= 2, "tracked_vehicle", "wheels must be at least 2")
    track = Track(shoes=shoes, wheels=wheels)
    reach = track.wheel_x[-1]
    idler_x, pins = close(
        track.circles, track.shoes, track.pitch, reach + 0.7 * track.overhang, reach + 3 * track.overhang
    )
    b = ModelBuilder(friction_rule="minimum")
    rough = Material(friction=mu)
    touched = _GROUND | _SHOE | _HULL
    b.add_geom(None, Plane(), material=rough, category=_GROUND, mask=touched, name="ground")
    hull = add_part(
        b,
        "hull",
        HULL_BOX,
        density=HULL_MASS / HULL_BOX.volume(),
        position=HULL_POSITION,
        material=rough,
        category=_HULL,
        mask=0,
    )
    b.add_visual(hull, HULL_BOX, colour=PAINT)
    for side, name, pace in ((1, "left", speed * (1 - turn)), (-1, "right", speed * (1 + turn))):
        y = side * track.gauge / 2
        _shoes(b, track, name, y, pins, rough)
        _road_wheels(b, track, name, y, hull)
        _idler(b, track, name, y, hull, idler_x)
        _sprocket(b, track, name, y, hull, pins, pace)
    rng = np.random.default_rng(seed)
    for i in range(slabs):
        yaw = rng.uniform(-0.1, 0.1)
        half = (rng.uniform(0.2, 0.3), rng.uniform(1.1, 1.3), slab_thickness / 2)
        x = idler_x + track.pin_radius + 0.6 + 0.9 * i
        slab = add_part(
            b,
            f"slab {i}",
            Box(half),
            density=2400,
            position=(x, rng.uniform(-0.1, 0.1), half[2]),
            orientation=about(Z, yaw),
            material=rough,
            category=_GROUND,
            mask=touched,
        )
        b.add_visual(slab, Box(half), colour=CONCRETE)
    return b.build()


def _shoes(b: ModelBuilder, track: Track, name: str, y: float, pins: np.ndarray, material: Material) -> None:
    plate = Box(((track.pitch - track.gap) / 2, track.width / 2, track.half_thickness))
    guide = Box((track.pitch / 6, 0.01, track.guide_height / 2))
    # Towards the wheels is +z of a shoe: the pins run counter-clockwise seen from -y.
    side = track.wheel_half_width + track.guide_clearance + 0.01
    count = len(pins)
    bodies = []
    for k in range(count):
        start, end = pins[k], pins[(k + 1) % count]
        middle, along = (start + end) / 2, end - start
        shoe = add_part(
            b,
            f"{name} shoe {k}",
            plate,
            density=track.shoe_density,
            position=(middle[0], y, middle[1]),
            orientation=about(Y, -math.atan2(along[1], along[0])),
            material=material,
            category=_SHOE,
            mask=0,
        )
        b.add_visual(shoe, plate, colour=STEEL)
        for edge in (-side, side):
            b.add_geom(
                shoe,
                guide,
                position=(0, edge, track.half_thickness + track.guide_height / 2),
                material=Material(friction=0.1),
                category=_GUIDE,
                mask=0,
                name=f"{name} guide {k} {'-+'[edge > 0]}",
            )
        bodies.append(shoe)
    for k in range(count):
        pin = (pins[k][0], y, pins[k][1])
        b.add_revolute_joint(bodies[k], bodies[k - 1], point=pin, axis=Y, name=f"{name} pin {k}")


def _wheel(
    b: ModelBuilder, track: Track, name: str, radius: float, position: tuple[float, float, float]
) -> int:
    return add_part(
        b,
        name,
        Cylinder(radius, track.wheel_half_width),
        density=track.wheel_density,
        position=position,
        shape_orientation=about(X, -math.pi / 2),
        material=Material(friction=0.3),
        category=_WHEEL,
        mask=_SHOE | _GUIDE,
    )


def _sprung(
    b: ModelBuilder, name: str, wheel: int, hull: int, position: tuple[float, float, float], slide: Dof
) -> None:
    """A wheel that turns about y on a carrier without mass, which slides on the hull."""
    x, y, z = position
    hull_x, hull_y, hull_z = HULL_POSITION
    b.add_joint(
        Joint(
            name=name,
            body_a=wheel,
            body_b=hull,
            frame_b=Transform((x - hull_x, y - hull_y, z - hull_z)),
            dofs=(slide, Dof(axis=Y)),
        )
    )


def _road_wheels(b: ModelBuilder, track: Track, name: str, y: float, hull: int) -> None:
    load = 9.81 * HULL_MASS / (2 * track.wheels)
    for i, x in enumerate(track.wheel_x):
        position = (x, y, track.wheel_z(i))
        wheel = _wheel(b, track, f"{name} wheel {i}", track.wheel_radius, position)
        slide = Dof(
            kind="slide",
            axis=Z,
            lower=-track.travel,
            upper=track.travel,
            stiffness=track.spring,
            rest=-load / track.spring,  # carries its share of the hull where it stands
            damping=track.damper,
        )
        _sprung(b, f"{name} strut {i}", wheel, hull, position, slide)


def _idler(b: ModelBuilder, track: Track, name: str, y: float, hull: int, x: float) -> None:
    position = (x, y, track.idler_height)
    wheel = _wheel(b, track, f"{name} idler", track.hub_radius, position)
    slide = Dof(
        kind="slide",
        axis=X,
        lower=-track.travel,
        upper=track.travel,
        stiffness=track.tension_spring,
        rest=track.tension / track.tension_spring,
        damping=track.tension_damper,
    )
    _sprung(b, f"{name} tensioner", wheel, hull, position, slide)


def _sprocket(
    b: ModelBuilder, track: Track, name: str, y: float, hull: int, pins: np.ndarray, pace: float
) -> None:
    """A hub with a tooth at each corner of the polygon of shoes, driven at the pace of the track."""
    x, z, radius = track.circles(0)[0]
    sprocket = _wheel(b, track, f"{name} sprocket", track.hub_radius, (x, y, z))
    # The teeth stand where the pins are that lie on the sprocket.
    rim = pins - (x, z)
    farthest = rim[np.argmin(rim[:, 0])]
    phase = math.atan2(farthest[1], farthest[0])
    tip = radius + track.half_thickness
    root = track.hub_radius - 0.02
    tooth = Box(((tip - root) / 2, 0.9 * track.wheel_half_width, track.tooth_half_thickness))
    for k in range(track.teeth):
        a = phase + 2 * math.pi * k / track.teeth
        middle = (tip + root) / 2
        b.add_geom(
            sprocket,
            tooth,
            position=(middle * math.cos(a), 0, middle * math.sin(a)),
            orientation=about(Y, -a),
            material=Material(friction=0.1),
            category=_WHEEL,
            mask=_SHOE,
            name=f"{name} tooth {k}",
        )
    motor = Motor(
        kind="velocity", control=2 * math.pi * pace / (track.teeth * track.pitch), max_effort=track.torque
    )
    b.add_revolute_joint(sprocket, hull, point=(x, y, z), axis=Y, motor=motor, name=f"{name} drive")
