"""Checks that the layers of ARCHITECTURE.md hold, in C++ and in Python; prints every violation.

C++ (include/amontons, src): see layers_cpp.py. bindings may use everything but Eigen.
Python: io < scenes < report < cli are leaves: a module imports no leaf above itself, the rest of the package
imports none of them, and modules import each other without a cycle. Two exceptions: amontons/__init__.py
re-exports io and scenes, and a function may import io when it is called (Problem.write).
"""

import ast
import sys
from collections.abc import Iterator
from pathlib import Path

from cycles import Graph, find_cycle
from layers_cpp import check_cpp

LEAVES = ["io", "scenes", "report", "cli"]


def imports(tree: ast.Module, module: str, is_package: bool) -> Iterator[tuple[str, bool, int]]:
    """(imported dotted name, whether inside a function, line); `if TYPE_CHECKING:` does not count."""
    package = module.split(".") if is_package else module.split(".")[:-1]

    def visit(node: ast.AST, lazy: bool) -> Iterator[tuple[str, bool, int]]:
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test):
            for child in node.orelse:
                yield from visit(child, lazy)
            return
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield alias.name, lazy, node.lineno
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) + 1 - node.level] if node.level else []
            prefix = ".".join([*base, *([node.module] if node.module else [])])
            for alias in node.names:
                yield f"{prefix}.{alias.name}", lazy, node.lineno
        lazy = lazy or isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda)
        for child in ast.iter_child_nodes(node):
            yield from visit(child, lazy)

    yield from visit(tree, False)


def leaf_rank(module: str) -> int:
    """0 for the body of the package, 1, 2, ... for its leaves; python -m amontons is the last one."""
    if module == "amontons.__main__":
        return len(LEAVES)
    parts = module.split(".")
    return LEAVES.index(parts[1]) + 1 if len(parts) > 1 and parts[1] in LEAVES else 0


def check_python(root: Path) -> Iterator[str]:
    files = {}
    for file in sorted((root / "python" / "amontons").rglob("*.py")):
        parts = file.relative_to(root / "python").with_suffix("").parts
        files[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = file
    known = {*files, "amontons._core"}  # the compiled module imports nothing of the package
    graph: Graph = {}
    for module, file in files.items():
        for name, lazy, line in imports(ast.parse(file.read_text()), module, file.name == "__init__.py"):
            if name.split(".")[0] != "amontons":
                continue
            target = name if name in known else name.rpartition(".")[0]
            if not lazy and target in known and target != module:
                graph.setdefault(module, set()).add(target)
            allowed = (lazy and name.startswith("amontons.io")) or (
                module == "amontons" and name.startswith(("amontons.io", "amontons.scenes"))
            )
            if leaf_rank(name) > leaf_rank(module) and not allowed:
                where = f"{file.relative_to(root)}:{line}"
                yield f"{where}: {module} may not import {name} (leaves: {' < '.join(LEAVES)})"
    if cycle := find_cycle(graph):
        yield "import cycle: " + " -> ".join(cycle)


def violations(root: Path) -> list[str]:
    return [*check_cpp(root), *check_python(root)]


if __name__ == "__main__":
    found = violations(Path(__file__).resolve().parent.parent)
    print("\n".join(found) if found else "layers hold")
    sys.exit(bool(found))
