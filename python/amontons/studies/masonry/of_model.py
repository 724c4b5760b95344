"""The assembly of a model: bodies as blocks, geoms of the world as supports."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ...checks import Array
from ...errors import InputError
from ...model.assembly import Assembly, Block
from ...model.hulls import convex_triangles
from ...model.mass import MassProperties
from ...model.model import Model
from ...model.parts import WORLD, Geom
from ...model.shapes import Box, HeightField, Hull, Mesh, Plane
from ...model.transforms import ORIGIN, Transform, rotation_matrix
from ...simulation.simulation import Simulation
from .joints import Joint, find_joints

Surface = tuple[Array, NDArray[np.int64]]


def assembly_of(model: Model) -> Assembly:
    """Bodies of boxes and hulls as blocks in their initial poses; geoms of the world as supports.

    A body on a given motion counts as a support at rest. Joints are in `ties`.
    """
    blocks = []
    for index, body in enumerate(model.bodies):
        geoms = [geom for geom in model.geoms if geom.body == index]
        place = body.pose
        surfaces = [s for geom in geoms if (s := _surface(model, geom, place)) is not None]
        rotation = np.array(rotation_matrix(place.rotation))
        centre = np.array(place(body.centre_of_mass))
        mass = None
        if body.motion == "dynamic":
            inertia = rotation @ np.array(body.inertia) @ rotation.T
            mass = MassProperties(body.mass, tuple(centre), tuple(map(tuple, inertia)))  # type: ignore[arg-type]
        points, faces = _joined(surfaces, centre)
        friction = geoms[0].material.friction if geoms else 0.0
        blocks.append(
            Block(
                model.body_names[index], points, faces, friction=friction, fixed=mass is None, given_mass=mass
            )
        )
    for index, geom in enumerate(model.geoms):
        if geom.body == WORLD and (surface := _surface(model, geom, Transform())) is not None:
            name = model.geom_names[index]
            name = f"world {name}" if name in model.body_names else name
            blocks.append(Block(name, *surface, friction=geom.material.friction, fixed=True))
    return Assembly(tuple(blocks), gravity=model.gravity)


def touching(model: Model, assembly: Assembly) -> Callable[[int, int], bool]:
    """Whether two blocks may touch each other, by the masks, exclusions and joints of the model."""
    apart = {frozenset(pair) for pair in model.excluded_bodies}
    apart |= {frozenset((int(j.body_a), int(j.body_b))) for j in model.joints if not j.collide}  # type: ignore[arg-type]
    never = {frozenset(pair) for pair in model.excluded_geoms}
    always = {frozenset((p.geom_a, p.geom_b)) for p in model.pair_materials if p.always}
    bodies = len(model.bodies)
    on: list[list[int]] = [[g for g, geom in enumerate(model.geoms) if geom.body == b] for b in range(bodies)]
    on += [[g] for g, geom in enumerate(model.geoms) if geom.body == WORLD and _surface(model, geom, ORIGIN)]

    def meet(g: int, h: int) -> bool:
        one, other = model.geoms[g], model.geoms[h]
        if frozenset((g, h)) in always:
            return True
        masks = bool(one.category & other.mask or other.category & one.mask)
        return masks and frozenset((one.body, other.body)) not in apart and frozenset((g, h)) not in never

    def touches(a: int, b: int) -> bool:
        return any(meet(g, h) for g in on[a] for h in on[b])

    return touches


def joints_of(model: Model, assembly: Assembly, gap: float | None) -> list[Joint]:
    """Joints over flat faces, and the contact points of a simulation for bodies that share none.

    Where the simulation finds a pair too, its coefficient of friction is that of the model's rule.
    """
    simulation = Simulation(model, dt=1e-6)
    simulation.step()
    touches = touching(model, assembly)
    supports = {name: i for i, name in enumerate(assembly.names)}
    rows: dict[frozenset[int], list[Joint]] = {}
    for contact in simulation.contacts:
        a, b = (_block(model, supports, contact[f"body_{s}"], contact[f"geom_{s}"]) for s in "ab")
        point, normal = contact["point"][None].copy(), contact["normal"].copy()
        joint = Joint(a, b, point, normal, 0.0, float(contact["friction"]), float(contact["gap"]))
        rows.setdefault(frozenset((a, b)), []).append(joint)
    joints = []
    for joint in find_joints(assembly, gap):
        if not touches(joint.a, joint.b):
            continue
        points = rows.get(frozenset((joint.a, joint.b)))
        joints.append(joint if not points else replace(joint, friction=points[0].friction))
    met = {frozenset((joint.a, joint.b)) for joint in joints}
    return joints + [point for pair, points in rows.items() if pair not in met for point in points]


def _block(model: Model, names: dict[str, int], body: int, geom: int) -> int:
    if body != WORLD:
        return int(body)
    name = model.geom_names[geom]
    return names.get(f"world {name}", names.get(name, -1))


def _surface(model: Model, geom: Geom, place: Transform) -> Surface | None:
    """Corners and triangles of a geom in the world, of a plane a wide sheet; curved shapes as a small one."""
    frame = place @ geom.frame
    match geom.shape:
        case Box(half=half):
            corners = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * np.array(
                half
            )
            points, faces = convex_triangles(corners)
        case Hull() | Mesh():
            points, faces = geom.shape.vertices, np.asarray(geom.shape.triangles)
            if isinstance(geom.shape, Hull):
                points, faces = convex_triangles(points)
        case Plane():
            wide = _reach(model)
            points = np.array(
                [(-wide, -wide, 0), (wide, -wide, 0), (wide, wide, 0), (-wide, wide, 0)], dtype=float
            )
            faces = np.array([(0, 1, 2), (0, 2, 3)])
        case HeightField():
            raise InputError("stability: the model has a height field; give the ground as a mesh or a plane")
        case _:
            return None
    rotation = np.array(rotation_matrix(frame.rotation))
    return points @ rotation.T + np.array(frame.position), np.asarray(faces, dtype=np.int64)


def _reach(model: Model) -> float:
    places = np.array([body.pose.position for body in model.bodies]).reshape(-1, 3)
    return 10 * (float(np.abs(places).max(initial=0.0)) + 10 * model.length)


def _joined(surfaces: Sequence[Surface], centre: Array) -> Surface:
    """Surfaces as one; of none a speck at the centre, so that a body of round shapes is a block too."""
    if not surfaces:
        return centre + 1e-3 * np.eye(3), np.array([(0, 1, 2)])
    counts = np.cumsum([0, *(len(points) for points, _ in surfaces)])
    faces = [part + start for (_, part), start in zip(surfaces, counts, strict=False)]
    return np.concatenate([points for points, _ in surfaces]), np.concatenate(faces)
