"""All families by name. A new one: a module with `FAMILIES`, its line here."""

from __future__ import annotations

from collections.abc import Sequence
from importlib import import_module

from .family import Family

MODULES = ("soak.readers", "soak.misuse", "soak.odd_scenes", "soak.names_and_links", "soak.pages")


def families(modules: Sequence[str] = MODULES) -> dict[str, Family]:
    found = [family for name in modules for family in import_module(name).FAMILIES]
    return {family.name: family for family in found}
