"""A model file read and compiled by MuJoCo: all defaults, includes, frames and units resolved."""

from __future__ import annotations

import logging
import re
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from ...errors import FileError, InputError
from ...limits import DEFAULT, Limits, readable
from ...model.sensing import SENSORS
from ...model.transforms import Transform
from .elements import Element
from .issues import Issues
from .urdf import prepare
from .urdf_tree import macro
from .waiting import interruptible

ADVICE = {
    "mass and inertia of moving bodies": (
        "a body that moves needs mass and inertia: give it an <inertial> or a geom with mass"
    ),
    "inertia must satisfy A + B >= C": (
        "no solid has these moments of inertia (each is at most the sum of the other two)"
    ),
    "mesh volume is too small": 'no volume to take the mass from; give the mesh inertia="shell" or a mass',
    "no decoder found": "meshes are .stl, .obj or .msh files: convert it",
    "stl_decoder": "the file is damaged or cut off: export it again",
    "at least 4 vertices required": "its file holds no solid, or is cut off: export it again",
    "vertex coordinate": "its file is damaged: export it again",
    "required attribute missing": "give it",
    "missing element": "give it",
    "bad format in attribute": "give numbers",
    "does not have enough data": "give as many numbers as the attribute has",
    "must be positive": "give a size above 0",
    "repeated name": "rename one",
}


LOG = logging.getLogger("amontons")
"""A word on what takes seconds, for those who listen: logging.basicConfig(level="INFO")."""
MANY = 1000
"""Bodies of a model for which MuJoCo would reserve memory for constraints, by the square of their number."""
ARENA = 1 << 29
"""Bytes that it gets in place of that, or of what the file asks for: only the poses are computed."""
TOLD = ("deprecated", "equal lower and upper limits", "arena memory", "buffer is full")
"""Parts of MuJoCo's warnings that are of no interest, or told in other words."""


@dataclass
class Compiled:
    """MuJoCo's model at its initial configuration, with the elements it came from."""

    path: Path
    root: Element
    mujoco: ModuleType
    spec: Any
    model: Any
    data: Any
    issues: Issues
    limits: Limits = DEFAULT
    massless: frozenset[str] = frozenset()
    """names of links that get a mass for the compiler alone, see `without_massless`"""
    _known_places: dict[str, dict[int, tuple[str, int | None]]] = field(default_factory=dict)
    _by_line: dict[str, dict[int | str, list[Element]]] = field(default_factory=dict)

    def name(self, kind: str, index: int) -> str:
        """MuJoCo's name of a body, geom, jnt, ..., empty if it has none."""
        address = getattr(self.model, f"name_{kind}adr")[index]
        names = self.model.names
        return names[address : names.index(b"\0", address)].decode(errors="replace")

    def element(self, kind: str, index: int) -> Element | None:
        """The element of the file that a body, geom, ... came from, as far as it can be found."""
        if (listed := self._listed(kind)) is not None:
            return listed[index]
        if index not in (places := self._places(kind)):
            return None
        name, line = places[index]
        return self._find(kind, name, line)

    def _places(self, kind: str) -> dict[int, tuple[str, int | None]]:
        """Name and line of the things of a kind by MuJoCo's index."""
        if self.spec is None:
            return {}
        if kind not in self._known_places:
            self._known_places[kind] = {
                item.id: (
                    _name_of(item),
                    int(line[1]) if (line := re.search(r"line (\d+)", item.info)) else None,
                )
                for item in getattr(self.spec, SPECS[kind])
            }
        return self._known_places[kind]

    def _find(self, kind: str, name: str, line: int | None) -> Element | None:
        """The element of a kind on the line; with the name, if there are several or no line is known."""
        if kind not in self._by_line:
            # The content of <default> has the same tags, but makes nothing.
            makers = _outside_defaults(self.root)
            found = self._by_line[kind] = {}
            for element in (e for e in makers if e.tag in TAGS[kind]):
                found.setdefault(element.line, []).append(element)
                found.setdefault(f"name {element.name}", []).append(element)
        fitting = self._by_line[kind].get(line if line is not None else f"name {name}", [])
        named = [e for e in fitting if e.name == name]
        if named and (name or line is not None):
            return named[0]
        return fitting[0] if fitting and line is not None else None

    def _listed(self, kind: str) -> list[Element] | None:
        """The elements of a kind that is not nested, in MuJoCo's order; None if some are made otherwise."""
        if kind not in LISTS:
            return None
        section, tag, count = LISTS[kind]
        found = [e for s in self.root.children if s.tag == section for e in s.children if tag in ("", e.tag)]
        return found if len(found) == getattr(self.model, count) else None

    def refuse(self, kind: str, index: int, what: str, effect: str = "small") -> None:
        """Lists what is known only after compiling, unless the scan of the file has listed its cause.

        effect: how much of the motion it changes, one of EFFECTS.
        """
        element = self.element(kind, index)
        if element is None or not self.issues.lists(element):
            name = "" if element else f'{TAGS[kind][0]} "{self.name(kind, index)}": '
            self.issues.add(element, name + what, effect)

    def enabled(self, flag: str) -> bool:
        """Whether <option><flag> leaves a part of the dynamics switched on."""
        bits = self.mujoco.mjtDisableBit
        disabled = int(self.model.opt.disableflags)
        if flag in ("equality", "frictionloss", "limit", "contact") and disabled & bits.mjDSBL_CONSTRAINT:
            return False
        return not disabled & getattr(bits, f"mjDSBL_{flag.upper()}")

    def body_frame(self, body: int) -> Transform:
        """In the parent, at the initial configuration."""
        return transform(self.model.body_pos[body], self.model.body_quat[body])


