"""Scopes of SDF: a model with the frames that it names, and the models within it.

Every pose is computed in the frame of its model, from the frames that its element names. A cycle of frames
that are relative to each other is a fault of the file. (SDFormat, Pose Frame Semantics.)
"""

from __future__ import annotations

from dataclasses import dataclass, field

from ....errors import FileError
from ....model.transforms import ORIGIN, Transform
from ..elements import Element
from .values import pose

ROOT = "__model__"


@dataclass
class Frame:
    """A named frame of a model: that of a link, a joint, a <frame>, or a model within."""

    element: Element
    kind: str
    relative_to: str
    local: Transform
    attached_to: str = ""


@dataclass
class Scope:
    """A model, or the world: names are looked up here; "a::b" is b of the model a."""

    element: Element
    prefix: str = ""
    parent: Scope | None = None
    static: bool = False
    placement: str = ""
    frames: dict[str, Frame] = field(default_factory=dict)
    inner: dict[str, Scope] = field(default_factory=dict)
    links: list[str] = field(default_factory=list)
    canonical: str = ""
    pose: Transform = ORIGIN
    """of the model frame in the world, known when all frames are"""
    _open: list[str] = field(default_factory=list)
    _known: dict[str, Transform] = field(default_factory=dict)

    def add(self, name: str, frame: Frame) -> None:
        if not name or name in self.frames:
            taken = "has the name of another one in its model; rename one"
            what = taken if name else "has no name; give it one"
            raise FileError(f"{frame.element.place}: {frame.element} {what}")
        self.frames[name] = frame

    def local(self, name: str, asked: Element) -> Transform:
        """A frame in that of the model; FileError naming the element that asked for it."""
        if name in ("", ROOT) or (name == "world" and self.parent is None):
            return ORIGIN
        if name not in self._known:
            self._known[name] = self._found(name, asked)
        return self._known[name]

    def _found(self, name: str, asked: Element) -> Transform:
        first, _, rest = name.partition("::")
        if rest and first in self.inner:
            return self.local(first, asked) @ self.inner[first].local(rest, asked)
        frame = self.frames.get(name)
        if frame is None:
            raise asked.fault(f'there is no frame "{name}" in {self.element}; correct the name')
        if name in self._open:
            way = " -> ".join([*self._open, name])
            raise asked.fault(f"frames are relative to each other: {way}")
        self._open.append(name)
        found = self.local(frame.relative_to, frame.element) @ frame.local
        if frame.kind == "model":
            inner = self.inner[name]
            found = found @ inner.local(inner.placement, frame.element).inverse()
        self._open.pop()
        return found

    def place(self) -> None:
        """Finds the poses of the models within, outer ones first."""
        for name, scope in self.inner.items():
            scope.pose = self.pose @ self.local(name, scope.element)
            scope.place()

    def in_world(self, name: str, asked: Element) -> Transform:
        return self.pose @ self.local(name, asked)

    def element_pose(self, element: Element, usual: str) -> Transform:
        """The place of something with a <pose> in the world; `usual`: its frame if it names none."""
        local, relative = pose(element)
        return self.in_world(relative or usual, element) @ local

    def link(self, name: str, asked: Element, depth: int = 0) -> tuple[Scope, str] | None:
        """The link that a frame is attached to, and its scope; None for the world."""
        if name == "world":
            return None
        if depth > len(self.frames) + 100:
            raise asked.fault("frames are attached to each other without a link")
        first, _, rest = name.partition("::")
        if rest and first in self.inner:
            return self.inner[first].link(rest, asked, depth + 1)
        if name in ("", ROOT):
            if self.parent is None:
                return None
            return self.link(self.canonical, asked, depth + 1) if self.canonical else _first(self, asked)
        frame = self.frames.get(name)
        if frame is None:
            raise asked.fault(f'no link or frame "{name}" in {self.element}; correct the name')
        if frame.kind == "link":
            return self, name
        if frame.kind == "model":
            return self.inner[name].link(ROOT, asked, depth + 1)
        return self.link(frame.attached_to, asked, depth + 1)


def _first(scope: Scope, asked: Element) -> tuple[Scope, str] | None:
    """The first link of a model, else that of the models within it."""
    if scope.links:
        return scope, scope.links[0]
    for inner in scope.inner.values():
        return inner.link(ROOT, asked)
    raise asked.fault(f"{scope.element} has no link")
