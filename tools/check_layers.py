"""Checks that the layers of ARCHITECTURE.md hold, in C++ and in Python; prints every violation.

C++ (include/amontons, src): a folder may include only itself and the folders before it in LAYERS; no cycle
among files; Eigen only in sources, so that it never reaches a consumer. bindings may use everything.
Python: a module may import its own package and those before it in PACKAGES, wherever in the file the import
stands, and modules import each other without a cycle; what stands below `if TYPE_CHECKING:` does not count.
amontons/__init__.py is the door and may import all up to DOOR.
"""

import ast
import re
import sys
from collections.abc import Iterator
from pathlib import Path

LAYERS = ["base", "cones", "vi", "solvers", "collision", "multibody"]
# Python packages from the bottom up; those in one bracket do not know each other. Modules beside them are
# below all, but for those that only give a package another name.
PACKAGES = [("model", "problem"), ("simulation",), ("io",), ("scenes",), ("report",), ("cli",)]
ALIASES = {"amontons.shapes": "model", "amontons.__main__": "cli"}
DOOR = "scenes"
INCLUDE = re.compile(r'^\s*#\s*include\s*([<"])([^>"]+)[>"]', re.MULTILINE)

Graph = dict[str, set[str]]


def find_cycle(graph: Graph) -> list[str]:
    """One cycle of the graph as a closed path, or an empty list."""
    done: set[str] = set()

    def visit(node: str, path: list[str]) -> list[str]:
        if node in path:
            return [*path[path.index(node) :], node]
        if node in done:
            return []
        done.add(node)
        for other in sorted(graph.get(node, ())):
            if cycle := visit(other, [*path, node]):
                return cycle
        return []

    return next((cycle for node in sorted(graph) if (cycle := visit(node, []))), [])


def layer(path: Path) -> str | None:
    """The folder of a C++ file below include/amontons or src, given relative to the root."""
    depth = 2 if path.parts[0] == "include" else 1
    return path.parts[depth] if len(path.parts) > depth + 1 else None


def resolve(root: Path, source: Path, name: str) -> Path | None:
    for folder in (source.parent, Path("include"), Path("src")):
        if (root / folder / name).is_file():
            return Path((root / folder / name).resolve().relative_to(root.resolve()))
    return None


def check_cpp(root: Path) -> Iterator[str]:
    graph: Graph = {}
    for folder in ("include", "src"):
        for file in sorted((root / folder).rglob("*.[hc]pp")):
            source = file.relative_to(root)
            own = layer(source)
            if own not in LAYERS:
                yield f"{source}: not in a folder of the layer list {', '.join(LAYERS)}"
                continue
            for bracket, name in INCLUDE.findall(file.read_text()):
                if name.startswith("Eigen/") and folder == "include":
                    yield f"{source}: includes <{name}>; Eigen is for sources only"
                if bracket == "<" and not name.startswith("amontons/"):
                    continue
                target = resolve(root, source, name)
                if target is None:
                    yield f'{source}: "{name}" not found beside it, in include or in src'
                    continue
                graph.setdefault(str(source), set()).add(str(target))
                other = layer(target)
                if other in LAYERS and LAYERS.index(other) > LAYERS.index(own):
                    yield f"{source}: layer {own} may not include {name} of layer {other}"
                if folder == "include" and target.parts[0] == "src":
                    yield f"{source}: a public header may not include {name} of src"
    if cycle := find_cycle(graph):
        yield "include cycle: " + " -> ".join(cycle)


def imports(tree: ast.Module, module: str, is_package: bool) -> Iterator[tuple[str, int]]:
    """(imported dotted name, line), inside functions too; `if TYPE_CHECKING:` does not count."""
    package = module.split(".") if is_package else module.split(".")[:-1]

    def visit(node: ast.AST) -> Iterator[tuple[str, int]]:
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test):
            for child in node.orelse:
                yield from visit(child)
            return
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield alias.name, node.lineno
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) + 1 - node.level] if node.level else []
            prefix = ".".join([*base, *([node.module] if node.module else [])])
            for alias in node.names:
                yield f"{prefix}.{alias.name}", node.lineno
        for child in ast.iter_child_nodes(node):
            yield from visit(child)

    yield from visit(tree)


def package_of(module: str) -> str:
    """The package of PACKAGES to which a module belongs, "" for one beside them."""
    part = ALIASES.get(module) or module.partition(".")[2].partition(".")[0]
    return part if rank(part) else ""


def rank(package: str) -> int:
    return next((k for k, packages in enumerate(PACKAGES, 1) if package in packages), 0)


def may_import(module: str, other: str) -> bool:
    own, theirs = package_of(module), package_of(other)
    if module == "amontons":
        return rank(theirs) <= rank(DOOR)
    return own == theirs or rank(theirs) < rank(own)


def check_python(root: Path) -> Iterator[str]:
    files = {}
    for file in sorted((root / "python" / "amontons").rglob("*.py")):
        parts = file.relative_to(root / "python").with_suffix("").parts
        files[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = file
    known = {*files, "amontons._core"}  # the compiled module imports nothing of the package
    order = " < ".join(", ".join(packages) for packages in PACKAGES)
    graph: Graph = {}
    for module, file in files.items():
        for name, line in imports(ast.parse(file.read_text()), module, file.name == "__init__.py"):
            if name.split(".")[0] != "amontons":
                continue
            target = name if name in known else name.rpartition(".")[0]
            if target in known and target != module:
                graph.setdefault(module, set()).add(target)
            if not may_import(module, name):
                where = f"{file.relative_to(root)}:{line}"
                yield f"{where}: {module} may not import {name} (packages: {order})"
    if cycle := find_cycle(graph):
        yield "import cycle: " + " -> ".join(cycle)


def violations(root: Path) -> list[str]:
    return [*check_cpp(root), *check_python(root)]


if __name__ == "__main__":
    found = violations(Path(__file__).resolve().parent.parent)
    print("\n".join(found) if found else "layers hold")
    sys.exit(bool(found))
