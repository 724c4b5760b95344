"""Models made in code: bodies, shapes and joints, one call each."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import product
from typing import Any

from .. import _core
from ..checks import Numbers, about, changed, chosen, positive, shown, unit_vector, vector3
from ..errors import InputError
from ..guidance import guided
from .collection import NAMED, Parts, require_movable
from .composing import Added, Seat, bottom, parts_of, top, whole_keyframe
from .drive_builder import DriveBuilder
from .fields import inertia_matrix
from .mass import MassProperties
from .model import FRICTION_RULES, TREE_TERMS, TREES, Model, no_model
from .parts import NO_FLUID, OWN, WORLD, Body, Bond, Coupling, Fluid, Geom, Material, Motor, PairMaterial
from .sensing import Site
from .shapes import Plane, Shape
from .transforms import IDENTITY, Transform, add, conjugate, rotate
from .visuals import TriangleMesh, Visual

EVERYTHING = 2**32 - 1
"""Bits of a floor: what touches anything touches it."""


@guided
class ModelBuilder(DriveBuilder):
    """Collects bodies, geoms, joints, tendons and actuators, then makes a Model of them.

    gravity: m/s^2. friction_rule: how the frictions of two surfaces combine, "geometric_mean", "maximum",
    "minimum" or "mean". fluid: what bodies of added models that feel one move through. trees: "none", or
    "auto" for bodies in coordinates of their joints, see `Model.trees`; None: "auto" with the first added
    model that has it.

    All of them are named by the index that their add_* function returns or by their name; None
    or "world" is the world. Raises InputError naming the thing and the remedy; a call that fails adds
    nothing.

    >>> builder = ModelBuilder()
    >>> ground = builder.add_floor()
    >>> ball = builder.add_body("ball", shape=shapes.Sphere(0.1), mass=1, position=(0, 0, 0.1))
    >>> model = builder.build()
    >>> model.body_names
    ('ball',)
    """

    def __init__(
        self,
        *,
        gravity: Numbers = (0.0, 0.0, -9.81),
        friction_rule: str = "geometric_mean",
        fluid: Fluid = NO_FLUID,
        trees: str | None = None,
    ) -> None:
        self._gravity = vector3("gravity", gravity)
        chosen("friction rule", friction_rule, FRICTION_RULES)
        self._friction_rule = friction_rule
        if trees is not None:
            chosen("trees", trees, TREES, TREE_TERMS)
        self._trees = trees
        self._fluid = fluid
        super().__init__()

    def add_body(
        self,
        name: str | None = None,
        *,
        position: Numbers = (0.0, 0.0, 0.0),
        orientation: Numbers = IDENTITY,
        shape: Shape | None = None,
        density: float | None = None,
        mass: float | None = None,
        inertia: Any = None,
        centre_of_mass: Numbers | None = None,
        motion: str = "dynamic",
        linear_velocity: Numbers = (0.0, 0.0, 0.0),
        angular_velocity: Numbers = (0.0, 0.0, 0.0),
        material: Material | None = None,
        friction_direction: Numbers | None = None,
        gravity_scale: float = 1.0,
    ) -> int:
        """Add a body and return its index.

        position, orientation: of the body frame in the world (m; unit quaternion w, x, y, z).
        shape: carried at the origin of the body frame, with `material` and, if that has friction_across,
        friction_direction; more by `add_geom`.
        density (kg/m^3) or mass (kg): the other mass properties follow from the shape, unless
        inertia, (3,) or (3, 3) about the centre of mass in body axes (kg m^2), and centre_of_mass (m, body
        frame) are given. A dynamic body without any gets its mass from geoms with a density.
        motion: "dynamic"; "kinematic", which keeps the velocity that the state holds; or "static".
        linear_velocity (of the frame's origin), angular_velocity: initial, world axes (m/s, rad/s).
        gravity_scale: its weight over mass times gravity: 0 floats.

        >>> builder = ModelBuilder()
        >>> crate = builder.add_body("crate", shape=shapes.Box((0.2, 0.2, 0.1)), density=500)
        >>> round(builder.build().bodies[crate].mass, 6)  # 500 kg/m^3 of 0.4 x 0.4 x 0.2 m
        16.0
        """
        name = self._new_name("body", name)
        who = f'body "{name}"'
        geom = None
        if shape is not None:
            with about(who):
                name_of_geom = self._new_name("geom", None)
                geom = Geom(
                    name_of_geom,
                    len(self._parts.bodies),
                    shape=shape,
                    material=material or Material(),
                    friction_direction=friction_direction,  # type: ignore[arg-type]
                )
            require_movable(who, shape, motion)
        elif material is not None or friction_direction is not None:
            given = "material" if material is not None else "friction_direction"
            raise InputError(f"{who}: {given} is given without a shape; give it to add_geom")
        solid = _mass_properties(who, shape, density, mass, inertia, centre_of_mass)
        body = Body(
            name=name,
            motion=motion,
            mass=solid.mass,
            centre_of_mass=solid.centre_of_mass,
            inertia=solid.inertia,
            pose=Transform.named(who, position, orientation),
            gravity_scale=gravity_scale,
            linear_velocity=linear_velocity,  # type: ignore[arg-type]
            angular_velocity=angular_velocity,  # type: ignore[arg-type]
        )
        if motion == "static" and (any(body.linear_velocity) or any(body.angular_velocity)):
            raise InputError(f"{who}: a fixed body has no velocity; make it kinematic")
        if geom is not None:
            self._append(geom)
        return self._append(body)

    def add_geom(
        self,
        body: int | str | None,
        shape: Shape,
        *,
        position: Numbers = (0.0, 0.0, 0.0),
        orientation: Numbers = IDENTITY,
        material: Material | None = None,
        name: str | None = None,
        surface_velocity: Numbers = (0.0, 0.0, 0.0),
        surface_spin: Numbers = (0.0, 0.0, 0.0),
        category: int = 1,
        mask: int = 1,
        density: float | None = None,
        friction_direction: Numbers | None = None,
    ) -> int:
        """Add a shape to a body or link, or to the world, and return the index of the geom.

        position, orientation: of the shape in the frame of the body or link. surface_velocity: of the
        surface relative to the body, in body axes (m/s); surface_spin: of its turning about the geom's origin
        (rad/s).
        category, mask: bits; two geoms may touch if the category of one shares a bit with the mask of the
        other.
        density: adds the mass of this shape to the body (kg/m^3); without it the geom has no mass.
        friction_direction: in body axes, along which `material.friction` is; friction_across needs it.

        >>> builder = ModelBuilder()
        >>> ground = builder.add_geom(None, shapes.Plane(), material=Material(friction=0.3))
        >>> builder.build().geoms[ground].material.friction
        0.3
        """
        name = self._new_name("geom", name)
        who = f'geom "{name}"'
        local = Transform.named(who, position, orientation)
        geom = self._referred(
            Geom(
                name,
                body,  # type: ignore[arg-type]
                local,
                shape=shape,
                material=material or Material(),
                surface_velocity=surface_velocity,  # type: ignore[arg-type]
                surface_spin=surface_spin,  # type: ignore[arg-type]
                category=category,
                mask=mask,
                friction_direction=friction_direction,  # type: ignore[arg-type]
            )
        )
        if density is not None and geom.body != WORLD:
            solid = shape.mass_properties(positive(f"{who}: density", density))
            _add_mass(self._parts.bodies, geom.body, solid.moved(geom.frame))
            if geom.link != OWN:
                _add_mass(self._parts.links, geom.link, solid.moved(local))
        return self._append(geom)

    def add_visual(
        self,
        body: int | str | None,
        shape: Shape | TriangleMesh,
        *,
        position: Numbers = (0.0, 0.0, 0.0),
        orientation: Numbers = IDENTITY,
        colour: Numbers | None = None,
    ) -> None:
        """Let a body, or the world, look like this; pictures then do not show its geoms.

        position, orientation: in the body frame (m; unit quaternion w, x, y, z). colour: red, green, blue and
        opacity from 0 to 1; None is that of the kind of shape.
        """
        frame = Transform.named("visual", position, orientation)
        self.add(Visual("", body, frame, shape=shape, colour=colour))  # type: ignore[arg-type]

    def add_site(
        self,
        body: int | str | None,
        *,
        position: Numbers = (0.0, 0.0, 0.0),
        orientation: Numbers = IDENTITY,
        name: str | None = None,
    ) -> int:
        """Add a frame to look at, fixed in a body or in the world, and return its index.

        position, orientation: in the body frame (m; unit quaternion w, x, y, z).
        `Simulation.kinematics.sites` tells where it is and how it moves.

        >>> builder = ModelBuilder()
        >>> arm = builder.add_body("arm", shape=shapes.Capsule(0.02, 0.3), mass=1)
        >>> tip = builder.add_site(arm, position=(0, 0, 0.3), name="tip")
        >>> print(Simulation(builder.build()).kinematics.site("tip")["position"])
        [0.  0.  0.3]
        """
        name = self._new_name("site", name)
        frame = Transform.named(f'site "{name}"', position, orientation)
        return self.add(Site(name, body, frame))  # type: ignore[arg-type]

    def add_coupling(
        self,
        joint_a: int | str | None = None,
        joint_b: int | str | None = None,
        *,
        dof_a: int = 0,
        dof_b: int = 0,
        tendon_a: int | str | None = None,
        tendon_b: int | str | None = None,
        coefficients: Numbers = (0.0, 1.0),
        compliance: float = 0.0,
        backlash: float = 0.0,
        name: str | None = None,
    ) -> int:
        """Couple two coordinates: coordinate a = c0 + c1 b + c2 b^2 ... of coordinate b.

        A coordinate is that of a joint's degree of freedom (dof_a, dof_b say which), or the length of a
        tendon. Neither joint_b nor tendon_b: coordinate a stays at coefficients[0]. compliance: m/N; 0 is
        rigid. backlash: free travel of coordinate a (m or rad), half of it on either side.
        """
        name = self._new_name("coupling", name)
        who = f'coupling "{name}"'
        for joint, tendon in ((joint_a, tendon_a), (joint_b, tendon_b)):
            if joint is not None and tendon is not None:
                raise InputError(f"{who}: a joint and a tendon in one place; give one of them")
        if joint_a is None and tendon_a is None:
            raise InputError(f"{who}: give the joint or tendon that follows")
        a, b, line_a, line_b = (WORLD if x is None else x for x in (joint_a, joint_b, tendon_a, tendon_b))
        coupling = Coupling(name, a, dof_a, b, dof_b, coefficients, compliance, line_a, line_b, backlash)  # type: ignore[arg-type]
        return self.add(coupling)

    def set_motor(self, joint: int | str, motor: Motor, *, dof: int = 0) -> None:
        """Give a joint's degree of freedom a motor, in place of the one that it has.

        Where motor.max_effort is infinite, that of the present one stays: URDF's <limit effort>.
        """
        j = self._index("joint", joint)
        former = self._parts.joints[j]
        who = f'set_motor: joint "{former.name}"'
        if not isinstance(motor, Motor):
            raise InputError(f'{who}: motor is {shown(motor)}; give a Motor, as Motor("position", kp=100)')
        if isinstance(dof, bool) or not isinstance(dof, int) or not 0 <= dof < len(former.dofs):
            raise InputError(
                f"{who} has {len(former.dofs)} degrees of freedom; dof = {shown(dof)} is none of them, which "
                "count from 0"
            )
        if math.isinf(motor.max_effort):
            motor = replace(motor, max_effort=former.dofs[dof].motor.max_effort)
        dofs = list(former.dofs)
        dofs[dof] = replace(dofs[dof], motor=motor)
        self._parts.joints[j] = changed(former, dofs=tuple(dofs))

    def set_pair_material(self, geom_a: int | str, geom_b: int | str, material: Material) -> None:
        """Give the contact of two geoms a material of its own, in place of what their materials make."""
        a, b = self._index("geom", geom_a), self._index("geom", geom_b)
        geoms = [self._parts.geoms[i] for i in (a, b)]
        with about(f'pair "{geoms[0].name}", "{geoms[1].name}"'):
            pair = PairMaterial(a, b, material)
            if material.friction_across is not None and not any(geom.friction_direction for geom in geoms):
                raise InputError("friction_across needs a friction_direction of one of the two geoms")
        self._append(pair)

    def exclude(self, body_a: int | str | None, body_b: int | str | None) -> None:
        """Let two bodies or links never touch."""
        (a, _, link_a), (b, _, link_b) = (self._mount(body, OWN) for body in (body_a, body_b))
        if a == b:
            raise InputError("exclude: a body never touches itself; give two bodies")
        if link_a == link_b == OWN:
            self._parts.excluded_bodies.append((a, b))
            return
        geoms = list(enumerate(self._parts.geoms))
        on = [
            [g for g, geom in geoms if geom.body == body and link in (OWN, geom.link)]
            for body, link in ((a, link_a), (b, link_b))
        ]
        self._parts.excluded_geoms += product(*on)

    def add_bond(
        self,
        body_a: int | str | None,
        body_b: int | str | None,
        *,
        point: Numbers,
        normal: Numbers,
        tension: float,
        opening: float,
    ) -> int:
        """Let two bodies hold together at a point as mortar does, until it breaks for good: see `parts.Bond`.

        point, normal: in the world, of the poses that the bodies have now; the normal from B to A (m). None
        as a body is the world. tension: N. opening: distance of the two sides at which it breaks (m).
        Returns the index of the bond. The bodies need geoms that touch there: they bear the pull.
        """
        a, b = (self._mount(body, OWN)[0] for body in (body_a, body_b))
        if a == b:
            raise InputError("add_bond: a body needs no bond to itself; give two bodies")
        poses = [self.pose(i) for i in (a, b)]
        place = vector3("add_bond: point", point)
        axis = rotate(conjugate(poses[1].rotation), unit_vector("add_bond: normal", normal))
        ends = [pose.inverse()(place) for pose in poses]
        return self._append(Bond(a, b, *ends, axis, tension, opening))

    def add_floor(
        self, *, height: float = 0.0, material: Material | None = None, name: str | None = None
    ) -> int:
        """Add a horizontal plane to the world, which every shape touches that may touch anything.

        height: m. Returns the index of the geom, called "floor" unless there is one already.
        """
        free = "floor" not in self._names["geom"]
        return self.add_geom(
            None,
            Plane(),
            position=(0.0, 0.0, height),
            material=material,
            name="floor" if name is None and free else name,
            category=EVERYTHING,
            mask=EVERYTHING,
        )

    def add_model(
        self,
        model: Model,
        *,
        position: Numbers = (0.0, 0.0, 0.0),
        orientation: Numbers = IDENTITY,
        prefix: str = "",
        parent: int | str | None = None,
        on: str | None = None,
    ) -> Added:
        """Add all parts of a model: bodies, geoms, joints, tendons, couplings, actuators, materials,
        keyframes.

        position, orientation: of the model's world in the world of the builder, or in the frame of `parent`
        (m; unit quaternion w, x, y, z).
        prefix: in front of all its names. Keyframes of the same name become one; where a part has none of
        that name, it stands as at the start.
        parent: the body or link that takes the place of the model's world: what was fixed or jointed to it is
        so to the parent, and what was free is held by a fixed joint of its first body.
        on: the geom or body of the builder on which the model stands: position[2] is then measured from
        the highest point there to the lowest of its shapes, both at the initial poses.

        Gravity, friction rule and fluid are those of the builder; so is `trees`, unless it is None there.
        Returns the indices that the parts got.
        """
        if not isinstance(model, Model):
            raise no_model("add_model: model", model)
        if not isinstance(prefix, str):
            raise InputError(f"add_model: prefix is {shown(prefix)}; give a string")
        if on is not None and parent is not None:
            raise InputError("add_model: on and parent are both given; keep one of them")
        place = Transform.named("add_model", position, orientation)
        if on is not None:
            place = changed(place, position=add(place.position, (0.0, 0.0, self._rise(model, place, on))))
        carrier, frame, link = self._mount(parent, OWN)
        place = place if frame is None else frame @ place
        holder = None if carrier == WORLD else self._parts.bodies[carrier]
        carries = holder is not None and holder.motion != "static"
        seat = Seat(carrier, place, place if holder is None else holder.pose @ place, carries, link)
        parts, added = parts_of(model, seat, prefix, self._parts, self._holding_name)
        self._require_new(parts)
        if holder is not None and carries:
            for geom in parts.geoms:
                if geom.body == carrier:
                    require_movable(f'geom "{geom.name}" of body "{holder.name}"', geom.shape, holder.motion)
        self._take(parts)
        if self._trees is None and model.trees != "none":
            self._trees = model.trees
        return added

    def build(self) -> Model:
        """The model of all that was added, checked as a whole. The builder can go on and build again."""
        for body in self._parts.bodies:
            if body.motion == "dynamic" and body.mass == 0:
                raise InputError(
                    f'body "{body.name}" is dynamic but has no mass: give mass= and inertia=, a shape with '
                    'density= or mass=, or motion="static"'
                )
        lists = {name: tuple(things) for name, things in self._parts.lists().items()}
        model = Model(
            self._gravity, self._friction_rule, fluid=self._fluid, trees=self._trees or "none", **lists
        )
        keyframes = (whole_keyframe(name, model, parts) for name, parts in self._parts.keyframes.items())
        return changed(model, keyframes=tuple(keyframes))

    def _rise(self, model: Model, place: Transform, on: str) -> float:
        """How far up a model must go to stand on a geom or body."""
        if not isinstance(on, str):
            raise InputError(f"add_model: on is {shown(on)}; give the name of a geom or body")
        if on in self._names["geom"]:
            below = [self._parts.geoms[self._names["geom"][on]]]
        elif on in self._names["body"]:
            below = [geom for geom in self._parts.geoms if geom.body == self._names["body"][on]]
        else:
            raise InputError(f'add_model: on="{on}" is no geom or body of the builder; add it first')
        turned = [changed(b, pose=Transform((0, 0, 0), place.rotation) @ b.pose) for b in model.bodies]
        rise = top(below, self._parts.bodies) - bottom(model.geoms, turned)
        if not math.isfinite(rise):
            raise InputError(
                f'add_model: on="{on}" needs shapes on both that can touch; give position instead'
            )
        return rise

    def _holding_name(self, body: str) -> str:
        name = f"{body}_mount"
        while name in self._names["joint"]:
            name += "_"
        return name

    def _require_new(self, parts: Parts) -> None:
        """Nothing may be added when a name is taken."""
        added = {kind: getattr(parts, name) for kind, name in NAMED.items()}
        added["link"] = [*parts.bodies, *parts.links]
        for kind, things in added.items():
            known = dict(self._names[kind])
            if kind in ("body", "link"):
                known |= self._names["body"] | self._names["link"]
            for thing in things:
                if thing.name in known or thing.name == "world":
                    raise InputError(
                        f'add_model: there is a {kind} "{thing.name}" already; give the model a prefix='
                    )
                known[thing.name] = 0

    def _take(self, parts: Parts) -> None:
        for name, things in parts.lists().items():
            if name in NAMED.values():
                for thing in things:
                    self._append(thing)
            else:
                getattr(self._parts, name).extend(things)
        for name, keyframes in parts.keyframes.items():
            self._parts.keyframes.setdefault(name, []).extend(keyframes)


@guided
def on_floor(model: Model, *, material: Material | None = None) -> Model:
    """The model on a plane z = 0, moved up or down so that its lowest shape touches it at the initial poses.

    Gravity and friction rule stay those of the model, indices and names too; its keyframes move with it.
    material: of the plane. Raises InputError if nothing in the model can touch it.

    >>> builder = ModelBuilder()
    >>> ball = builder.add_body("ball", shape=shapes.Sphere(0.5), mass=1, position=(0, 0, 3))
    >>> on_floor(builder.build()).bodies[ball].pose.position
    (0.0, 0.0, 0.5)
    """
    if not isinstance(model, Model):
        raise no_model("on_floor: model", model)
    low = bottom(model.geoms, model.bodies)
    if not math.isfinite(low):
        raise InputError("on_floor: no body of the model has a shape that can touch a floor; add a geom")
    builder = ModelBuilder(
        gravity=model.gravity, friction_rule=model.friction_rule, fluid=model.fluid, trees=model.trees
    )
    builder.add_model(model, position=(0.0, 0.0, -low))
    builder.add_floor(material=material)
    return builder.build()


def _mass_properties(
    who: str, shape: Shape | None, density: float | None, mass: float | None, inertia: Any, centre: Any
) -> MassProperties:
    """Mass properties from the arguments of add_body, zero by default."""
    given = {
        "shape": shape,
        "density": 0.0 if density is None else positive(f"{who}: density", density),
        "mass": 0.0 if mass is None else positive(f"{who}: mass", mass),
        "inertia": None if inertia is None else inertia_matrix(f"{who}: inertia", inertia),
        "centre_of_mass": None if centre is None else vector3(f"{who}: centre_of_mass", centre),
    }
    return MassProperties.of(_core.solid_of(who, **given))


def _add_mass(things: list[Any], index: int, solid: MassProperties) -> None:
    """Adds the mass of a solid to a body or link of a list."""
    former = things[index]
    solid = MassProperties(former.mass, former.centre_of_mass, former.inertia) + solid
    things[index] = changed(former, **vars(solid))
