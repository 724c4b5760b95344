"""Identifiers of USD for names of ours."""

from __future__ import annotations

import re
from collections.abc import Iterable


def identifiers(names: Iterable[str], taken: Iterable[str] = ()) -> list[str]:
    """One for each name, all different, and none of those that are taken."""
    used = set(taken)
    found = []
    for k, name in enumerate(names):
        word = re.sub(r"\W", "_", name, flags=re.ASCII) or "part"
        word = f"_{word}" if word[0].isdigit() else word
        base = word
        while word in used:
            word, k = f"{base}_{k}", k + 1
        used.add(word)
        found.append(word)
    return found
