"""Makes examples/problems/*.hdf5: one time step each of six small scenes, as FCLIB global files.

The step is that of Anitescu and Tasora (2010): v+ = v_free + M^-1 D' x with v_free = v + h g; the problem is
u = D v+ + c, c_n = gap / h for contacts (so that a contact acts only once it would close) and c = error / h
for joints. Nothing is random but the velocities of the lattice, whose seed is fixed.

    python tools/make_example_problems.py [--out examples/problems]
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass, field
from itertools import pairwise, product
from pathlib import Path

import amontons
import numpy as np

STEP = 0.01  # s
GRAVITY = np.array([0.0, 0.0, -9.81])  # m/s^2
UP = np.array([0.0, 0.0, 1.0])
CORNERS = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])


@dataclass
class Scene:
    """Bodies at their centres of mass with axis-aligned inertia, contacts and joint rows between them."""

    name: str
    description: str
    mass: list[float] = field(default_factory=list)  # kg
    inertia: list[np.ndarray] = field(default_factory=list)  # kg m^2, diagonal
    position: list[np.ndarray] = field(default_factory=list)  # m
    velocity: list[np.ndarray] = field(default_factory=list)  # m/s, rad/s
    contacts: list[tuple[int, int, np.ndarray, np.ndarray, float, float]] = field(default_factory=list)
    joints: list[tuple[int, int, np.ndarray, np.ndarray, float]] = field(default_factory=list)

    def body(
        self, mass: float, inertia: np.ndarray, position: np.ndarray, velocity: np.ndarray | None = None
    ) -> int:
        self.mass.append(mass)
        self.inertia.append(np.asarray(inertia, dtype=float))
        self.position.append(np.asarray(position, dtype=float))
        self.velocity.append(np.zeros(6) if velocity is None else np.asarray(velocity, dtype=float))
        return len(self.mass) - 1

    def box(self, size: np.ndarray, density: float, position: np.ndarray) -> int:
        x, y, z = size
        mass = density * x * y * z
        return self.body(mass, mass / 12 * np.array([y * y + z * z, x * x + z * z, x * x + y * y]), position)

    def sphere(
        self, radius: float, mass: float, position: np.ndarray, velocity: np.ndarray | None = None
    ) -> int:
        return self.body(mass, np.full(3, 0.4 * mass * radius**2), position, velocity)

    def contact(
        self, a: int, b: int, point: np.ndarray, normal: np.ndarray, mu: float, gap: float = 0.0
    ) -> None:
        """normal points from b to a; body -1 is the ground."""
        self.contacts.append((a, b, np.asarray(point, float), np.asarray(normal, float), mu, gap))

    def patch(self, a: int, b: int, centre: np.ndarray, half: np.ndarray, mu: float) -> None:
        """Four closed contacts at the corners of a horizontal rectangle, a above b."""
        for corner in CORNERS:
            self.contact(a, b, np.array([*(centre[:2] + corner * half), centre[2]]), UP, mu)

    def touching(self, a: int, b: int, radius: float, mu: float) -> None:
        offset = self.position[a] - self.position[b]
        distance = np.linalg.norm(offset)
        middle = (self.position[a] + self.position[b]) / 2
        self.contact(a, b, middle, offset / distance, mu, distance - 2 * radius)

    def joint_row(self, a: int, b: int, point: np.ndarray, axis: np.ndarray, error: float = 0.0) -> None:
        """The velocity of a's point relative to b's along an axis; error: what is to be closed (m)."""
        self.joints.append((a, b, np.asarray(point, float), np.asarray(axis, float), error))

    def ball_joint(self, a: int, b: int, point: np.ndarray) -> None:
        for axis in np.eye(3):
            self.joint_row(a, b, point, axis)

    def arm(self, body: int, point: np.ndarray) -> np.ndarray:
        return point - self.position[body] if body >= 0 else np.zeros(3)

    def problem(self) -> amontons.vi.Problem:
        rows_a = [self._wrench(a, point, axis, +1) for a, _, point, axis, _ in self.joints]
        rows_b = [self._wrench(b, point, axis, -1) for _, b, point, axis, _ in self.joints]
        A = amontons.vi.Contacts(
            1 / np.array(self.mass),
            1 / np.array(self.inertia),
            [a for a, *_ in self.contacts],
            [b for _, b, *_ in self.contacts],
            [self.arm(a, point) for a, _, point, *_ in self.contacts],
            [self.arm(b, point) for _, b, point, *_ in self.contacts],
            [normal for *_, normal, _, _ in self.contacts],
            joint_body_a=[a for a, *_ in self.joints],
            joint_body_b=[b for _, b, *_ in self.joints],
            joint_jacobian_a=rows_a,
            joint_jacobian_b=rows_b,
        ).stored()
        v_free = np.array(self.velocity)
        v_free[:, :3] += STEP * GRAVITY  # no gyroscopic term: all bodies turn slowly or are spheres
        c = np.zeros(A.shape[0])
        c[0 : 3 * len(self.contacts) : 3] = [gap / STEP for *_, gap in self.contacts]
        c[3 * len(self.contacts) :] = [error / STEP for *_, error in self.joints]
        f = np.hstack([np.array(self.mass)[:, None] * v_free[:, :3], np.array(self.inertia) * v_free[:, 3:]])
        mu = [mu for *_, mu, _ in self.contacts]
        cones = [amontons.vi.Friction(mu)] if mu else []
        return amontons.vi.Problem(
            A,
            A.jacobian() @ v_free.ravel() + c,
            [*cones, amontons.vi.Bilateral(len(self.joints))],
            name=self.name,
            description=self.description,
            source="amontons, tools/make_example_problems.py",
            f=f.ravel(),
        )

    def _wrench(self, body: int, point: np.ndarray, axis: np.ndarray, sign: int) -> np.ndarray:
        return sign * np.concatenate([axis, np.cross(self.arm(body, point), axis)])


def block_on_incline() -> Scene:
    """A cube on a plane tilted by 20 degrees, mu = .5: it sticks, as tan 20 = .36 < mu."""
    scene = Scene("block on incline", "a cube at rest on a plane of 20 degrees, mu .5; sticks")
    tilt = np.radians(20)
    normal = np.array([np.sin(tilt), 0, np.cos(tilt)])
    slope, side = np.array([np.cos(tilt), 0, -np.sin(tilt)]), np.array([0.0, 1.0, 0.0])
    half = 0.1
    cube = scene.body(8.0, np.full(3, 8.0 * (2 * half) ** 2 / 6), half * normal)
    for i, j in CORNERS:
        scene.contact(cube, -1, half * (i * slope + j * side), normal, 0.5)
    return scene


BRICK = np.array([0.25, 0.12, 0.065])  # m


def _bricks(scene: Scene, length: int, courses: int, mu: float) -> list[list[tuple[int, float, float]]]:
    """A wall in running bond along x; odd courses end in half bricks. (body, from, to) by course."""
    wall = []
    for course in range(courses):
        cuts = np.arange(length + 1) * BRICK[0]
        if course % 2:
            cuts = np.concatenate([[0], cuts[:-1] + BRICK[0] / 2, [cuts[-1]]])
        z = (course + 0.5) * BRICK[2]
        row = []
        for start, end in pairwise(cuts):
            size = np.array([end - start, BRICK[1], BRICK[2]])
            row.append((scene.box(size, 1900.0, [(start + end) / 2, 0, z]), start, end))
        wall.append(row)
    for body, start, end in wall[0]:
        scene.patch(body, -1, np.array([(start + end) / 2, 0, 0]), np.array([end - start, BRICK[1]]) / 2, mu)
    for lower, upper in pairwise(wall):
        for (a, a0, a1), (b, b0, b1) in product(upper, lower):
            left, right = max(a0, b0), min(a1, b1)
            if right - left > 1e-9:
                z = scene.position[a][2] - BRICK[2] / 2
                scene.patch(
                    a, b, np.array([(left + right) / 2, 0, z]), np.array([right - left, BRICK[1]]) / 2, mu
                )
    return wall


def wall_at_rest() -> Scene:
    """A brick wall under its own weight."""
    scene = Scene("wall at rest", "brick wall in running bond, 5 courses, at rest under gravity, mu .6")
    _bricks(scene, 8, 5, 0.6)
    return scene


def wall_impact() -> Scene:
    """The same wall, about to be hit by a heavy ball on a rope: one bilateral row keeps the rope's length."""
    scene = Scene("wall impact", "brick wall hit by a 50 kg ball of 5 m/s that hangs from a rope, mu .6")
    wall = _bricks(scene, 8, 5, 0.6)
    radius, mu, gap = 0.12, 0.6, 0.002
    target, start, end = wall[3][4]
    face = BRICK[1] / 2
    centre = np.array([(start + end) / 2, -(face + gap + radius), scene.position[target][2]])
    ball = scene.sphere(radius, 50.0, centre, np.array([0, 5.0, 0, 0, 0, 0]))
    scene.contact(target, ball, centre + [0, radius, 0], np.array([0.0, 1.0, 0.0]), mu, gap)
    # A mathematical pendulum: the rope ends in the ball's centre, 2 m below its pivot, and is straight now.
    scene.joint_row(ball, -1, centre, UP)
    return scene


