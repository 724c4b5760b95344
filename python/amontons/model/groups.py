"""What hangs together."""

from __future__ import annotations

from collections.abc import Iterable, Sequence


def connected(count: int, pairs: Iterable[Sequence[int]]) -> list[int]:
    """Of each of so many things the first one of those that pairs connect with it; -1 is the last one."""
    first = list(range(count))

    def find(k: int) -> int:
        while first[k] != k:
            first[k] = first[first[k]]
            k = first[k]
        return k

    for pair in pairs:
        low, high = sorted(map(find, pair))
        first[high] = low
    return list(map(find, first))
