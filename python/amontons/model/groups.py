"""Connected components."""

from __future__ import annotations

from collections.abc import Iterable, Sequence


def connected(count: int, pairs: Iterable[Sequence[int]]) -> list[int]:
    """The least number that pairs connect with each of 0 .. count - 1; in a pair, -1 means count - 1."""
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
