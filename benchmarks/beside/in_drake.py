"""Drake: a discrete MultibodyPlant of trees; the constraints that would close loops are left out."""

from __future__ import annotations

import importlib.util
from collections.abc import Iterator
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
    check_found,
    joint_kind,
    relative_spin,
    trees,
    turned_back,
    world_pose,
)

MOST_BODIES, MOST_PATCHES = 1000, 200
"""Of scenes that it is given, and of those where faces meet in patches: 750 bricks take 5 s a step."""


class _Drake:
    def __init__(self, subject: Subject, dt: float, tuned: bool, approximation: str) -> None:
        from pydrake.geometry import SceneGraphConfig
        from pydrake.multibody.plant import AddMultibodyPlant, MultibodyPlantConfig
        from pydrake.systems.analysis import Simulator
        from pydrake.systems.framework import DiagramBuilder

        self.model, self.dt = subject.model, dt
        if len(subject.model.bodies) > (MOST_PATCHES if tuned else MOST_BODIES):
            raise Unsupported(f"solver for {len(subject.model.bodies)} bodies within minutes a step")
        builder, config, scene = DiagramBuilder(), MultibodyPlantConfig(), SceneGraphConfig()
        config.time_step, config.discrete_contact_approximation = dt, approximation
        if tuned:
            # Faces of boxes meet in patches, not in a point each.
            scene.default_proximity_properties.compliance_type = "compliant"
            scene.default_proximity_properties.hydroelastic_modulus = 1e8
            scene.default_proximity_properties.slab_thickness = 0.1
        self.plant, graph = AddMultibodyPlant(config, builder)
        graph.set_config(scene)
        self.plant.mutable_gravity_field().set_gravity_vector(subject.model.gravity)
        bodies = (_read if subject.path else _build)(self.plant, graph, subject)
        self.plant.Finalize()
        diagram = builder.Build()
        self.simulator = Simulator(diagram)
        self.context = self.plant.GetMyMutableContextFromRoot(self.simulator.get_mutable_context())
        self.bodies = {i: self.plant.get_body(index) for i, index in bodies.items()}
        if subject.path is None:
            _set_start(self)
        elif subject.path.suffix == ".urdf":
            self._place_free_bases()
        self.simulator.Initialize()

    def _place_free_bases(self) -> None:
        """A URDF tells nothing of where its base stands; ours does."""
        for i, body in self.bodies.items():
            if body.is_floating_base_body():
                self.plant.SetFreeBodyPose(self.context, body, _transform(self.model.bodies[i].pose))

    def advance(self, steps: int) -> None:
        now = round(self.simulator.get_context().get_time() / self.dt)
        try:
            self.simulator.AdvanceTo((now + steps) * self.dt)
        except RuntimeError as error:  # the solver has not converged, or the state is not finite
            raise Unsupported(f"way on: {' '.join(str(error).split())[:120]}") from None

    def close(self) -> None:
        pass

    def motion(self) -> Motion:
        found = Motion.start(self.model)
        for i, body in self.bodies.items():
            pose = self.plant.EvalBodyPoseInWorld(self.context, body)
            velocity = self.plant.EvalBodySpatialVelocityInWorld(self.context, body)
            found.positions[i] = pose.translation()
            found.orientations[i] = pose.rotation().ToQuaternion().wxyz()
            found.linear[i], found.angular[i] = velocity.translational(), velocity.rotational()
        return found


def _transform(frame: amontons.Transform) -> Any:
    from pydrake.common.eigen_geometry import Quaternion
    from pydrake.math import RigidTransform

    q = np.array(frame.rotation)
    return RigidTransform(Quaternion(q / np.linalg.norm(q)), frame.position)


def _shape(g: amontons.Geom) -> Any:
    from pydrake import geometry

    s = g.shape
    if isinstance(s, shapes.Box):
        return geometry.Box(*(2 * x for x in s.half))
    if isinstance(s, shapes.Sphere):
        return geometry.Sphere(s.radius)
    if isinstance(s, shapes.Capsule):
        return geometry.Capsule(s.radius, 2 * s.half_length)
    if isinstance(s, shapes.Plane):
        return geometry.HalfSpace()
    raise Unsupported(f"a {type(s).__name__}")


def _build(plant: Any, graph: Any, subject: Subject) -> dict[int, Any]:
    from pydrake.multibody.plant import CoulombFriction
    from pydrake.multibody.tree import SpatialInertia, UnitInertia

    model, bodies = subject.model, {}
    for i, b in enumerate(model.bodies):
        if b.motion != "dynamic":
            continue
        full = np.asarray(b.inertia) / b.mass
        about = UnitInertia(full[0, 0], full[1, 1], full[2, 2], full[0, 1], full[0, 2], full[1, 2])
        inertia = SpatialInertia(
            b.mass, list(b.centre_of_mass), about.ShiftFromCenterOfMass(list(b.centre_of_mass))
        )
        bodies[i] = plant.AddRigidBody(f"b{i}", inertia)
    for k, g in enumerate(model.geoms):
        on = bodies.get(g.body, plant.world_body())
        frame = g.frame if g.body == WORLD or g.body in bodies else model.bodies[g.body].pose @ g.frame
        if g.category or g.mask:
            friction = CoulombFriction(g.material.friction, g.material.friction)
            plant.RegisterCollisionGeometry(on, _transform(frame), _shape(g), f"g{k}", friction)
    links, loops = trees(model)
    for link in links:
        if link.joint is not None:
            _add_joint(plant, model, link, bodies)
    if loops:  # AddBallConstraint: Drake 1.51.1 from PyPI ends in a segmentation fault at the first step
        raise Unsupported("constraint that closes a loop and survives a step")
    _filter(plant, graph, model, bodies)
    return {i: body.index() for i, body in bodies.items()}


