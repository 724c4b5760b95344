"""The C++ half of check_layers.py: layers, rooms, private headers, pairs of files, cycles, libraries.

- A layer (first folder below include/amontons and src) uses only itself and those before it in LAYERS.
- A room (second folder) uses only itself and the rooms of its layer before it. Files that lie in the layer
  itself are its door: they use all rooms, and no room uses them.
- A header below src is private to its layer.
- src/R/X.cpp and src/R/X.isa.cpp belong to include/amontons/R/X.hpp or src/R/X.hpp. Together they are the
  component R/X, and components include each other without a cycle.
- Eigen and nlohmann/json appear below src only, so that they never reach a consumer.
- What is no engine (OUTSIDE) includes public headers and its own files only.
- include/amontons.hpp lies above all layers: it includes what programs of users need.
"""

import itertools
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from cycles import Graph, find_cycles

# Layers in their order, with the rooms of each in theirs.
LAYERS: dict[str, list[str]] = {
    "base": [],
    "sets": [],
    "problem": [],
    "solvers": [
        "linear",
        "driver",
        "first_order",
        "krylov",
        "central_path",
        "second_order",
        "companions",
        "direct",
        "choice",
    ],
    "collision": ["shapes", "narrow", "broad_phase", "pairs", "rays"],
    "multibody": [
        "model",
        "bodies",
        "joints",
        "kinematics",
        "contacts",
        "trees",
        "step",
        "derivatives",
        "worlds",
    ],
    "picture": [],
}
# Sources that declare nothing and so have no header: the file and the reason.
WITHOUT_HEADER: dict[str, str] = {
    "src/multibody/contacts/later_contacts.cpp": "the members of ContactFinder that follow known contacts",
    "src/multibody/step/step.cpp": "the members of Simulation that make one step",
}
# Folders beside the library, which use what is installed.
OUTSIDE = ("bindings", "fmu", "playground")
PRIVATE_LIBRARIES = ("Eigen/", "nlohmann/")
INCLUDE = re.compile(r'^\s*#\s*include\s*([<"])([^>"]+)[>"]', re.MULTILINE)


@dataclass(frozen=True)
class File:
    """A C++ file by its place: path from the root, layer, room (None at the door), component."""

    path: str
    layer: str
    room: str | None
    component: str
    private: bool

    @property
    def is_header(self) -> bool:
        return self.path.endswith(".hpp")


def place(path: Path) -> File:
    """The file at a path relative to the root, below include/amontons or src."""
    inside = Path(*path.parts[2:]) if path.parts[0] == "include" else Path(*path.parts[1:])
    folders = inside.parts[:-1]
    component = str(inside.parent / inside.name.split(".")[0])
    layer, room = folders[0] if folders else "", folders[1] if len(folders) > 1 else None
    return File(str(path), layer, room, component, path.parts[0] == "src")


def resolve(root: Path, source: Path, name: str) -> Path | None:
    for folder in (source.parent, Path("include"), Path("src")):
        if (root / folder / name).is_file():
            return Path((root / folder / name).resolve().relative_to(root.resolve()))
    return None


def misplaced(file: File) -> str | None:
    if file.layer not in LAYERS:
        return f"{file.path}: not in a folder of the layer list {', '.join(LAYERS)}; move it into one"
    rooms = LAYERS[file.layer]
    if file.room is not None and file.room not in rooms:
        known = ", ".join(rooms) or "none at all"
        return f"{file.path}: {file.layer} has no room {file.room} (but {known}); move it"
    return None


def include_faults(file: File, other: File) -> Iterator[str]:
    """What is wrong with file including other; both lie in known layers and rooms."""
    order = list(LAYERS)
    if order.index(other.layer) > order.index(file.layer):
        yield (
            f"{file.path}: layer {file.layer} may not include {other.path} of layer {other.layer}; "
            f"move what it needs to {file.layer} or below"
        )
    elif other.private and other.layer != file.layer:
        yield (
            f"{file.path}: {other.path} is private to {other.layer}; "
            f"put what others need into a header below include/amontons/{other.layer}"
        )
    elif other.layer == file.layer and file.room is not None:
        rooms = LAYERS[file.layer]
        if other.room is None:
            yield (
                f"{file.path}: {other.path} is the door of {file.layer}, which no room uses; "
                "include the header of the room that declares it, or declare it in one"
            )
        elif rooms.index(other.room) > rooms.index(file.room):
            yield (
                f"{file.path}: room {file.room} may not include {other.path} of room {other.room}; "
                f"move what it needs to {file.room} or below (rooms: {' < '.join(rooms)})"
            )
    if not file.private and other.private:
        yield f"{file.path}: a public header may not include {other.path}, which is not installed"


