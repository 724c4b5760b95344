"""Drake: a discrete MultibodyPlant of trees; the constraints that would close loops are left out."""

from __future__ import annotations

from typing import Any

import numpy as np

from .plain import WORLD, Adapter, Frame, Geom, Link, Scene, Unsupported, Variant, matrix

IMPORT, PACKAGES = "pydrake", ("drake>=1.40",)
HYDROELASTIC = "https://drake.mit.edu/doxygen_cxx/group__hydroelastic__user__guide.html"
CONTACT = "https://drake.mit.edu/doxygen_cxx/group__contact__engineering.html"
CENIC = "https://drake.mit.edu/doxygen_cxx/classdrake_1_1multibody_1_1_cenic_integrator.html"
# The modulus is Drake's default for those that ask for one.
PATCHES = {"patches": True, "modulus": 1e7}
VARIANTS = (
    Variant(
        "Drake", {}, "https://drake.mit.edu/doxygen_cxx/classdrake_1_1multibody_1_1_multibody_plant.html"
    ),
    Variant("Drake, lagged", PATCHES, HYDROELASTIC, tuned=True),
    Variant("Drake, SAP", PATCHES | {"approximation": "sap"}, HYDROELASTIC, tuned=True),
    Variant("Drake, TAMSI", PATCHES | {"approximation": "tamsi"}, CONTACT, tuned=True),
    Variant("Drake, CENIC", PATCHES | {"modulus": 1e8, "accuracy": 1e-5}, CENIC, tuned=True),
)
ROLL = (0.5**0.5, 0.0, 0.0, 0.5**0.5)
"""Of a ball joint in its bodies: its x is their y."""
MOST_PATCHES = 200
"""Bodies of scenes where faces meet in patches: 750 bricks take 5 s a step."""


class _Drake(Adapter):
    READS = True

    def __init__(self, scene: Scene, dt: float, options: dict[str, Any]) -> None:
        from pydrake.geometry import SceneGraphConfig
        from pydrake.multibody.plant import AddMultibodyPlant, MultibodyPlantConfig
        from pydrake.systems.analysis import ApplySimulatorConfig, Simulator, SimulatorConfig
        from pydrake.systems.framework import DiagramBuilder

        super().__init__(scene, dt, options)
        if options.get("patches") and len(scene.bodies) > MOST_PATCHES:
            raise Unsupported(f"patches for {len(scene.bodies)} bodies within minutes a step")
        self.patches = bool(options.get("patches"))
        builder, config, defaults = DiagramBuilder(), MultibodyPlantConfig(), SceneGraphConfig()
        accuracy = options.get("accuracy")  # of its integrator of a continuous plant, which chooses its steps
        config.time_step = 0.0 if accuracy else dt
        config.discrete_contact_approximation = options.get("approximation", "lagged")
        if scene.path and options.get("patches"):
            defaults.default_proximity_properties.compliance_type = "compliant"
            defaults.default_proximity_properties.hydroelastic_modulus = options["modulus"]
        self.plant, graph = AddMultibodyPlant(config, builder)
        graph.set_config(defaults)
        self.plant.mutable_gravity_field().set_gravity_vector(scene.gravity)
        bodies = _read(self.plant, scene) if scene.path else _build(self.plant, graph, scene, options)
        self.plant.Finalize()
        diagram = builder.Build()
        self.simulator = Simulator(diagram)
        if accuracy:
            chosen = SimulatorConfig(integration_scheme="cenic", max_step_size=dt, accuracy=accuracy)
            ApplySimulatorConfig(chosen, self.simulator)
        self.context = self.plant.GetMyMutableContextFromRoot(self.simulator.get_mutable_context())
        self.bodies = {i: self.plant.get_body(index) for i, index in bodies.items()}
        if not scene.path:
            _set_start(self)
        self.simulator.Initialize()

    def advance(self, steps: int) -> None:
        now = round(self.simulator.get_context().get_time() / self.dt)
        try:
            self.simulator.AdvanceTo((now + steps) * self.dt)
        except RuntimeError as error:  # the solver has not converged, or the state is not finite
            raise Unsupported(f"way on: {' '.join(str(error).split())[:120]}") from None

    def tell(self, body: Any) -> tuple[Any, Any, Any, Any]:
        pose = self.plant.EvalBodyPoseInWorld(self.context, body)
        velocity = self.plant.EvalBodySpatialVelocityInWorld(self.context, body)
        q = pose.rotation().ToQuaternion().wxyz()
        return pose.translation(), q, velocity.translational(), velocity.rotational()

    def contacts(self) -> list[list[float]]:
        """Of points; a patch tells the sum of its forces alone."""
        if self.patches:
            raise Unsupported("forces of points")
        result = self.plant.get_contact_results_output_port().Eval(self.context)
        numbers = {int(body.index()): i for i, body in self.bodies.items()}
        found = []
        for k in range(result.num_point_pair_contacts()):
            info = result.point_pair_contact_info(k)
            on, by = (numbers.get(int(b), WORLD) for b in (info.bodyB_index(), info.bodyA_index()))
            pair = info.point_pair()
            found.append(
                [on, by, *info.contact_point(), *-pair.nhat_BA_W, *info.contact_force(), -pair.depth]
            )
        return found

    def save(self) -> None:
        self.saved = self.simulator.get_context().Clone()

    def restore(self) -> None:
        self.simulator.get_mutable_context().SetTimeStateAndParametersFrom(self.saved)
        self.simulator.Initialize()


