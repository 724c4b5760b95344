"""MuJoCo: trees in joint coordinates, loops closed by its soft equality constraints."""

from __future__ import annotations

import importlib.util
import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import amontons
import numpy as np
from amontons import shapes

from .engine import (
    WORLD,
    Engine,
    Link,
    Motion,
    Running,
    Subject,
    Unsupported,
    joint_kind,
    loop_points,
    relative_spin,
    trees,
    turned_back,
    world_pose,
)


@dataclass(frozen=True)
class Settings:
    """Attributes of MJCF; {dt} is the shortest time constant of constraints that MuJoCo takes, two steps."""

    option: str = ""
    geom: str = ""
    equality: str = ""


TUNED = Settings(
    option='cone="elliptic" impratio="10" iterations="200" tolerance="1e-10"',
    geom='solref="{dt} 1" solimp="0.99 0.999 1e-4"',
    equality='solref="{dt} 1" solimp="0.99 0.999 1e-4"',
)


def _text(values: Any) -> str:
    return " ".join(f"{v:.17g}" for v in np.ravel(values))


def _pose(frame: amontons.Transform) -> str:
    return f'pos="{_text(frame.position)}" quat="{_text(frame.rotation)}"'


def _geom(g: amontons.Geom) -> str:
    shape, kind, size = g.shape, "", "0 0 1"
    if isinstance(shape, shapes.Box):
        kind, size = "box", _text(shape.half)
    elif isinstance(shape, shapes.Sphere):
        kind, size = "sphere", _text([shape.radius])
    elif isinstance(shape, shapes.Capsule):
        kind, size = "capsule", _text([shape.radius, shape.half_length])
    elif isinstance(shape, shapes.Plane):
        kind = "plane"
    else:
        raise Unsupported(f"a {type(shape).__name__}")
    friction = f'friction="{_text([g.material.friction])} 0 0" contype="{g.category}" conaffinity="{g.mask}"'
    return f'<geom type="{kind}" size="{size}" {_pose(g.frame)} {friction}/>'


def mjcf(model: amontons.Model, dt: float, settings: Settings) -> str:
    """Bodies, geoms and joints; a fixed body is part of the world."""
    links, loops = trees(model)
    children: dict[int, list[Link]] = {}
    for link in links:
        children.setdefault(link.parent, []).append(link)
    geoms: dict[int, list[str]] = {}
    for g in model.geoms:
        geoms.setdefault(g.body, []).append(_geom(g))

    def joint(link: Link) -> str:
        if link.joint is None:
            return "<freejoint/>"
        kind, at = joint_kind(link.joint), f'pos="{_text(link.anchor())}"'
        return f'<joint type="hinge" axis="{_text(link.axis())}" {at}/>' if kind == "hinge" else (
            f'<joint type="ball" {at}/>'
        )  # fmt: skip

    # From the leaves on: a chain of a thousand links is deeper than Python's stack.
    inside: dict[int, str] = {}
    for link in reversed(links):
        body = model.bodies[link.body]
        i3 = np.asarray(body.inertia)
        full = _text([i3[0, 0], i3[1, 1], i3[2, 2], i3[0, 1], i3[0, 2], i3[1, 2]])
        frame = world_pose(model, link.parent).inverse() @ body.pose
        inside[link.body] = (
            f'<body name="b{link.body}" {_pose(frame)}>{"".join(geoms.get(link.body, []))}{joint(link)}'
            f'<inertial pos="{_text(body.centre_of_mass)}" mass="{body.mass:.17g}" fullinertia="{full}"/>'
            f"{''.join(inside.pop(c.body) for c in children.get(link.body, []))}</body>"
        )
    parts = [*geoms.get(WORLD, []), *inside.values()]
    for i, body in enumerate(model.bodies):
        if body.motion != "dynamic":
            parts.append(f'<body name="b{i}" {_pose(body.pose)}>{"".join(geoms.get(i, []))}</body>')
    closing = []
    for j in loops:
        second = f'body2="b{j.body_b}"' if j.body_b != WORLD else ""
        closing += [
            f'<connect body1="b{j.body_a}" {second} anchor="{_text(point)}"/>' for point, _ in loop_points(j)
        ]
    option = f'<option timestep="{dt:.17g}" gravity="{_text(model.gravity)}" {settings.option}/>'
    geom, equality = (text.format(dt=2 * dt) for text in (settings.geom, settings.equality))
    return (
        f'<mujoco>{option}<size memory="1G"/><default><geom {geom}/><equality {equality}/></default>'
        f"<worldbody>{''.join(parts)}</worldbody><equality>{''.join(closing)}</equality></mujoco>"
    )


