"""Cycles of a graph of names."""

from collections.abc import Iterator
from graphlib import CycleError, TopologicalSorter

Graph = dict[str, set[str]]


def find_cycles(graph: Graph) -> Iterator[list[str]]:
    """Cycles, each a closed path, such that cutting the last edge of each leaves none."""
    rest = {node: set(others) for node, others in graph.items()}
    while True:
        try:
            TopologicalSorter({node: sorted(rest[node]) for node in sorted(rest)}).prepare()
        except CycleError as error:
            cycle: list[str] = error.args[1][::-1]
        else:
            return
        yield cycle
        rest[cycle[-2]].remove(cycle[-1])
