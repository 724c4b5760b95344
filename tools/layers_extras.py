"""What extras take from the engine; a part of check_layers.py.

The engine is the C++ library and the packages of ENGINE. All other packages are extras: files, scenes,
pictures, studies, the viewer, devices, environments, the command. An extra imports public names of the engine
(those that a door shows) and the names of OFFERED. An offered name that no extra takes is a fault. Only the
extras of CORE_USERS use the compiled module.
"""

from collections.abc import Collection, Iterator, Mapping
from typing import Protocol

ENGINE = ("model", "problem", "simulation")
DOORS = ("amontons", "amontons.parts", "amontons.results", "amontons.shapes", "amontons.vi")
# Names beside the public ones by their module below amontons; "" is the module itself.
OFFERED: dict[str, Collection[str]] = {
    # Values of a model, and arithmetic of poses.
    "model.assembly": ("Assembly", "Block", "DENSITY", "FRICTION"),
    "model.compiled": ("Looks", "Parts"),
    "model.coordinates": ("coordinate_name", "is_floating", "known"),
    "model.decomposing": ("winding",),
    "model.groups": ("connected",),
    "model.links": ("place_index",),
    "model.mass": ("MassProperties", "NOTHING", "principal"),
    "model.model": ("PYTHON_PARTS", "no_model"),
    "model.orientations": ("quaternion_of",),
    "model.parts": ("OWN", "WORLD"),
    "model.presets": ("EFFECTS",),
    "model.quantities": ("parameter", "values_of"),
    "model.sensing": ("SENSORS",),
    "model.transforms": (
        *("IDENTITY", "ORIGIN", "Quaternion", "Vector3", "conjugate", "dot", "multiply", "rotate"),
        *("rotation_matrix", "rotation_to_z", "subtract"),
    ),
    "model.turns": ("conjugate", "product", "rotate"),
    "model.variants": ("combined", "same_structure"),
    # Triangles and their files, which shapes of the engine read too.
    "model.collada": ("",),
    "model.hulls": ("convex_triangles",),
    "model.mesh_files": ("is_closed", "read_triangles"),
    "model.stl_text": ("",),
    # Problems, and the hooks that extras supply.
    "problem.cones": ("Cone",),
    "problem.iterate": ("source_of_device", "source_of_name"),
    "problem.matrices": ("ASYMMETRY",),
    "problem.operators": ("block_diagonal",),
    "problem.options": ("", "LAWS"),
    "problem.problem": ("write_file",),
    "problem.solution": ("HISTORY",),
    "simulation.saving": ("load_file", "save_file"),
    # Simulations: tables of steps, many worlds, changes of coordinates.
    "simulation.copies": ("set_clock",),
    "simulation.derivative": ("with_values",),
    "simulation.determinacy": ("Pose", "determined"),
    "simulation.driving": ("clipped",),
    "simulation.loads": ("in_frames_b",),
    "simulation.own_method": ("name_of",),
    "simulation.pairs": ("search_of_name",),
    "simulation.rollout": ("advance_worlds", "usable_cores"),
    "simulation.signals": ("STATE", "Signals", "state_units"),
    "simulation.step_report": ("REPORTS", "TIMINGS", "Table", "energy", "reports_array"),
    "simulation.tables": ("CONTACTS", "contact_table"),
    "simulation.tangent": ("angles", "difference"),
}
# Modules of extras that use the compiled module, and why.
CORE_USERS = {
    "amontons.device.found": "hands iterates of devices to the core",
    "amontons.device.methods": "reads the layout of a problem",
    "amontons.io.fmu": "finds the library beside the module",
    "amontons.io.recordings.model_json": "the core reads and writes models as JSON",
    "amontons.io.recordings.saved_state": "the core copies its state",
    "amontons.report.health": "tells how the module was compiled",
    "amontons.report.picture": "the core draws triangles",
}


class Import(Protocol):
    """An import as check_layers.py finds it."""

    importer: str
    name: str
    target: str
    where: str


def package(module: str) -> str:
    return (module.split(".") + [""])[1]


def extra_faults(
    found: Collection[Import],
    extras: Collection[str],
    offered: Mapping[str, Collection[str]],
    core_users: Collection[str],
) -> Iterator[str]:
    """Imports of the modules `extras` that are neither public nor offered; entries that nobody uses."""
    public = {one.name for one in found if one.importer in DOORS}
    named = {f"amontons.{module}.{name}".rstrip(".") for module, names in offered.items() for name in names}
    used, users = set(), set()
    for one in found:
        if one.importer not in extras:
            continue
        if package(one.target) == "_core":
            users.add(one.importer)
            if one.importer not in core_users:
                yield f"{one.where}: {one.importer} may not use _core; take a name of the engine"
        elif package(one.target) in ENGINE and not public & {one.name, f"{one.target}.*"}:
            used.add(one.name)
            if one.name not in named:
                yield (
                    f"{one.where}: {one.importer} may not import {one.name}, which is no public name; "
                    "take one, or offer it in tools/layers_extras.py"
                )
    for name in sorted((named - used) | (set(core_users) - users)):
        yield f"tools/layers_extras.py: {name} has no use for its entry; remove it"