start = _Drake


def _transform(frame: Frame) -> Any:
    from pydrake.common.eigen_geometry import Quaternion
    from pydrake.math import RigidTransform

    q = np.array(frame.rotation)
    return RigidTransform(Quaternion(q / np.linalg.norm(q)), np.array(frame.position))


def _shape(g: Geom) -> Any:
    from pydrake import geometry

    return g.made({
        "box": lambda *half: geometry.Box(*(2 * x for x in half)), "sphere": geometry.Sphere,
        "capsule": lambda radius, half: geometry.Capsule(radius, 2 * half), "plane": geometry.HalfSpace,
        "hull": lambda points: geometry.Convex(points.T, "hull"),
    })  # fmt: skip


def _properties(g: Geom, options: dict[str, Any]) -> Any:
    """Friction; where faces meet in patches, a rigid world and compliant bodies, as the manual advises.

    A ball meets in points: as a patch it is a mesh, and does not roll.
    """
    from pydrake import geometry
    from pydrake.multibody.plant import CoulombFriction

    found = geometry.ProximityProperties()
    friction = CoulombFriction(g.friction, g.friction)
    geometry.AddContactMaterial(friction=friction, properties=found)
    if not options.get("patches") or g.kind == "sphere":
        return found
    if g.body == WORLD:
        geometry.AddRigidHydroelasticProperties(1.0, found)
    else:
        size = min(g.size) if g.kind != "hull" else np.ptp(g.made({"hull": np.array}), axis=0).min() / 2
        geometry.AddCompliantHydroelasticProperties(0.5 * size, options["modulus"], found)
    return found


def _build(plant: Any, graph: Any, scene: Scene, options: dict[str, Any]) -> dict[int, Any]:
    from pydrake.multibody.tree import SpatialInertia, UnitInertia

    bodies: dict[int, Any] = {}
    for i, b in enumerate(scene.bodies):
        if not b.moves:
            continue
        full = np.asarray(b.inertia) / b.mass
        about = UnitInertia(full[0, 0], full[1, 1], full[2, 2], full[0, 1], full[0, 2], full[1, 2])
        inertia = SpatialInertia(b.mass, np.array(b.centre), about.ShiftFromCenterOfMass(np.array(b.centre)))
        bodies[i] = plant.AddRigidBody(f"b{i}", inertia)
    for k, g in enumerate(scene.touching()):
        on = bodies.get(g.body, plant.world_body())
        frame = _transform(g.frame if g.body in bodies else scene.placed(g))
        plant.RegisterCollisionGeometry(on, frame, _shape(g), f"g{k}", _properties(g, options))
    links, loops = scene.trees()
    for link in links:
        if link.joint is not None:
            _add_joint(plant, scene, link, bodies)
    if loops:  # AddBallConstraint: Drake 1.51.1 from PyPI ends in a segmentation fault at the first step
        raise Unsupported("constraint that closes a loop and survives a step")
    _filter(plant, graph, scene, bodies)
    return {i: body.index() for i, body in bodies.items()}