def plates() -> Scene:
    """A stack in which each light plate carries a heavy one."""
    scene = Scene("plates 1:100", "12 plates at rest, densities alternating 1:100, a heavy one on top, mu .3")
    size = np.array([0.4, 0.4, 0.02])
    below = -1
    for level in range(12):
        density = 78.0 if level % 2 == 0 else 7800.0
        plate = scene.box(size, density, [0, 0, (level + 0.5) * size[2]])
        scene.patch(plate, below, np.array([0, 0, level * size[2]]), size[:2] / 2, 0.3)
        below = plate
    return scene


def lattice() -> Scene:
    """6 x 6 x 6 bodies: a comb of ball joints holds all of them, rods close loops; random velocities."""
    scene = Scene(
        "lattice", "216 bodies, 215 ball joints and 75 rods, random velocities, gravity; bilateral only"
    )
    n, spacing = 6, 0.5
    rng = np.random.default_rng(20130613)
    index = {}
    for cell in product(range(n), repeat=3):
        mass = float(rng.uniform(0.5, 2.0))
        inertia = mass * rng.uniform(0.005, 0.02, 3)
        index[cell] = scene.body(mass, inertia, spacing * np.array(cell), rng.normal(0, 1.0, 6))
    for (i, j, k), body in index.items():
        # A tree: along z everywhere, along y in the plane z = 0, along x on the axis.
        back = (i, j, k - 1) if k else (i, j - 1, 0) if j else (i - 1, 0, 0)
        if back in index:
            other = index[back]
            scene.ball_joint(body, other, (scene.position[body] + scene.position[other]) / 2)
    for (i, j, k), body in index.items():
        if (i + j) % 2 == 0 and k and (i + 1, j, k) in index:
            _rod(scene, body, index[i + 1, j, k])
    return scene


