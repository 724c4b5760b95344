"""Choices that URDF leaves to its reader: folders of meshes, links that stay links, and a free or fixed
root.
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from ...checks import listed, shortened
from ...limits import DEFAULT, Limits
from ...model import collada, stl_text
from ...model.transforms import Transform, axis_angle, multiply
from .elements import Element
from .issues import Issues
from .massless import stand_in
from .places import inside
from .xml_lines import is_file

NONE = 1e-15  # kg m^2: what MuJoCo takes for no inertia
FORMATS = (".stl", ".obj", ".msh")
DENSITY = 1000.0
"""kg/m^3, of what has a mass and no size; MuJoCo's default of geoms"""


def prepare(
    spec: Any, root: Element, issues: Issues, floating_base: bool | None, limits: Limits = DEFAULT
) -> frozenset[str]:
    """Edits the parsed, not yet compiled model: no visuals, meshes found, links kept, base free or not.

    Returns the links that have a mass for the compiler alone.
    """
    _find_meshes(spec, root, issues, limits)
    massless = stand_in(spec, issues)
    spec.compiler.fusestatic = False
    for body in spec.worldbody.bodies:
        # A link of a floating joint to the root called world is free already.
        if list(body.joints) or not _is_root(body.name, root):
            continue
        floats, how = _base(body, root)
        if floating_base is None:
            issues.notes.append(f'the base link "{body.name}" {how} it')
        if floats if floating_base is None else floating_base:
            body.add_freejoint()
    # Some files give their link called world a mass, which has no meaning.
    spec.worldbody.explicitinertial, spec.worldbody.fullinertia = False, [np.nan] * 6
    for body in spec.bodies[1:]:
        if body.explicitinertial:
            _check_inertia(body, root, issues, moves=bool(list(body.joints)))
    return massless


def _base(body: Any, root: Element) -> tuple[bool, str]:
    """Whether a root link moves, where the user has not said so, and what a note says of it.

    Robots that walk or drive often have a root without <inertial> that carries the trunk by a fixed joint,
    as some libraries take no mass of a root. A mass of 0 is Bullet's way to fix it.
    """
    link = _link(body.name, root)
    if link is not None and link.child("inertial") is None and _carries_mass(body, root):
        return True, "has no <inertial> and moves freely, as of most robots; floating_base=False fixes"
    if _has_mass(body.name, root):
        return True, "moves freely; floating_base=False fixes"
    return False, "is fixed; floating_base=True frees"


def _carries_mass(body: Any, root: Element) -> bool:
    """Whether a link, or one that fixed joints hold on it, has a mass: of its own or from its shapes."""
    link = _link(body.name, root)
    from_shapes = link is not None and link.child("inertial") is None and bool(list(body.geoms))
    fixed = (child for child in body.bodies if not list(child.joints))
    return from_shapes or _has_mass(body.name, root) or any(_carries_mass(child, root) for child in fixed)


def judge_masses(root: Element, masses: dict[str, float], issues: Issues) -> None:
    """Says which links have the mass of their shapes. masses: of the links that move, by name (kg)."""
    links = (e for e in root.children if e.tag == "link" and e.child("inertial") is None)
    found = {link.name: masses[link.name] for link in links if masses.get(link.name, 0.0) > 0}
    if root.tag == "robot" and found:
        heaviest = sorted(found, key=lambda name: -found[name])
        shown = listed([f'"{name}" {found[name]:.3g} kg' for name in heaviest])
        issues.notes.append(
            f"links without <inertial> have the mass of their shapes at {DENSITY:g} kg/m^3, "
            f"{sum(found.values()):.3g} kg of {sum(masses.values()):.3g} kg: {shown}"
        )