def _add_joint(plant: Any, model: amontons.Model, link: Link, bodies: dict[int, Any]) -> None:
    """Both frames coincide at the start, where coordinates are zero, in the axes of the body."""
    from pydrake.multibody.tree import BallRpyJoint, FixedOffsetFrame, RevoluteJoint

    on_child = amontons.Transform(position=link.anchor())
    on_parent = world_pose(model, link.parent).inverse() @ model.bodies[link.body].pose @ on_child
    parent = bodies.get(link.parent, plant.world_body())
    name = f"j{link.body}"
    f = plant.AddFrame(FixedOffsetFrame(f"{name}p", parent.body_frame(), _transform(on_parent)))
    m = plant.AddFrame(FixedOffsetFrame(f"{name}c", bodies[link.body].body_frame(), _transform(on_child)))
    assert link.joint
    if joint_kind(link.joint) == "hinge":
        plant.AddJoint(RevoluteJoint(name, f, m, link.axis()))
    else:
        plant.AddJoint(BallRpyJoint(name, f, m))


def _filter(plant: Any, graph: Any, model: amontons.Model, bodies: dict[int, Any]) -> None:
    """Keeps apart what may not touch: all pairs of kinds that share no bit."""
    from pydrake.geometry import CollisionFilterDeclaration, GeometrySet

    kinds: dict[tuple[int, int], list[Any]] = {}
    for g in model.geoms:
        if g.body in bodies and (g.category or g.mask):
            kinds.setdefault((g.category, g.mask), []).append(bodies[g.body])
    for (category, mask), some in kinds.items():
        if not category & mask:
            ids = [i for body in some for i in plant.GetCollisionGeometriesForBody(body)]
            graph.collision_filter_manager().Apply(
                CollisionFilterDeclaration().ExcludeWithin(GeometrySet(ids))
            )


def _set_start(d: _Drake) -> None:
    from pydrake.multibody.math import SpatialVelocity

    for link in trees(d.model)[0]:
        b = d.model.bodies[link.body]
        if link.joint is None:
            d.plant.SetFreeBodyPose(d.context, d.bodies[link.body], _transform(b.pose))
            velocity = SpatialVelocity(list(b.angular_velocity), list(b.linear_velocity))
            d.plant.SetFreeBodySpatialVelocity(d.context, d.bodies[link.body], velocity)
            continue
        spin = turned_back(b.pose.rotation, relative_spin(d.model, link))
        joint = d.plant.GetJointByName(f"j{link.body}")
        if joint_kind(link.joint) == "hinge":
            joint.set_angular_rate(d.context, float(link.axis() @ spin))
        else:
            joint.set_angular_velocity(d.context, spin)


def _read(plant: Any, graph: Any, subject: Subject) -> dict[int, Any]:
    from pydrake.geometry import HalfSpace
    from pydrake.math import RigidTransform
    from pydrake.multibody.parsing import Parser
    from pydrake.multibody.plant import CoulombFriction
    from pydrake.multibody.tree import BodyIndex

    parser = Parser(plant)
    try:
        parser.AddModels(str(subject.path))
    except RuntimeError as error:
        raise Unsupported(f"reader for this file: {' '.join(str(error).split())[:160]}") from None
    if subject.floor is not None:
        at = RigidTransform([0, 0, subject.floor])
        plant.RegisterCollisionGeometry(
            plant.world_body(), at, HalfSpace(), "floor", CoulombFriction(1.0, 1.0)
        )
    fixed = not any(c.kind == "free" for c in subject.model.coordinates.values())
    if subject.path and subject.path.suffix == ".urdf" and fixed:
        first = plant.GetFrameByName(subject.model.body_names[0])
        plant.WeldFrames(plant.world_frame(), first)
    names = {name: i for i, name in enumerate(subject.model.body_names)}
    found = {}
    for k in range(1, plant.num_bodies()):
        body = plant.get_body(BodyIndex(k))
        if body.name() in names:
            found[names[body.name()]] = body.index()
    check_found(subject.model, found)
    return found


def engine(name: str, *, tuned: bool = False, approximation: str = "lagged") -> Engine:
    """approximation: lagged (Drake's default), sap, similar or tamsi."""

    def start(subject: Subject, dt: float) -> Running:
        return _Drake(subject, dt, tuned, approximation)

    return Engine(name, tuned, start)


def engines() -> Iterator[Engine]:
    if importlib.util.find_spec("pydrake"):
        yield engine("Drake")
        yield engine("Drake, tuned", tuned=True)
