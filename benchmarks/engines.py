"""Other engines on the same scenes at the same step: what a step costs, and what is left of the law.

    python benchmarks/engines.py [--quick] [--out FOLDER] [--check engines.csv]

Writes engines.csv, a row per scene and engine, all on one core. MuJoCo and PyBullet, where they are
installed, get the bodies, masses, shapes and coefficients of our model, each with its default settings and
with tuned ones. Their poses at the end are judged by our collision detection: overlap, and how far bodies
that should rest have crept. --check: the exit status is 1 if our time over that of MuJoCo is more than twice
what it is in a file of results, for any scene of both.
"""

from __future__ import annotations

import importlib.util
import math
import sys
import warnings
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from time import thread_time
from typing import Any

import amontons
import amontons.scenes
import numpy as np
from amontons import shapes
from common import arguments, read_csv, tracked, use_one_core, with_folders, write_csv

Array = np.ndarray[Any, Any]
SETTLED = 0.5  # of a run: from then on what rests should not move
MOST_WALL_CLOCK, QUICK_WALL_CLOCK = 20.0, 3.0  # s, of one engine on one scene


@dataclass(frozen=True)
class Case:
    """A scene of free bodies, and what should come of it."""

    name: str
    scene: str
    parameters: dict[str, Any]
    dt: float
    duration: float  # s
    rests: bool
    """whether the bodies should stay where they are"""


ANGLE = math.degrees(math.atan(0.5))  # of friction, for mu 0.5
CASES = (
    Case("stack of 10", "stack", {"boxes": 10}, 5e-3, 2.0, True),
    Case("plates 1:100", "plates", {"ratio": 1e2}, 1e-2, 2.0, True),
    Case("plates 1:1000", "plates", {"ratio": 1e3}, 1e-2, 2.0, True),
    Case("incline, 0.99 of the angle", "incline", {"angle": 0.99 * ANGLE, "mu": 0.5}, 5e-3, 2.0, True),
    Case("incline, 1.01 of the angle", "incline", {"angle": 1.01 * ANGLE, "mu": 0.5}, 5e-3, 2.0, False),
    Case("wall at rest", "wall_at_rest", {}, 5e-3, 0.5, True),
    Case("1000 spheres", "spheres_in_box", {"count": 1000, "mu": 0.5}, 5e-3, 1.0, False),
)


@dataclass
class Poses:
    """Of all bodies of our model: (n, 3) m, (n, 4) unit quaternions, w first."""

    positions: Array
    orientations: Array


# Advances an engine by one step, and the poses as they are.
Stepper = tuple[Callable[[], object], Callable[[], Poses]]


def ours(model: amontons.Model, dt: float, *, tolerance: float) -> Stepper:
    simulation = amontons.Simulation(model, dt=dt, tolerance=tolerance, on_failure="ignore")
    state = simulation.state
    return simulation.step, lambda: Poses(state.positions.copy(), state.orientations.copy())


@dataclass(frozen=True)
class Settings:
    """Attributes of MJCF; {dt} is the shortest time constant of contacts that MuJoCo takes, two steps."""

    option: str = ""
    geom: str = ""


TUNED = Settings(
    option='cone="elliptic" impratio="10" iterations="200" tolerance="1e-10"',
    geom='solref="{dt} 1" solimp="0.99 0.999 1e-4"',
)


def mjcf(model: amontons.Model, dt: float, settings: Settings) -> str:
    """Free bodies and their geoms; a fixed body is part of the world."""

    def text(values: Any) -> str:
        return " ".join(f"{v:.17g}" for v in np.ravel(values))

    def pose(frame: amontons.Transform) -> str:
        return f'pos="{text(frame.position)}" quat="{text(frame.rotation)}"'

    def geom(g: amontons.Geom) -> str:
        shape, kind, size = g.shape, "", "0 0 1"
        if isinstance(shape, shapes.Box):
            kind, size = "box", text(shape.half)
        elif isinstance(shape, shapes.Sphere):
            kind, size = "sphere", text([shape.radius])
        elif isinstance(shape, shapes.Plane):
            kind = "plane"
        else:
            raise NotImplementedError(type(shape).__name__)
        friction = f'friction="{text([g.material.friction])} 0 0"'
        return f'<geom type="{kind}" size="{size}" {pose(g.frame)} {friction}/>'

    geoms: dict[int, list[str]] = {}
    for g in model.geoms:
        geoms.setdefault(g.body, []).append(geom(g))
    parts = [*geoms.get(-1, [])]
    for i, body in enumerate(model.bodies):
        inside = "".join(geoms.get(i, []))
        if body.motion == "dynamic":
            i3 = np.asarray(body.inertia)
            full = text([i3[0, 0], i3[1, 1], i3[2, 2], i3[0, 1], i3[0, 2], i3[1, 2]])
            inside += f'<freejoint/><inertial pos="{text(body.centre_of_mass)}" mass="{body.mass:.17g}" '
            inside += f'fullinertia="{full}"/>'
        parts.append(f'<body name="b{i}" {pose(body.pose)}>{inside}</body>')
    option = f'<option timestep="{dt:.17g}" gravity="{text(model.gravity)}" {settings.option}/>'
    default = f"<default><geom {settings.geom.format(dt=2 * dt)}/></default>"
    world = f"<worldbody>{''.join(parts)}</worldbody>"
    return f'<mujoco>{option}<size memory="500M"/>{default}{world}</mujoco>'


