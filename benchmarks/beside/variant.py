"""Settings of an engine, and who says that they are good ones."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True)
class Variant:
    """`options` are those of the adapter; `manual` is the page that advises them."""

    name: str
    options: Mapping[str, Any] = field(default_factory=dict, compare=False)
    manual: str = ""
    tuned: bool = False