def _find_meshes(spec: Any, root: Element, issues: Issues, limits: Limits) -> None:
    for geom in list(spec.geoms):
        if not geom.contype and not geom.conaffinity:  # MuJoCo's form of <visual>
            spec.delete(geom)
    used = {geom.meshname for geom in spec.geoms}
    for mesh in list(spec.meshes):
        file = _find_mesh(mesh.file, spec.meshdir, root, issues, limits) if mesh.name in used else None
        if file is None:
            for geom in [geom for geom in spec.geoms if geom.meshname == mesh.name]:
                spec.delete(geom)
            spec.delete(mesh)
        else:
            mesh.file = str(file)
            if file.suffix.lower() == ".dae":
                mesh.file, mesh.uservert = "", collada.read(file).ravel()
            elif (corners := stl_text.read(file)) is not None:
                mesh.file = ""
                mesh.uservert, mesh.userface = corners.ravel(), np.arange(len(corners))
            # Masses are those of <inertial>; MuJoCo's default refuses meshes that are not closed.
            mesh.inertia = type(mesh.inertia).mjMESH_INERTIA_CONVEX
    spec.compiler.meshdir = ""


def _check_inertia(body: Any, root: Element, issues: Issues, *, moves: bool) -> None:
    """Lists moments of inertia of no solid, and takes their mean instead, as MuJoCo's balanceinertia does."""
    xx, yy, zz, xy, xz, yz = body.fullinertia
    moments = np.linalg.eigvalsh([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    if np.isnan(moments).any():
        return
    if np.abs(moments).max() <= NONE:  # a frame or a point
        body.fullinertia = [np.nan] * 6
        body.inertia = [0.0] * 3
        if moves and body.mass > NONE:
            radius = (body.mass / (4 / 3 * math.pi * DENSITY)) ** (1 / 3)
            body.inertia = [0.4 * body.mass * radius**2] * 3
            issues.add(
                _link(body.name, root),
                f"it has a mass of {body.mass:.4g} kg and no moments of inertia; those of a ball of "
                f"{DENSITY:g} kg/m^3 are taken. Correct them",
            )
    elif moments[0] <= NONE or moments[0] + moments[1] < moments[2]:
        link = _link(body.name, root)
        shown = ", ".join(f"{x:.4g}" for x in moments)
        issues.add(
            link,
            f"no solid has its principal moments of inertia, {shown}. Their mean is taken; correct them",
        )
        body.fullinertia = [max(moments.mean(), 2 * NONE)] * 3 + [0.0] * 3


def urdf_range(joint: Element | None) -> float | None:
    """Where a revolute or prismatic joint of a URDF without a range stays, 0 without limits; else None."""
    if joint is None or joint.parent is None or joint.parent.tag != "robot":
        return None
    if joint.attributes.get("type") not in ("revolute", "prismatic"):
        return None
    lower, upper = _limits(joint)
    return lower if lower == upper else None


def _limits(joint: Element) -> tuple[float, float]:
    limit = joint.child("limit")
    lower, upper = (((limit and limit.numbers(name)) or [0.0])[0] for name in ("lower", "upper"))
    return lower, upper


def judge_limits(root: Element, issues: Issues) -> None:
    """Lists limits in the wrong order, and says which joints have no range.

    The URDF specification asks for a range, 0 to 0 by default; MuJoCo takes equal limits for none.
    """
    for e in root.children:
        lower, upper = _limits(e)
        if e.tag == "joint" and e.attributes.get("type") in ("revolute", "prismatic") and lower > upper:
            issues.add(e, f"lower {lower:g} is above upper {upper:g}; it moves without limits, as in MuJoCo")
    names = [f'"{e.name}"' for e in root.children if e.tag == "joint" and urdf_range(e) is not None]
    if names:
        issues.notes.append(
            "joints without a range of motion stay where they are, as the URDF specification has it, while "
            f"in MuJoCo they move without limits: {listed(names)}; give lower < upper, or the type continuous"
        )


FIELDS = {
    "lateral_friction": "friction", "spinning_friction": "torsional_friction",
    "rolling_friction": "rolling_friction", "restitution": "restitution",
}  # fmt: skip


def contact_values(link: str, root: Element) -> dict[str, float]:
    """The fields of the material of a link that its <contact> gives: Bullet's, in SI units."""
    element = _link(link, root) if root.tag == "robot" else None
    contact = element.child("contact") if element else None
    if contact is None:
        return {}
    given = {child.tag: (child.numbers("value") or [math.nan])[0] for child in contact.children}
    values = {field: given[tag] for tag, field in FIELDS.items() if given.get(tag, -1.0) >= 0}
    if given.get("stiffness", 0.0) > 0:
        values["compliance"] = 1 / given["stiffness"]
        values["relaxation_time"] = max(given.get("damping", 0.0), 0.0) / given["stiffness"]
    return values


def fixed_joint_names(root: Element) -> dict[str, str]:
    """The fixed joints of a URDF by their child link; MuJoCo forgets them."""
    joints = [e for e in root.children if root.tag == "robot" and e.attributes.get("type") == "fixed"]
    ends = ((e.child("child"), e) for e in joints if e.tag == "joint")
    return {child.attributes.get("link", ""): e.name for child, e in ends if child is not None}


def origin_of(element: Element) -> Transform:
    """Its <origin>: xyz, and the angles rpy about the fixed axes x, y and z one after the other."""
    origin = element.child("origin")
    values = {}
    for name in ("xyz", "rpy"):
        given = origin is not None and name in origin.attributes
        values[name] = (origin.numbers(name) or []) if origin and given else [0.0, 0.0, 0.0]
        if len(values[name]) != 3:
            raise ValueError(f"{name} is not three numbers")
    xyz, rpy = values["xyz"], values["rpy"]
    rotation = (1.0, 0.0, 0.0, 0.0)
    for axis, angle in zip(np.eye(3).tolist(), rpy, strict=True):
        rotation = multiply(axis_angle(axis, angle), rotation)
    return Transform(tuple(xyz), rotation)


def _link(name: str, root: Element) -> Element | None:
    return root.named("link", name)


def _has_mass(name: str, root: Element) -> bool:
    link = _link(name, root)
    inertial = link.child("inertial") if link else None
    mass = inertial.child("mass") if inertial else None
    return bool(mass and (mass.numbers("value") or [0.0])[0] > 0)


def _is_root(name: str, root: Element) -> bool:
    children = (e.child("child") for e in root.children if e.tag == "joint")
    return name not in {c.attributes.get("link") for c in children if c is not None}


def _find_mesh(name: str, meshdir: str, root: Element, issues: Issues, limits: Limits) -> Path | None:
    """None, and listed, if it is of a kind that cannot be read."""
    places = [c for c in candidates(name, meshdir, issues.path.parent) if inside(c, limits)]
    found = next((c for c in places if is_file(c)), None)
    element = next(
        (e for e in root.walk() if e.tag == "mesh" and e.attributes.get("filename", "").endswith(name)), root
    )
    if found is None:
        looked = ", ".join(shortened(str(place)) for place in places) or "nothing"
        confined = (
            f" within {limits.folder}, to which Limits(folder=...) confines it" if limits.folder else ""
        )
        raise element.fault(
            f'the file "{shortened(name)}" does not exist{confined}; looked for '
            f"{looked}. For package:// set ROS_PACKAGE_PATH to the folders that hold the packages, or "
            "AMENT_PREFIX_PATH, which a workspace of ROS 2 sets"
        )
    if found.suffix.lower() == ".dae" and collada.read(found) is not None:
        return found.resolve()
    if found.suffix.lower() not in FORMATS:
        issues.add(element, f"{found.name} is no {', '.join(FORMATS)} file; convert it", "large")
        return None
    return found.resolve()


def _folders(variable: str) -> list[str]:
    return [folder for folder in os.environ.get(variable, "").split(os.pathsep) if folder]


def candidates(name: str, meshdir: str, folder: Path) -> Iterator[Path]:
    """Where a mesh may be: as given, then as MuJoCo looks for it, in meshdir and without the folders."""
    plain = name.removeprefix("file://")
    if name.startswith(("package:", "model:")):
        package, _, rest = name.partition(":")[2].strip("/").partition("/")
        plain = rest
        paths = [Path(p) for p in _folders("ROS_PACKAGE_PATH")]
        paths += [Path(p) / "share" for p in _folders("AMENT_PREFIX_PATH")]
        parents = (folder.absolute(), *folder.absolute().parents)
        yield from (p / rest for p in (*paths, *parents) if p.name == package)
        yield from (p / package / rest for p in (*paths, *parents))
    yield folder / plain
    if meshdir:
        yield folder / meshdir / plain
        yield folder / meshdir / Path(plain).name
    yield folder / Path(plain).name