def mujoco(model: amontons.Model, dt: float, *, settings: Settings) -> Stepper:
    import mujoco as engine

    m = engine.MjModel.from_xml_string(mjcf(model, dt, settings))
    d = engine.MjData(m)
    for i, body in enumerate(model.bodies):
        if body.motion == "dynamic":
            first = m.jnt_dofadr[m.body(f"b{i}").jntadr[0]]
            turn = np.zeros(9)
            engine.mju_quat2Mat(turn, np.array(body.pose.rotation, dtype=float))
            d.qvel[first : first + 3] = body.linear_velocity
            d.qvel[first + 3 : first + 6] = turn.reshape(3, 3).T @ np.array(body.angular_velocity)
    engine.mj_forward(m, d)
    numbers = [m.body(f"b{i}").id for i in range(len(model.bodies))]
    return (
        lambda: engine.mj_step(m, d),
        lambda: Poses(d.xpos[numbers].copy(), d.xquat[numbers].copy()),
    )


def pybullet(model: amontons.Model, dt: float, *, iterations: int) -> Stepper:
    import pybullet as engine

    engine.resetSimulation()
    engine.setGravity(*model.gravity)
    engine.setPhysicsEngineParameter(fixedTimeStep=dt, numSubSteps=0, numSolverIterations=iterations)

    def shape_of(g: amontons.Geom) -> int:
        if isinstance(g.shape, shapes.Box):
            return engine.createCollisionShape(engine.GEOM_BOX, halfExtents=g.shape.half)
        if isinstance(g.shape, shapes.Sphere):
            return engine.createCollisionShape(engine.GEOM_SPHERE, radius=g.shape.radius)
        if isinstance(g.shape, shapes.Plane):
            return engine.createCollisionShape(engine.GEOM_PLANE)
        raise NotImplementedError(type(g.shape).__name__)

    def add(g: amontons.Geom, mass: float, frame: amontons.Transform) -> int:
        w, x, y, z = frame.rotation
        body = engine.createMultiBody(mass, shape_of(g), -1, list(frame.position), [x, y, z, w])
        # The coefficients of two bodies are multiplied.
        engine.changeDynamics(body, -1, lateralFriction=math.sqrt(g.material.friction), linearDamping=0)
        engine.changeDynamics(body, -1, angularDamping=0, rollingFriction=0, spinningFriction=0)
        return body

    ids = {}
    for g in model.geoms:
        if g.body < 0:
            add(g, 0, g.frame)
            continue
        body = model.bodies[g.body]
        if body.motion != "dynamic":
            add(g, 0, body.pose * g.frame)
            continue
        if g.body in ids or any(g.frame.position):
            raise NotImplementedError("a body of several shapes")
        ids[g.body] = add(g, body.mass, body.pose)
        inertia = [float(v) for v in np.diag(np.asarray(body.inertia))]
        engine.changeDynamics(ids[g.body], -1, localInertiaDiagonal=inertia)
        engine.resetBaseVelocity(ids[g.body], body.linear_velocity, body.angular_velocity)

    def poses() -> Poses:
        positions = np.array([b.pose.position for b in model.bodies], dtype=float)
        orientations = np.array([b.pose.rotation for b in model.bodies], dtype=float)
        for i, k in ids.items():
            positions[i], (x, y, z, w) = engine.getBasePositionAndOrientation(k)
            orientations[i] = w, x, y, z
        return Poses(positions, orientations)

    return engine.stepSimulation, poses


