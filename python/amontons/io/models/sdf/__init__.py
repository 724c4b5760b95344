"""Models and worlds of SDF (SDFormat 1.4 to 1.12), read into a builder."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from itertools import combinations
from pathlib import Path

from ....checks import listed
from ....errors import FileError, InputError
from ....limits import Limits
from ....model.builder import ModelBuilder
from ....model.mass import NOTHING, MassProperties
from ....model.model import Model
from ....model.transforms import Transform, rotate
from ....model.visuals import TriangleMesh
from ...files import told_at
from ..elements import Element
from ..issues import Issues
from ..places import is_special, require_inside
from ..size import Budget
from ..xml_lines import Faults, read_xml
from .frames import ROOT, Frame, Scope
from .joints import Joints
from .rules import judge
from .shapes import Shapes, colour, surface
from .values import find, flag, floats, pose, text, value, version

GRAVITY = (0.0, 0.0, -9.8)
"""m/s^2, SDF's default"""
DENSITY = 1000.0
"""kg/m^3, SDF's default"""
NEWEST = (1, 12)
"""The latest version of SDF that is read"""
DEEPEST = 20
"""Files that include each other in a row"""


@dataclass
class Reader:
    """The state of reading one file with all that it includes."""

    issues: Issues
    budget: Budget

    def file(self, path: Path) -> Element:
        """The root of a file; FileError unless it is SDF."""
        faults: Faults = []
        if is_special(path):
            raise FileError(f"{path}: is no regular file")
        root = read_xml(path, faults, self.budget)
        for element, what in faults:
            raise FileError(f"{element.place}: {what}; correct the file")
        if root.tag != "sdf":
            raise FileError(f"{root.place}: the root is {root}; it must be <sdf>")
        if version(root) > NEWEST:
            newest = ".".join(map(str, NEWEST))
            what = f"a version after {newest}, whose new elements are not known here"
            self.issues.add(root, f'version="{root.attributes["version"]}": {what}', "none")
        judge(root, self.issues)
        return root

    def scope(self, scope: Scope, content: Element, open_files: tuple[Path, ...], usual: str = ROOT) -> None:
        """Adds what an element holds to a scope. usual: the frame in which its parts are."""
        for e in content.children:
            match e.tag:
                case "link":
                    self._add(scope, e, "link", usual)
                    scope.links.append(e.name)
                case "joint" if e.child("child") is not None:
                    local, relative = pose(e)
                    child = text(e, "child")
                    frame = Frame(e, "joint", relative or child, local, child)
                    scope.add(e.name, frame)
                case "frame":
                    attached = e.attributes.get("attached_to", "")
                    local, relative = pose(e)
                    frame = Frame(e, "frame", relative or attached or usual, local, attached or usual)
                    scope.add(e.name, frame)
                case "model":
                    self.model(scope, e, open_files, usual)
                case "include":
                    self._include(scope, e, open_files, usual)

    def _add(self, scope: Scope, e: Element, kind: str, usual: str) -> None:
        local, relative = pose(e)
        scope.add(e.name, Frame(e, kind, relative or usual, local))

    def model(
        self, outer: Scope, e: Element, open_files: tuple[Path, ...], usual: str, given: Element | None = None
    ) -> None:
        """A model within a scope. given: the <include> that names and places it."""
        name = (text(given, "name") if given is not None else "") or e.name
        static = flag(e, "static") if given is None else flag(given, "static", default=flag(e, "static"))
        placed = text(given, "placement_frame") if given is not None else ""
        inner = Scope(
            e,
            f"{outer.prefix}{name}::" if name else outer.prefix,
            outer,
            outer.static or static,
            placed or e.attributes.get("placement_frame", ""),
            canonical=e.attributes.get("canonical_link", ""),
        )
        source = given if given is not None and given.child("pose") is not None else e
        local, relative = pose(source)
        outer.add(name, Frame(e, "model", relative or usual, local))
        outer.inner[name] = inner
        self.scope(inner, e, open_files)

    def _include(self, scope: Scope, e: Element, open_files: tuple[Path, ...], usual: str) -> None:
        uri = text(e, "uri")
        if uri.startswith(("http:", "https:")):
            self.issues.add(e, f"{uri}: nothing is fetched; download the model and name its folder", "large")
            return
        path = find(e, uri, self.budget.limits)
        if path.is_dir():
            path = _of_folder(path, e)
        require_inside(e, path, self.budget.limits)
        if path.resolve() in open_files or len(open_files) > DEEPEST:
            raise e.fault(f"the file {path} includes itself")
        root = self.file(path)
        models = root.all("model")
        if len(models) != 1:
            raise e.fault(f"{path} holds {len(models)} models; an include takes one")
        (model,) = models
        open_files = (*open_files, path.resolve())
        if e.attributes.get("merge") not in ("true", "1"):
            self.model(scope, model, open_files, usual, e)
            return
        proxy = f"_merged__{text(e, 'name') or model.name}__model__"
        local, relative = pose(e if e.child("pose") is not None else model)
        at = model.attributes.get("canonical_link", "") or next((x.name for x in model.all("link")), "")
        scope.add(proxy, Frame(e, "frame", relative or usual, local, at))
        self.scope(scope, model, open_files, proxy)


