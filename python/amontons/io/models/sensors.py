"""Sensors: what MuJoCo measures, as measurements of ours; the others are listed."""

from __future__ import annotations

from typing import Any

from ...model.coordinates import coordinate_name
from ...model.sensing import SENSORS, Sensor, Site
from ...model.transforms import ORIGIN, Transform
from .bodies import Bodies
from .compiled import Compiled, transform
from .joints import Joints
from .sites import site_frame

AT_SITES = ("accelerometer", "velocimeter", "gyro", "magnetometer", "force", "torque", "touch", "rangefinder")
SUMS = ("force", "torque", "subtreecom", "subtreelinvel", "subtreeangmom")
"""Sensors that add up over a body and all that hangs on it."""


def read_sensors(
    compiled: Compiled,
    bodies: Bodies,
    joints: Joints,
    sites: tuple[Site, ...],
    actuators: dict[int, str],
    tendons: dict[int, str],
) -> tuple[Sensor, ...]:
    """actuators, tendons: their names here by MuJoCo's index."""
    m = compiled.model
    objects = compiled.mujoco.mjtObj
    named = {int(objects.mjOBJ_ACTUATOR): actuators, int(objects.mjOBJ_TENDON): tendons}
    found: list[Sensor] = []
    taken: set[str] = set()
    for i in range(m.nsensor):
        kind = compiled.mujoco.mjtSensor(m.sensor_type[i]).name.removeprefix("mjSENS_").lower()
        kind = {"jointactfrc": "jointactuatorfrc", "tendonactfrc": "tendonactuatorfrc"}.get(kind, kind)
        reason, values = _sensor(compiled, bodies, joints, sites, named, i, kind)
        if reason:
            where = compiled.element("sensor", i)
            compiled.issues.add(where, reason, "none")
            continue
        name = compiled.name("sensor", i) or f"sensor_{i}"
        while name in taken:
            name += "_"
        taken.add(name)
        found.append(Sensor(name, kind, cutoff=float(m.sensor_cutoff[i]), **values))
    return tuple(found)


def _sensor(
    compiled: Compiled,
    bodies: Bodies,
    joints: Joints,
    sites: tuple[Site, ...],
    named: dict[int, dict[int, str]],
    i: int,
    kind: str,
) -> tuple[str, dict[str, Any]]:
    """Why a sensor is not read, and else what it looks at."""
    m, objects = compiled.model, compiled.mujoco.mjtObj
    if kind not in SENSORS or int(m.sensor_dim[i]) != SENSORS[kind]:
        return "a sensor of a kind that is not read", {}
    thing, of = int(m.sensor_objid[i]), m.sensor_objtype[i]
    if kind == "clock":
        return "", {}
    if int(of) in named:
        source = named[int(of)].get(thing)
        return ("", {"source": source}) if source else ("a sensor on a drive that is not read", {})
    if of == objects.mjOBJ_JOINT:
        return _of_joint(compiled, joints, thing, kind)
    body, frame, place = _frame(compiled, bodies, of, thing)
    if place is None:
        return "a sensor on a thing that is not read", {}
    values: dict[str, Any] = {"body": place, "frame": frame, "link": bodies.link[body]}
    if kind == "magnetometer":
        values["field"] = tuple(m.opt.magnetic.tolist())
    if kind == "touch":
        values["shape"] = sites[thing].shape
    if kind in SUMS:
        if body == 0 and kind in ("force", "torque"):
            return "a force on the world, which nothing carries", {}
        values["bodies"], values["links"] = _subtree(compiled, bodies, body)
    if m.sensor_refid[i] >= 0:
        _, values["reference_frame"], values["reference"] = _frame(
            compiled, bodies, m.sensor_reftype[i], int(m.sensor_refid[i])
        )
        if kind == "insidesite":
            values["shape"] = sites[int(m.sensor_refid[i])].shape
        if values["reference"] is None:
            return "a sensor with a reference that is not read", {}
    return "", values


def _of_joint(compiled: Compiled, joints: Joints, j: int, kind: str) -> tuple[str, dict[str, Any]]:
    if j in joints.dof:
        joint, dof = joints.dof[j]
        return "", {"source": coordinate_name(joints.joints[joint], dof)}
    if kind not in ("ballquat", "ballangvel"):
        return "a limit or force of a ball or free joint", {}
    named = [own for own in joints.joints if own.spherical and compiled.name("jnt", j) in own.name.split("+")]
    if not named:
        return "a sensor of a ball joint without a name; give it one", {}
    return "", {"source": coordinate_name(named[0], -1)}


def _frame(compiled: Compiled, bodies: Bodies, of: int, thing: int) -> tuple[int, Transform, int | None]:
    """MuJoCo's body, the frame in our body, and our body; None for what has no frame here."""
    m, objects = compiled.model, compiled.mujoco.mjtObj
    if of == objects.mjOBJ_SITE:
        place, frame = site_frame(compiled, bodies, thing)
        return int(m.site_bodyid[thing]), frame, place
    kinds = {
        int(objects.mjOBJ_BODY): (lambda: thing, lambda: transform(m.body_ipos[thing], m.body_iquat[thing])),
        int(objects.mjOBJ_XBODY): (lambda: thing, lambda: ORIGIN),
        int(objects.mjOBJ_GEOM): (
            lambda: int(m.geom_bodyid[thing]), lambda: transform(m.geom_pos[thing], m.geom_quat[thing])
        ),
        int(objects.mjOBJ_CAMERA): (
            lambda: int(m.cam_bodyid[thing]), lambda: transform(m.cam_pos[thing], m.cam_quat[thing])
        ),
    }  # fmt: skip
    if int(of) not in kinds or (of == objects.mjOBJ_CAMERA and m.cam_mode[thing]):
        return 0, ORIGIN, None
    body, frame = (f() for f in kinds[int(of)])
    return body, bodies.frame[body] @ frame, bodies.at(body)


def _subtree(compiled: Compiled, bodies: Bodies, body: int) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Our bodies that are part of a body of MuJoCo and all that hangs on it, and links of others that are."""
    m = compiled.model
    inside = [False] * m.nbody
    for i in range(m.nbody):
        inside[i] = i == body or (i > 0 and inside[m.body_parentid[i]])
    # A body carries what is part of it: with it all its links are inside.
    ours = {bodies.index[i] for i in range(1, m.nbody) if inside[i] and bodies.owner[i] == i}
    links = (bodies.link[i] for i in range(1, m.nbody) if inside[i] and not inside[bodies.owner[i]])
    return tuple(sorted(ours)), tuple(sorted(links))