def _rod(scene: Scene, a: int, b: int) -> None:
    """A rod between two centres of mass: one row along the line through them, without moments."""
    axis = scene.position[a] - scene.position[b]
    scene.joint_row(a, b, scene.position[b], axis / np.linalg.norm(axis))


def spheres() -> Scene:
    """A square pyramid of equal spheres, each resting on four; neighbours in a layer touch."""
    scene = Scene("sphere pyramid", "91 equal spheres stacked as a square pyramid on the ground, mu .5")
    base, radius, mu = 6, 0.05, 0.5
    mass = 2500.0 * 4 / 3 * np.pi * radius**3
    layers = []
    for level in range(base):
        z = radius + level * np.sqrt(2) * radius
        layer = {}
        for i, j in product(range(base - level), repeat=2):
            x, y = (2 * i + level) * radius, (2 * j + level) * radius
            layer[i, j] = scene.sphere(radius, mass, [x, y, z])
        layers.append(layer)
    for body in layers[0].values():
        scene.contact(body, -1, scene.position[body] - radius * UP, UP, mu)
    for level, layer in enumerate(layers):
        for (i, j), body in layer.items():
            for neighbour in ((i + 1, j), (i, j + 1)):
                if neighbour in layer:
                    scene.touching(body, layer[neighbour], radius, mu)
            if level:
                for di, dj in product(range(2), repeat=2):
                    scene.touching(body, layers[level - 1][i + di, j + dj], radius, mu)
    return scene


SCENES = (block_on_incline, wall_at_rest, wall_impact, plates, lattice, spheres)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    default = Path(__file__).resolve().parents[1] / "examples" / "problems"
    parser.add_argument("--out", type=Path, default=default)
    out = parser.parse_args().out
    out.mkdir(parents=True, exist_ok=True)
    for scene in SCENES:
        path = out / f"{scene.__name__}.hdf5"
        scene().problem().write(path)
        print(f"{path}: {path.stat().st_size / 1024:.0f} KiB")


if __name__ == "__main__":
    main()