def _of_folder(folder: Path, asked: Element) -> Path:
    """The file of a model's folder: the latest one of its model.config, else model.sdf."""
    config = folder / "model.config"
    if config.is_file():
        found = re.findall(
            r"<sdf(?:\s+version\s*=\s*[\"']([\d.]+)[\"'])?\s*>\s*([^<]+?)\s*</sdf>",
            config.read_text(encoding="utf-8", errors="replace"),
        )
        if found:
            latest = max(found, key=lambda pair: [int(x) for x in pair[0].split(".") if x])
            return folder / latest[1]
    if not (folder / "model.sdf").is_file():
        raise asked.fault(f"{folder} has no model.config and no model.sdf")
    return folder / "model.sdf"


def read_sdf(path: Path, issues: Issues, limits: Limits) -> Model:
    """The model of a file of SDF: all models of its world, or its one model."""
    reader = Reader(issues, Budget(limits))
    root = reader.file(path)
    worlds = root.all("world")
    if len(worlds) > 1:
        raise FileError(f"{worlds[1].place}: a second world; keep one in the file")
    content = worlds[0] if worlds else root
    if not worlds and len(root.all("model")) > 1:
        raise FileError(f"{path}: holds several models without a world; put them into a <world>")
    scope = Scope(content)
    reader.scope(scope, content, (path.resolve(),))
    scope.place()
    if not scope.inner:
        raise FileError(f"{path}: holds no model; give it a <model>")
    if not worlds or len(scope.inner) == 1:
        _shorten(scope)
    return _Building(reader, scope, content).model()


def _shorten(scope: Scope) -> None:
    """Without the name of the only model in front of the names of its parts."""
    (only,) = scope.inner.values()
    cut = len(only.prefix)
    left = [only]
    while left:
        inner = left.pop()
        inner.prefix = inner.prefix[cut:]
        left += inner.inner.values()


