"""Cycles of a graph of names."""

from collections.abc import Iterator

Graph = dict[str, set[str]]


def find_cycle(graph: Graph) -> list[str]:
    """One cycle of the graph as a closed path, or an empty list."""
    done: set[str] = set()

    def visit(node: str, path: list[str]) -> list[str]:
        if node in path:
            return [*path[path.index(node) :], node]
        if node in done:
            return []
        for other in sorted(graph.get(node, ())):
            if cycle := visit(other, [*path, node]):
                return cycle
        done.add(node)
        return []

    return next((cycle for node in sorted(graph) if (cycle := visit(node, []))), [])


def find_cycles(graph: Graph) -> Iterator[list[str]]:
    """Cycles such that cutting the last edge of each leaves none."""
    rest = {node: set(others) for node, others in graph.items()}
    while cycle := find_cycle(rest):
        yield cycle
        rest[cycle[-2]].remove(cycle[-1])
