"""What a model file asks for that is not supported, collected so that the user sees all of it at once."""

from __future__ import annotations

import warnings
from dataclasses import dataclass, field
from pathlib import Path

from ...errors import InputError, UnsupportedWarning
from .xml_lines import Element


@dataclass
class Issues:
    """Findings about the file `path`, each naming a line and an element."""

    path: Path
    found: list[tuple[str, str]] = field(default_factory=list)
    """(place, what) in the order in which they were found"""

    def add(self, where: Element | None, what: str) -> None:
        """Once per place and text: one element of a <replicate> stands for all its copies."""
        place = f"{where.place}: {where}" if where is not None else str(self.path)
        if (place, what) not in self.found:
            self.found.append((place, what))

    def lists(self, where: Element) -> bool:
        """Whether something of this element is listed."""
        return any(place == f"{where.place}: {where}" for place, _ in self.found)

    def report(self, *, strict: bool) -> None:
        """Raises InputError with the whole list if strict, else warns once."""
        if not self.found:
            return
        count = f"{len(self.found)} things are" if len(self.found) > 1 else "1 thing is"
        lines = "".join(f"\n  {place}: {what}" for place, what in self.found)
        if strict:
            raise InputError(
                f"{self.path}: {count} not supported:{lines}\n"
                "Change the file, or load it without them by strict=False."
            )
        warnings.warn(
            f"{self.path}: {count} not supported and left out:{lines}", UnsupportedWarning, stacklevel=4
        )