LISTS = {
    "actuator": ("actuator", "", "nactuator"), "eq": ("equality", "", "neq"),
    "tendon": ("tendon", "", "ntendon"),
    "pair": ("contact", "pair", "npair"), "exclude": ("contact", "exclude", "nexclude"),
    "sensor": ("sensor", "", "nsensor"),
}  # fmt: skip
SPECS = {
    "body": "bodies", "geom": "geoms", "jnt": "joints", "actuator": "actuators", "eq": "equalities",
    "pair": "pairs", "exclude": "excludes", "tendon": "tendons", "sensor": "sensors",
}  # fmt: skip
TAGS = {
    "body": ("body", "link"), "geom": ("geom", "collision"), "jnt": ("joint", "freejoint"),
    "actuator": ("general", "motor", "position", "velocity", "intvelocity", "damper", "cylinder"),
    "tendon": ("spatial", "fixed"), "eq": ("connect", "weld", "joint", "mimic", "tendon"),
    "pair": ("pair",), "exclude": ("exclude",), "sensor": tuple(SENSORS),
}  # fmt: skip


def transform(position: Any, quaternion: Any) -> Transform:
    q = np.asarray(quaternion, dtype=np.float64)
    return Transform(tuple(np.asarray(position).tolist()), tuple((q / np.linalg.norm(q)).tolist()))


def _outside_defaults(root: Element) -> Iterator[Element]:
    left = [root]
    while left:
        element = left.pop()
        if element.tag != "default":
            yield element
            left += reversed(element.children)


def import_mujoco() -> ModuleType:
    try:
        import mujoco
    except ImportError as error:
        raise InputError(
            "MJCF and URDF files are read by MuJoCo, which is not installed "
            f"({error}): pip install amontons[models]"
        ) from None
    return mujoco


def _name_of(item: Any) -> str:
    try:
        return str(item.name)
    except UnicodeDecodeError:  # MuJoCo takes any bytes
        return ""


def compile_file(
    path: Path,
    root: Element,
    issues: Issues,
    floating_base: bool | None,
    limits: Limits = DEFAULT,
    text: str = "",
) -> Compiled:
    """Raises FileError naming file, line and element if MuJoCo refuses the file.

    text: what it takes in place of that of the file, if any.
    """
    mujoco = import_mujoco()
    said: list[str] = []
    massless: frozenset[str] = frozenset()
    with _warnings_to(mujoco, said):
        try:
            spec = mujoco.MjSpec.from_string(text) if text else mujoco.MjSpec.from_file(str(path))
            for texture in spec.textures:
                _without_files(mujoco, texture)
            if root.tag == "robot":
                massless = prepare(spec, root, issues, floating_base, limits)
            if len(spec.bodies) > MANY:
                LOG.info("%s: MuJoCo compiles %d bodies, which takes seconds", path, len(spec.bodies))
            if len(spec.bodies) > MANY or spec.memory > ARENA:
                spec.memory = ARENA
            model = interruptible(spec.compile)
            data = mujoco.MjData(model)
            mujoco.mj_kinematics(model, data)
        except FileError:
            raise
        # RuntimeError: what MuJoCo itself has no name for.
        except (ValueError, TypeError, UnicodeError, MemoryError, RuntimeError, mujoco.FatalError) as error:
            raise FileError(_translated(str(error), path, root)) from None
        _override_contacts(mujoco, model)
    for text in said:  # of what it left out, such as a <mimic> of nothing, or takes for a mistake
        element = _mentioned(text, root)
        if not any(known in text for known in TOLD) and not (element and issues.lists(element)):
            effect = "none" if "conflict" in text else "small"  # an option of an attached file is not taken
            issues.add(element, f"MuJoCo warns: {' '.join(text.split())}", effect)
    return Compiled(issues.path, root, mujoco, spec, model, data, issues, limits, massless)