def pair_faults(files: list[File], without_header: Mapping[str, str]) -> Iterator[str]:
    """Sources without a header of their name, and entries of the table that say nothing true."""
    headers = {file.component for file in files if file.is_header}
    lonely = {file.path: file for file in files if not file.is_header and file.component not in headers}
    for path, file in lonely.items():
        if path in without_header:
            continue
        name = Path(file.component).name
        elsewhere = [h for h in sorted(headers) if Path(h).name == name]
        hint = f"; {elsewhere[0]}.hpp has that name: bring them into one room" if elsewhere else ""
        yield (
            f"{path}: no header {file.component}.hpp declares what it defines; give it one{hint}. "
            "If it declares nothing, say why in WITHOUT_HEADER of tools/layers_cpp.py"
        )
    for path in sorted(set(without_header) - set(lonely)):
        yield f"tools/layers_cpp.py: WITHOUT_HEADER lists {path}, which has a header or is gone; remove it"


def cycle_faults(includes: list[tuple[File, File]]) -> Iterator[str]:
    """Cycles between components, then those of files within one component."""
    components: Graph = {}
    files: Graph = {}
    witness: dict[tuple[str, str], str] = {}
    for file, other in includes:
        if file.component == other.component:
            files.setdefault(file.path, set()).add(other.path)
        else:
            components.setdefault(file.component, set()).add(other.component)
            witness.setdefault((file.component, other.component), f"{file.path} includes {other.path}")
    for cycle in find_cycles(components):
        steps = "; ".join(witness[pair] for pair in itertools.pairwise(cycle))
        yield f"cycle of components {' -> '.join(cycle)}: {steps}; move what both need into a third one"
    for cycle in find_cycles(files):
        yield f"cycle of includes {' -> '.join(cycle)}: a file may not include itself"


def private_library_faults(root: Path) -> Iterator[str]:
    for folder in ("include", "bindings"):
        for path in sorted((root / folder).rglob("*.[hc]pp")):
            for _, name in INCLUDE.findall(path.read_text()):
                if name.startswith(PRIVATE_LIBRARIES):
                    yield f"{path.relative_to(root)}: includes <{name}>, which is for sources below src only"


def outside_faults(root: Path) -> Iterator[str]:
    for folder in OUTSIDE:
        for path in sorted((root / folder).rglob("*.[hc]pp")):
            for bracket, name in INCLUDE.findall(path.read_text()):
                own = bracket == '"' and (path.parent / name).is_file()
                if not own and not (root / "include" / name).is_file() and (root / "src" / name).is_file():
                    yield f"{path.relative_to(root)}: {name} is not installed; include what is below include"


def check_cpp(root: Path, without_header: Mapping[str, str] = WITHOUT_HEADER) -> Iterator[str]:
    files = []
    for path in sorted(p for top in ("include/amontons", "src") for p in (root / top).rglob("*.[hc]pp")):
        file = place(path.relative_to(root))
        if fault := misplaced(file):
            yield fault
        else:
            files.append(file)
    includes = []
    for file in files:
        for bracket, name in INCLUDE.findall((root / file.path).read_text()):
            if bracket == "<" and not name.startswith("amontons/"):
                continue
            target = resolve(root, Path(file.path), name)
            if target is None:
                yield f'{file.path}: "{name}" not found beside it, in include or in src'
                continue
            other = place(target)
            if misplaced(other) is None:
                includes.append((file, other))
                yield from include_faults(file, other)
    if files:
        yield from pair_faults(files, without_header)
    yield from cycle_faults(includes)
    yield from private_library_faults(root)
    yield from outside_faults(root)