def engines() -> dict[str, Callable[[amontons.Model, float], Stepper]]:
    """By name and setting, those that are installed."""
    found: dict[str, Callable[[amontons.Model, float], Stepper]] = {
        "amontons, 1e-6": lambda model, dt: ours(model, dt, tolerance=1e-6),
        "amontons, 1e-3": lambda model, dt: ours(model, dt, tolerance=1e-3),
    }
    if importlib.util.find_spec("mujoco"):
        found["MuJoCo"] = lambda model, dt: mujoco(model, dt, settings=Settings())
        found["MuJoCo, tuned"] = lambda model, dt: mujoco(model, dt, settings=TUNED)
    if importlib.util.find_spec("pybullet"):
        import pybullet as bullet

        if not bullet.isConnected():
            bullet.connect(bullet.DIRECT)
        found["PyBullet"] = lambda model, dt: pybullet(model, dt, iterations=50)
        found["PyBullet, tuned"] = lambda model, dt: pybullet(model, dt, iterations=500)
    return found


def overlap(model: amontons.Model, poses: Poses) -> float:
    """The deepest one in these poses (m)."""
    simulation = amontons.Simulation(model, dt=1e-6, on_failure="ignore")
    size = np.linalg.norm(poses.orientations, axis=1, keepdims=True)
    simulation.state.positions, simulation.state.orientations = poses.positions, poses.orientations / size
    return simulation.step().penetration


def row(
    case: Case, name: str, make: Callable[[amontons.Model, float], Stepper], most: float
) -> dict[str, Any]:
    model = amontons.scenes.get(case.scene).make(**case.parameters)
    advance, poses = make(model, case.dt)
    wanted = round(case.duration / case.dt)
    settled, spent, made = poses(), 0.0, 0
    while made < wanted and spent < most:
        start = thread_time()
        advance()
        spent += thread_time() - start
        made += 1
        if made == round(SETTLED * wanted):
            settled = poses()
    last = poses()
    way = np.linalg.norm(last.positions - settled.positions, axis=1).max()
    return {
        "case": case.name, "engine": name, "dt": case.dt, "steps": made, "complete": made == wanted,
        "step": spent / made, "penetration": overlap(model, last), "rests": case.rests,
        "way": float(way), "speed": float(way) / ((1 - SETTLED) * wanted * case.dt),
    }  # fmt: skip


def ratios(rows: Iterable[Mapping[str, Any]]) -> dict[str, float]:
    """Our time over MuJoCo's by scene, both as they are by default."""
    steps = {(r["case"], r["engine"]): float(r["step"]) for r in rows}
    names = {case for case, engine in steps if engine == "MuJoCo"}
    return {case: steps[case, "amontons, 1e-6"] / steps[case, "MuJoCo"] for case in sorted(names)}


def slower(rows: Iterable[Mapping[str, Any]], before: Iterable[Mapping[str, Any]]) -> list[str]:
    """Scenes whose ratio has more than doubled."""
    now, then = ratios(rows), ratios(before)
    return [
        f"{case}: {now[case]:.2g} times MuJoCo's time, it was {then[case]:.2g}"
        for case in now
        if case in then and now[case] > 2 * then[case]
    ]


def main() -> int:
    parser = arguments(__doc__)
    parser.add_argument("--check", type=Path, help="engines.csv of an earlier run")
    options = with_folders(parser.parse_args())
    use_one_core()
    warnings.simplefilter("ignore", amontons.StepWarning)
    rows: list[dict[str, Any]] = []
    for case in tracked(CASES[:4] if options.quick else CASES, "engines"):
        for name, make in engines().items():
            try:
                rows.append(row(case, name, make, QUICK_WALL_CLOCK if options.quick else MOST_WALL_CLOCK))
            except NotImplementedError as missing:
                print(f"engines: {name} has no {missing}: {case.name} is left out")
        write_csv(options.out / "engines.csv", rows)
    for r in rows:
        moved = "creeps" if r["rests"] else "moves"
        print(
            f"engines: {r['case']}, {r['engine']}: {1e6 * r['step']:.3g} us a step, "
            f"overlap {1e3 * r['penetration']:.2g} mm, {moved} at {1e3 * r['speed']:.2g} mm/s"
        )

    complaints = slower(rows, read_csv(options.check)) if options.check else []
    for complaint in complaints:
        print(f"engines: slower than twice: {complaint}")
    return bool(complaints)


if __name__ == "__main__":
    sys.exit(main())