def _set_velocities(engine: Any, model: amontons.Model, m: Any, d: Any) -> None:
    for link in trees(model)[0]:
        body = model.bodies[link.body]
        first = m.jnt_dofadr[m.body(f"b{link.body}").jntadr[0]]
        if link.joint is None:
            d.qvel[first : first + 3] = body.linear_velocity
            spin = np.array(body.angular_velocity, dtype=float)
            d.qvel[first + 3 : first + 6] = turned_back(body.pose.rotation, spin)
            continue
        spin = turned_back(body.pose.rotation, relative_spin(model, link))
        if joint_kind(link.joint) == "ball":
            d.qvel[first : first + 3] = spin
        else:
            d.qvel[first] = link.axis() @ spin


class _MuJoCo:
    def __init__(self, subject: Subject, dt: float, settings: Settings) -> None:
        import mujoco

        self.engine = mujoco
        if subject.path is None:
            try:
                self.m = mujoco.MjModel.from_xml_string(mjcf(subject.model, dt, settings))
            except ValueError as error:  # its reader has a limit of nesting, some 150 links
                raise Unsupported(f"model of this scene: {' '.join(str(error).split())[:80]}") from None
            names = [f"b{i}" for i in range(len(subject.model.bodies))]
        else:
            self.m, names = _from_file(mujoco, subject, dt, settings), list(subject.model.body_names)
        self.d = mujoco.MjData(self.m)
        kinds = mujoco.mjtWarning
        self.full = [int(kinds.mjWARN_CONTACTFULL), int(kinds.mjWARN_CNSTRFULL)]
        self.bad = [int(k) for k in (kinds.mjWARN_BADQPOS, kinds.mjWARN_BADQVEL, kinds.mjWARN_BADQACC)]
        self.numbers = [mujoco.mj_name2id(self.m, mujoco.mjtObj.mjOBJ_BODY, name) for name in names]
        if subject.path is None:
            _set_velocities(mujoco, subject.model, self.m, self.d)
        mujoco.mj_forward(self.m, self.d)

    def advance(self, steps: int) -> None:
        self.engine.mj_step(self.m, self.d, nstep=steps)
        if any(self.d.warning[k].number for k in self.full):
            raise Unsupported("memory for all the contacts of this scene")

    def close(self) -> None:
        pass

    def motion(self) -> Motion:
        # After a step the poses are those before it.
        self.engine.mj_kinematics(self.m, self.d)
        self.engine.mj_comPos(self.m, self.d)
        self.engine.mj_comVel(self.m, self.d)
        velocities, one = np.zeros((len(self.numbers), 6)), np.zeros(6)
        for i, k in enumerate(self.numbers):
            body = self.engine.mjtObj.mjOBJ_XBODY
            self.engine.mj_objectVelocity(self.m, self.d, body, k, one, 0)
            velocities[i] = one
        # A state that is not finite is put back to the start, and noted.
        lost = any(self.d.warning[k].number for k in self.bad)
        return Motion(
            math.nan * self.d.xpos[self.numbers] if lost else self.d.xpos[self.numbers].copy(),
            self.d.xquat[self.numbers].copy(),
            velocities[:, 3:], velocities[:, :3],
        )  # fmt: skip


def _from_file(engine: Any, subject: Subject, dt: float, settings: Settings) -> Any:
    """The file as MuJoCo reads it, at our step; tuned, contacts and equalities as stiff as above."""
    from robot_run import their_model

    m, refusal = their_model(subject.path, subject.path.suffix == ".urdf", subject.floor)
    if m is None:
        raise Unsupported(refusal)
    m.opt.timestep = dt
    if settings is TUNED:
        m.opt.cone, m.opt.impratio = engine.mjtCone.mjCONE_ELLIPTIC, 10
        m.opt.iterations, m.opt.tolerance = 200, 1e-10
        for reference, impedance in ((m.geom_solref, m.geom_solimp), (m.eq_solref, m.eq_solimp)):
            reference[:] = 2 * dt, 1
            impedance[:, :3] = 0.99, 0.999, 1e-4
    return m


def engine(name: str, settings: Settings) -> Engine:
    def start(subject: Subject, dt: float) -> Running:
        return _MuJoCo(subject, dt, settings)

    return Engine(name, settings is TUNED, start)


def engines() -> Iterator[Engine]:
    if importlib.util.find_spec("mujoco"):
        yield engine("MuJoCo", Settings())
        yield engine("MuJoCo, tuned", TUNED)
