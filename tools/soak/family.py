"""What the soak is made of: families of cases, each case a pure function of a seed and its number."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any
from zlib import crc32

import numpy as np

Measures = dict[str, Any]
"""`outcome` ("accepted", "refused", ...) is counted; of every number the largest is kept for the table."""


class Failure(Exception):
    """What must not happen and raised nothing by itself: accepted nonsense, a broken promise."""

    def __init__(self, kind: str, text: str) -> None:
        super().__init__(text)
        self.kind = kind


@dataclass
class Case:
    """One case; its parts (mutations, bodies, calls) draw from streams of their own, so that shrinking can
    leave out any of them and the others stay what they are."""

    family: str
    seed: int
    index: int
    folder: Path
    """empty, for the files of the case"""
    dropped: frozenset[int] = frozenset()
    parts: int = field(default=0, init=False)

    def rng(self, part: int = -1) -> np.random.Generator:
        """The stream of a part; -1 is that of the case as a whole."""
        return np.random.default_rng([self.seed, crc32(self.family.encode()), self.index, part + 1])

    def kept(self, part: int) -> bool:
        """Whether a part takes place; ask once for each, numbered from 0 on."""
        self.parts = max(self.parts, part + 1)
        return part not in self.dropped


@dataclass(frozen=True)
class Family:
    """Cases of one kind.

    run: makes and judges a case in its folder. Any exception is a failure, as are crashes, more memory than
    allowed and more time than allowed; a refusal that is meant is caught and returned as an outcome.
    replay: judges a file (or folder) that a case left behind; what shrinking and the tests call.
    main: the file of the folder of a case that shrinking may cut; "" for none.
    """

    name: str
    what: str
    run: Callable[[Case], Measures]
    replay: Callable[[Path], Measures] | None = None
    main: str = ""
    cpu_s: float = 20.0
    """processor time of a case at most (s), on any machine that builds the project"""
    memory: int = 1 << 30
    """bytes beyond what the process has before the case"""
    share: float = 1.0
    """of the time of a run, relative to other families"""

    def sanitized(self) -> Family:
        """The same for a module with a sanitizer, which is slower; memory is not limited, as it reserves
        terabytes of addresses."""
        return replace(self, cpu_s=6 * self.cpu_s)