class _Building:
    """Makes the parts of a model, scope by scope."""

    def __init__(self, reader: Reader, scope: Scope, content: Element) -> None:
        self.reader, self.scope, self.issues = reader, scope, reader.issues
        gravity = content.child("gravity")
        if gravity is None and (physics := content.child("physics")) is not None:
            gravity = physics.child("gravity")
        given = floats(gravity, 3) if gravity is not None else GRAVITY
        self.builder = ModelBuilder(gravity=given, friction_rule="minimum", trees="auto")
        self.shapes = Shapes(self.issues, reader.budget.limits)
        self.bodies: dict[tuple[int, str], int] = {}
        self.apart: set[tuple[int, int]] = set()
        self.guessed: list[str] = []

    def model(self) -> Model:
        for model in self.scope.inner.values():
            self._bodies(model)
            self._separate(model)
        joints = Joints(self.builder, self.bodies, self.issues)
        for scope in _all(self.scope):
            for frame in list(scope.frames.values()):
                if frame.kind == "joint":
                    joints.read(scope, frame.element)
        joints.finish()
        if self.guessed:
            names = listed([f'"{name}"' for name in self.guessed])
            self.issues.notes.append(
                f"links without <inertial> have SDF's mass of 1 kg and moments of 1 kg m^2: {names}"
            )
        with told_at(self.issues.path):
            return replace(self.builder.build(), unread=self.issues.unread())

    def _bodies(self, scope: Scope) -> None:
        for name in scope.links:
            element = scope.frames[name].element
            with element.told():
                self.bodies[id(scope), name] = self._body(scope, name, element)
        for inner in scope.inner.values():
            self._bodies(inner)

    def _body(self, scope: Scope, name: str, e: Element) -> int:
        motion = "static" if scope.static else "kinematic" if flag(e, "kinematic") else "dynamic"
        place = scope.in_world(name, e)
        solid = NOTHING if motion == "static" else self._mass(scope, name, e, place)
        body = self.builder.add_body(
            scope.prefix + name,
            position=place.position,
            orientation=place.rotation,
            mass=solid.mass or None,
            inertia=solid.inertia if solid.mass else None,
            centre_of_mass=solid.centre_of_mass if solid.mass else None,
            motion=motion,
            gravity_scale=1.0 if flag(e, "gravity", default=True) else 0.0,
        )
        for collision in e.all("collision"):
            self._collision(scope, name, body, collision, place, moves=motion == "dynamic")
        for visual in e.all("visual"):
            self._visual(scope, name, body, visual, place)
        return body

    def _mass(self, scope: Scope, name: str, e: Element, place: Transform) -> MassProperties:
        inertial = e.child("inertial")
        if inertial is None:
            self.guessed.append(scope.prefix + name)
        elif inertial.attributes.get("auto") in ("true", "1"):
            return self._of_shapes(scope, name, e, inertial, place)
        mass = value(inertial, "mass", 1.0)
        if not mass > 0:
            raise inertial.fault(f"the mass is {mass:g}; it must be positive")
        tensor = inertial.child("inertia") if inertial is not None else None
        xx, yy, zz = (value(tensor, tag, 1.0) for tag in ("ixx", "iyy", "izz"))
        xy, xz, yz = (value(tensor, tag, 0.0) for tag in ("ixy", "ixz", "iyz"))
        own = MassProperties(mass, (0.0, 0.0, 0.0), ((xx, xy, xz), (xy, yy, yz), (xz, yz, zz)))
        if inertial is None:
            return own
        return own.moved(place.inverse() @ scope.element_pose(inertial, name))

    def _of_shapes(
        self, scope: Scope, name: str, e: Element, inertial: Element, place: Transform
    ) -> MassProperties:
        total = NOTHING
        usual = value(inertial, "density", DENSITY)
        for collision in e.all("collision"):
            frame = place.inverse() @ scope.element_pose(collision, name)
            density = value(collision, "density", usual)
            for shape, inner in self.shapes.read(collision, moves=True):
                total = total + shape.mass_properties(density).moved(frame @ inner)
        if total.mass and inertial.child("mass") is not None:
            total = total.scaled(value(inertial, "mass", 1.0) / total.mass)
        return total

    def _collision(
        self, scope: Scope, name: str, body: int, e: Element, place: Transform, *, moves: bool
    ) -> None:
        frame = place.inverse() @ scope.element_pose(e, name)
        found = surface(e, self.issues)
        own = f"{scope.prefix}{name}::{e.name}"
        for number, (shape, inner) in enumerate(self.shapes.read(e, moves=moves)):
            at = frame @ inner
            direction = None if found.direction is None else rotate(frame.rotation, found.direction)
            self.builder.add_geom(
                body,
                shape,
                position=at.position,
                orientation=at.rotation,
                material=found.material,
                friction_direction=direction,
                category=found.bits,
                mask=found.bits,
                name=own if not number else f"{own}_{number}",
            )

    def _visual(self, scope: Scope, name: str, body: int, e: Element, place: Transform) -> None:
        """A visual that cannot be read is left out: pictures then show less."""
        quiet = Shapes(Issues(self.issues.path), self.shapes.limits, self.shapes.known)
        try:
            at = place.inverse() @ scope.element_pose(e, name)
            for shape, inner in quiet.read(e, moves=False):
                looks = (
                    TriangleMesh(shape.vertices, shape.triangles) if hasattr(shape, "triangles") else shape
                )
                frame = at @ inner
                if not shape.static_only or hasattr(shape, "triangles"):
                    self.builder.add_visual(
                        body, looks, position=frame.position, orientation=frame.rotation, colour=colour(e)
                    )
        except InputError:
            return

    def _separate(self, model: Scope) -> None:
        """Links of a model touch each other only if one of them, or the model, has self_collide."""
        links = [(scope, name) for scope in _all(model) for name in scope.links]
        if flag(model.element, "self_collide") or model.static:
            return
        for one, other in combinations(links, 2):
            if not any(flag(s.frames[n].element, "self_collide") for s, n in (one, other)):
                self.builder.exclude(*(self.bodies[id(s), n] for s, n in (one, other)))


def _all(scope: Scope) -> list[Scope]:
    found, left = [], [scope]
    while left:
        found.append(left.pop())
        left += found[-1].inner.values()
    return found
