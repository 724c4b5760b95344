"""Public names of extras (files, pictures, studies, the viewer, devices), which load with their first use.

So `import amontons` loads the engine alone.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Any

from .field_help import describe_fields


def later(door: str, homes: Mapping[str, str]) -> Callable[[str], Any]:
    """`__getattr__` of the module `door` for names that the modules `homes` have, imported when needed."""

    def __getattr__(name: str) -> Any:
        if name not in homes:
            raise AttributeError(f"module {door!r} has no attribute {name!r}")
        value = getattr(import_module(f"{__package__}.{homes[name]}"), name)
        describe_fields([value])
        setattr(sys.modules[door], name, value)
        return value

    return __getattr__
