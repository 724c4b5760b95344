"""MuJoCo: trees in joint coordinates, loops closed by its soft equality constraints."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from .plain import WORLD, Adapter, Frame, Geom, Link, Motion, Scene, Unsupported, Variant, matrix

IMPORT, PACKAGES = "mujoco", ("mujoco>=3.3",)
# {dt} is two steps, the shortest time constant of constraints that MuJoCo takes.
STIFF = 'solref="{dt} 1" solimp="0.99 0.999 1e-4"'
TUNED = {
    "option": 'cone="elliptic" impratio="10" iterations="200" tolerance="1e-10"', "geom": STIFF,
    "equality": STIFF,
}  # fmt: skip
NO_SLIP = TUNED | {"option": TUNED["option"] + ' noslip_iterations="50" noslip_tolerance="1e-10"'}
SLIP = "https://mujoco.readthedocs.io/en/stable/overview.html#slip"
STEPS = "https://mujoco.readthedocs.io/en/stable/computation/index.html#numerical-integration"
VARIANTS = (
    Variant("MuJoCo", {}, "https://mujoco.readthedocs.io/en/stable/XMLreference.html#option"),
    Variant("MuJoCo, elliptic", TUNED, SLIP, tuned=True),
    Variant("MuJoCo, noslip", NO_SLIP, SLIP, tuned=True),
    Variant("MuJoCo, RK4", TUNED | {"option": TUNED["option"] + ' integrator="RK4"'}, STEPS, tuned=True),
)  # fmt: skip


def _text(values: Any) -> str:
    return " ".join(f"{v:.17g}" for v in np.ravel(values))


def _pose(frame: Frame) -> str:
    return f'pos="{_text(frame.position)}" quat="{_text(frame.rotation)}"'


def _geom(number: int, g: Geom) -> str:
    what = f'type="mesh" mesh="m{number}"' if g.kind == "hull" else f'type="{g.kind}" size="{_text(g.size)}"'
    if g.kind == "plane":
        what = 'type="plane" size="0 0 1"'
    friction = f'friction="{_text([g.friction])} 0 0" contype="{g.category}" conaffinity="{g.mask}"'
    return f"<geom {what} {_pose(g.frame)} {friction}/>"


def mjcf(scene: Scene, dt: float, options: dict[str, Any]) -> str:
    """Bodies, geoms and joints; a fixed body is part of the world."""
    links, loops = scene.trees()
    children: dict[int, list[Link]] = {}
    for link in links:
        children.setdefault(link.parent, []).append(link)
    geoms: dict[int, list[str]] = {}
    for k, g in enumerate(scene.geoms):
        geoms.setdefault(g.body, []).append(_geom(k, g))
    meshes = [
        f'<mesh name="m{k}" vertex="{_text(g.size)}"/>' for k, g in enumerate(scene.geoms) if g.kind == "hull"
    ]

    def joint(link: Link) -> str:
        if link.joint is None:
            return "<freejoint/>"
        at = f'pos="{_text(link.anchor())}"'
        axis = f'axis="{_text(link.axis())}"' if link.joint.kind == "hinge" else ""
        return f'<joint type="{link.joint.kind}" {axis} {at}/>'

    # From the leaves on: a chain of a thousand links is deeper than Python's stack.
    inside: dict[int, str] = {}
    for link in reversed(links):
        body = scene.bodies[link.body]
        i3 = np.asarray(body.inertia)
        full = _text([i3[0, 0], i3[1, 1], i3[2, 2], i3[0, 1], i3[0, 2], i3[1, 2]])
        frame = scene.between(link.body, link.parent)
        inside[link.body] = (
            f'<body name="b{link.body}" {_pose(frame)}>{"".join(geoms.get(link.body, []))}{joint(link)}'
            f'<inertial pos="{_text(body.centre)}" mass="{body.mass:.17g}" fullinertia="{full}"/>'
            f"{''.join(inside.pop(c.body) for c in children.get(link.body, []))}</body>"
        )
    parts = [*geoms.get(WORLD, []), *inside.values()]
    for i, body in enumerate(scene.bodies):
        if not body.moves:
            parts.append(f'<body name="b{i}" {_pose(body.frame)}>{"".join(geoms.get(i, []))}</body>')
    closing = []
    for j in loops:
        second = f'body2="b{j.b}"' if j.b != WORLD else ""
        closing += [
            f'<connect body1="b{j.a}" {second} anchor="{_text(point)}"/>' for point, _ in scene.loop_points(j)
        ]
    option = f'<option timestep="{dt:.17g}" gravity="{_text(scene.gravity)}" {options.get("option", "")}/>'
    geom, equality = (options.get(key, "").format(dt=2 * dt) for key in ("geom", "equality"))
    return (
        f'<mujoco>{option}<size memory="1G"/><default><geom {geom}/><equality {equality}/></default>'
        f"<asset>{''.join(meshes)}</asset><worldbody>{''.join(parts)}</worldbody>"
        f"<equality>{''.join(closing)}</equality></mujoco>"
    )


def _set_velocities(scene: Scene, m: Any, d: Any) -> None:
    for link in scene.trees()[0]:
        body = scene.bodies[link.body]
        first = m.jnt_dofadr[m.body(f"b{link.body}").jntadr[0]]
        if link.joint is None:
            d.qvel[first : first + 3] = body.velocity
            d.qvel[first + 3 : first + 6] = matrix(body.frame.rotation).T @ np.array(body.spin)
            continue
        spin = scene.relative_spin(link)
        if link.joint.kind == "ball":
            d.qvel[first : first + 3] = spin
        else:
            d.qvel[first] = link.axis() @ spin


class _MuJoCo(Adapter):
    READS = True

    def __init__(self, scene: Scene, dt: float, options: dict[str, Any]) -> None:
        import mujoco

        super().__init__(scene, dt, options)
        self.engine = mujoco
        if scene.path:
            self.m, names = _from_file(mujoco, scene, dt, options), list(scene.names)
        else:
            try:
                self.m = mujoco.MjModel.from_xml_string(mjcf(scene, dt, options))
            except ValueError as error:  # its reader has a limit of nesting, some 150 links
                raise Unsupported(f"model of this scene: {' '.join(str(error).split())[:80]}") from None
            names = [f"b{i}" for i in range(len(scene.bodies))]
        self.d = mujoco.MjData(self.m)
        kinds = mujoco.mjtWarning
        self.full = [int(kinds.mjWARN_CONTACTFULL), int(kinds.mjWARN_CNSTRFULL)]
        self.bad = [int(k) for k in (kinds.mjWARN_BADQPOS, kinds.mjWARN_BADQVEL, kinds.mjWARN_BADQACC)]
        self.numbers = [mujoco.mj_name2id(self.m, mujoco.mjtObj.mjOBJ_BODY, name) for name in names]
        if not scene.path:
            _set_velocities(scene, self.m, self.d)
        elif scene.keyframe:
            mujoco.mj_resetDataKeyframe(self.m, self.d, self.m.key(scene.keyframe).id)
        mujoco.mj_forward(self.m, self.d)

    def advance(self, steps: int) -> None:
        self.engine.mj_step(self.m, self.d, nstep=steps)
        if any(self.d.warning[k].number for k in self.full):
            raise Unsupported("memory for all the contacts of this scene")

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

    def contacts(self) -> list[list[float]]:
        """Of the last step, at the poses before it."""
        if self.m.opt.integrator == self.engine.mjtIntegrator.mjINT_RK4:
            raise Unsupported("force of a step: it has those of four stages")
        bodies = {k: i for i, k in enumerate(self.numbers)}
        found, force = [], np.zeros(6)
        for i in range(self.d.ncon):
            c = self.d.contact[i]
            self.engine.mj_contactForce(self.m, self.d, i, force)
            frame = c.frame.reshape(3, 3)
            on, by = (bodies.get(self.m.geom_bodyid[g], WORLD) for g in (c.geom2, c.geom1))
            found.append([on, by, *c.pos, *frame[0], *(frame.T @ force[:3]), c.dist])
        return found

    def save(self) -> None:
        what = self.engine.mjtState.mjSTATE_INTEGRATION
        self.saved = np.zeros(self.engine.mj_stateSize(self.m, what))
        self.engine.mj_getState(self.m, self.d, self.saved, what)

    def restore(self) -> None:
        self.engine.mj_setState(self.m, self.d, self.saved, self.engine.mjtState.mjSTATE_INTEGRATION)


start = _MuJoCo


def _from_file(engine: Any, scene: Scene, dt: float, options: dict[str, Any]) -> Any:
    """The file as MuJoCo reads it, at our step; tuned, contacts and equalities as stiff as above."""
    m = engine.MjModel.from_xml_path(scene.path)
    m.opt.timestep = dt
    if options:
        m.opt.cone, m.opt.impratio = engine.mjtCone.mjCONE_ELLIPTIC, 10
        m.opt.iterations, m.opt.tolerance = 200, 1e-10
        if "noslip" in options["option"]:
            m.opt.noslip_iterations, m.opt.noslip_tolerance = 50, 1e-10
        if "RK4" in options["option"]:
            m.opt.integrator = engine.mjtIntegrator.mjINT_RK4
        for reference, impedance in ((m.geom_solref, m.geom_solimp), (m.eq_solref, m.eq_solimp)):
            reference[:] = 2 * dt, 1
            impedance[:, :3] = 0.99, 0.999, 1e-4
    return m