def _add_joint(plant: Any, scene: Scene, link: Link, bodies: dict[int, Any]) -> None:
    """Both frames coincide at the start, where coordinates are zero, in the axes of the body.

    A ball joint has the angles roll, pitch and yaw, which end at a pitch of 90 degrees. Chains of the scenes
    swing about y: that becomes the axis of roll.
    """
    from pydrake.multibody.tree import BallRpyJoint, FixedOffsetFrame, RevoluteJoint

    assert link.joint
    on_child = Frame(link.anchor(), (1.0, 0.0, 0.0, 0.0) if link.joint.kind == "hinge" else ROLL)
    on_parent = scene.between(link.body, link.parent) @ on_child
    parent = bodies.get(link.parent, plant.world_body())
    name = f"j{link.body}"
    f = plant.AddFrame(FixedOffsetFrame(f"{name}p", parent.body_frame(), _transform(on_parent)))
    m = plant.AddFrame(FixedOffsetFrame(f"{name}c", bodies[link.body].body_frame(), _transform(on_child)))
    if link.joint.kind == "hinge":
        plant.AddJoint(RevoluteJoint(name, f, m, link.axis()))
    else:
        plant.AddJoint(BallRpyJoint(name, f, m))


def _filter(plant: Any, graph: Any, scene: Scene, bodies: dict[int, Any]) -> None:
    """Keeps apart what may not touch: all pairs of kinds that share no bit."""
    from pydrake.geometry import CollisionFilterDeclaration, GeometrySet

    kinds: dict[tuple[int, int], list[Any]] = {}
    for g in scene.touching():
        if g.body in bodies:
            kinds.setdefault((g.category, g.mask), []).append(bodies[g.body])
    for (category, mask), some in kinds.items():
        if not category & mask:
            ids = [i for body in some for i in plant.GetCollisionGeometriesForBody(body)]
            graph.collision_filter_manager().Apply(
                CollisionFilterDeclaration().ExcludeWithin(GeometrySet(ids))
            )


def _set_start(d: _Drake) -> None:
    from pydrake.multibody.math import SpatialVelocity

    for link in d.scene.trees()[0]:
        b = d.scene.bodies[link.body]
        if link.joint is None:
            d.plant.SetFreeBodyPose(d.context, d.bodies[link.body], _transform(b.frame))
            velocity = SpatialVelocity(np.array(b.spin), np.array(b.velocity))
            d.plant.SetFreeBodySpatialVelocity(d.context, d.bodies[link.body], velocity)
            continue
        spin = d.scene.relative_spin(link)
        joint = d.plant.GetJointByName(f"j{link.body}")
        if link.joint.kind == "hinge":
            joint.set_angular_rate(d.context, float(link.axis() @ spin))
        else:
            joint.set_angular_velocity(d.context, matrix(ROLL).T @ spin)


def _read(plant: Any, scene: Scene) -> dict[int, Any]:
    from pydrake.multibody.parsing import Parser
    from pydrake.multibody.tree import BodyIndex

    if scene.keyframe:
        raise Unsupported("keyframe of a file")
    try:
        Parser(plant).AddModels(scene.path)
    except RuntimeError as error:
        raise Unsupported(f"reader for this file: {' '.join(str(error).split())[:160]}") from None
    names = {name: i for i, name in enumerate(scene.names)}
    found = {}
    for k in range(1, plant.num_bodies()):
        body = plant.get_body(BodyIndex(k))
        if body.name() in names:
            found[names[body.name()]] = body.index()
    if missing := set(range(len(names))) - set(found):
        raise Unsupported(f'body "{scene.names[min(missing)]}" of this file')
    return found
