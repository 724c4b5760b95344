"""Elements of a model file that are not read, collected so that the user sees all of them at once."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Protocol

from ...checks import shortened
from ...errors import InputError, ModelWarning, UnsupportedWarning
from ...model.presets import EFFECTS, Unread
from ...model.shapes import Mesh, Shape


class Place(Protocol):
    """Where something stands in a file: an element of XML, a prim of USD."""

    @property
    def place(self) -> str: ...


SHOWN, WIDTH = 5, 140
"""Lines of each part of the warning, and characters of a line; `Model.unread` has all."""


@dataclass(frozen=True)
class Dent:
    """A mesh that is not convex, and what is to be listed where its hull collides in its place."""

    hull: Shape
    mesh: Mesh
    where: Place | None
    what: str
    effect: str


@dataclass
class Issues:
    """Findings about the file `path`, each naming a line and an element."""

    path: Path
    found: list[Unread] = field(default_factory=list)
    """in the order in which they were found"""
    notes: list[str] = field(default_factory=list)
    """what was decided for the user where the file leaves it open, with the option that changes it"""

    dents: dict[int, Dent] = field(default_factory=dict)
    """by the id() of the hull"""

    _known: set[Unread] = field(default_factory=set, init=False)
    _listed: set[tuple[str, str]] = field(default_factory=set, init=False)

    def add(self, where: Place | None, what: str, effect: str = "small") -> None:
        """Once per place and text: one element of a <replicate> stands for all its copies.

        effect: how much of the motion what is not read changes, one of EFFECTS.
        """
        place, element = (where.place, str(where)) if where is not None else (str(self.path), "")
        entry = Unread(place, element, what, effect)
        if entry not in self._known:
            self._known.add(entry)
            self._listed.add((entry.place, entry.element))
            self.found.append(entry)

    def dent(self, hull: Shape, mesh: Mesh, where: Place | None, what: str, effect: str = "small") -> None:
        """Remember a hull that fills dents of its mesh, until it is known whether it is to be divided."""
        self.dents[id(hull)] = Dent(hull, mesh, where, what, effect)

    def lists(self, where: Place) -> bool:
        """Whether something of this element is listed."""
        return (where.place, str(where)) in self._listed

    def unread(self) -> tuple[Unread, ...]:
        """All of it, worst first, else in the order of the file."""
        return tuple(sorted(self.found, key=lambda entry: EFFECTS.index(entry.effect)))

    def report(self, *, strict: bool) -> None:
        """Warns once with the whole list, or raises InputError with what changes the motion if strict."""
        unread = self.unread()
        changing = [entry for entry in unread if entry.changes_motion]
        if strict and changing:
            lines = "\n".join(f"  {entry}" for entry in changing)
            raise InputError(
                f"{self.path}: {_things(changing)} not supported:\n{lines}\n"
                "Change the file, or load it without them: strict=False."
            )
        parts = [*self.notes]
        if unread:
            parts.append(f"{_things(unread)} not read (model.unread has the list).")
        if changing:
            parts += ["Changes the motion; strict=True refuses it:", *self._lines(changing)]
        if len(changing) < len(unread):
            parts += ["Does not change the motion:", *self._lines(unread[len(changing) :])]
        if parts:
            category = UnsupportedWarning if unread else ModelWarning
            warnings.warn(f"{self.path}: " + "\n".join(parts), category, stacklevel=4)

    def _lines(self, entries: Iterable[Unread]) -> Iterator[str]:
        """A line for all entries that say the same, in the order of the first of each."""
        alike: dict[str, list[Unread]] = {}
        for entry in entries:
            alike.setdefault(entry.what, []).append(entry)
        for group in list(alike.values())[:SHOWN]:
            first = replace(group[0], place=self._line(group[0].place))
            more = f" (and {len(group) - 1} more like it)" if len(group) > 1 else ""
            yield f"  {shortened(str(first), WIDTH - len(more))}{more}"
        if len(alike) > SHOWN:
            yield f"  and {sum(map(len, list(alike.values())[SHOWN:]))} more"

    def _line(self, place: str) -> str:
        """A place in the file whose name stands at the top of the message, or in another one."""
        file, _, line = place.rpartition(":")
        if file == str(self.path):
            return f"line {line}" if line.isdigit() else line
        return "" if place == str(self.path) else f"{Path(file).name}:{line}"


def _things(entries: Iterable[Unread]) -> str:
    count = len(list(entries))
    return f"{count} things are" if count > 1 else "1 thing is"