def open_compiled(path: Path, limits: Limits) -> Compiled:
    """A .mjb: MuJoCo's model without the elements that it came from."""
    mujoco = import_mujoco()
    if limits.folder is not None:
        raise FileError(
            f"{path}: a .mjb cannot be confined to a folder; load the XML that it came from, "
            "or drop limits.folder"
        )
    if (size := path.stat().st_size) > limits.memory:
        raise FileError(f"{path}: has {readable(size)}, more than limits.memory = {readable(limits.memory)}")
    said: list[str] = []
    with _warnings_to(mujoco, said):
        try:
            model = mujoco.MjModel.from_binary_path(str(path))
            data = mujoco.MjData(model)
            mujoco.mj_kinematics(model, data)
        except (ValueError, TypeError, MemoryError, RuntimeError, mujoco.FatalError) as error:
            reason = " ".join([*said, str(error)][0].split())
            raise FileError(
                f"{path}: is no compiled model of MuJoCo {mujoco.__version__} ({reason})"
            ) from None
        _override_contacts(mujoco, model)
    root = Element("mujoco", {}, path, 0)
    return Compiled(path, root, mujoco, None, model, data, Issues(path), limits)


def _without_files(mujoco: ModuleType, texture: Any) -> None:
    """A texture of one colour in place of its files, which nothing here looks at and which may be missing."""
    if texture.file or any(texture.cubefiles):
        texture.file, texture.cubefiles = "", [""] * len(texture.cubefiles)
        texture.builtin = mujoco.mjtBuiltin.mjBUILTIN_FLAT
        texture.width = texture.height = 1


def _override_contacts(mujoco: ModuleType, model: Any) -> None:
    """Replaces the contact parameters of all geoms by the o_* parameters of <option>, if the flag override is
    set.
    Margins of two geoms add; of the two sliding frictions of a pair a geom has one."""
    option = model.opt
    if not int(option.enableflags) & mujoco.mjtEnableBit.mjENBL_OVERRIDE:
        return
    model.geom_friction[:] = option.o_friction[[0, 2, 3]]
    model.pair_friction[:] = option.o_friction
    model.geom_margin[:], model.pair_margin[:] = 0.5 * option.o_margin, option.o_margin
    for kind in ("geom", "pair"):
        getattr(model, f"{kind}_solref")[:] = option.o_solref
        getattr(model, f"{kind}_solimp")[:] = option.o_solimp


@contextmanager
def _warnings_to(mujoco: ModuleType, said: list[str]) -> Iterator[None]:
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(lambda text: said.append(str(text)))
    try:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            yield
        said += [str(w.message) for w in caught]
    finally:
        mujoco.set_mju_user_warning(before)


def _mentioned(text: str, root: Element) -> Element | None:
    """The first element of which the text quotes the name or a file."""
    quoted = {Path(q).name for q in re.findall(r"'([^']+)'|: (\S+) \.", text) for q in q if q}
    for element in root.walk():
        files = (element.attributes.get(key) for key in ("file", "filename", "link"))
        if quoted & {element.name, *(Path(f).name for f in files if f)} - {""}:
            return element
    return None


def _mesh_name(element: Element) -> str:
    """MuJoCo's name of the mesh of a file."""
    return Path(element.attributes.get("filename", "")).stem if element.tag == "mesh" else ""


def _located(what: str, where: str, root: Element) -> Element | None:
    """The element at the place that MuJoCo tells, by line or by name."""
    line = re.search(r"line (\d+)", where)
    quoted = re.search(r"^(name )?'([^']*)'", where)
    name = quoted[2] if quoted else ""
    if not line:
        return next((e for e in root.walk() if name and name in (e.name, _mesh_name(e))), None)
    at = [e for e in root.walk() if e.line == int(line[1])]
    by_name = [e for e in at if name and name in (e.tag, e.name)]
    # If a line has several elements: the one that contains the quoted text of the message, or the innermost.
    words = set(re.findall(r"'([^']+)'", what))
    by_value = [e for e in at if words & set(e.attributes.values())]
    return next(iter(by_name or by_value or at[::-1]), None)


def _translated(message: str, path: Path, root: Element) -> str:
    """MuJoCo's message with file and line in front: `Error: what\\nElement name 'x', id 0, line 5`."""
    text = re.sub(r"^(XML )?Error: (Error: )?", "", message.strip())
    what, _, where = text.partition("\nElement ")
    element = _located(what, where, root) or _mentioned(what, root)
    if element:
        what += macro(element)
    advice = next((text for key, text in ADVICE.items() if key in what), "")
    place = f"{element.place}: {element}" if element else f"{path}"
    return f"{place}: {' '.join(what.split())}" + (f"; {advice}" if advice else "")
