"""Draws the diagrams of a step, of the choice in `auto` and of the layers, from the sources.

    python tools/diagrams.py            writes docs/figures/diagram-*.svg
    python tools/diagrams.py FOLDER     writes them elsewhere

The order of calls, the paths of a step, the contenders and all numbers are read from the sources. Captions
stand here. A call without a caption, or a caption without a call, is an error. A test compares the files.
"""

import sys
from pathlib import Path

from check_layers import PACKAGES
from cpp_facts import Changed, body, calls, constant, contenders, declared, described, enumerators, members
from drawing import Card, Drawing
from layers_cpp import LAYERS

ROOT = Path(__file__).resolve().parent.parent

# The stages that Simulation::advance calls.
STEP = {
    "observe": (
        "Observe",
        "Place bodies and joints. Find free velocities and the contacts that they can close.",
    ),
    "correct": (
        "Correct positions",
        "Move bodies if a position error exceeds its limit. Then observe again.",
    ),
    "resolve_impacts": ("Impacts", "Reflect bouncing contacts. This changes the start velocities."),
    "pose": ("Pose the problem", "Collect contacts and joint rows as one variational inequality."),
    "solve": ("Solve", "Find impulses, and the velocities that follow."),
    "look_ahead": (
        "Look ahead",
        "Follow the velocities to the end of the step. If they lead to new contacts, add them and "
        "solve again, up to {most_looks} times.",
    ),
    "close_loops": (
        "Close loops",
        "If rows of joints form a loop that nothing touches, solve again, so that its joints are closed "
        "at the end.",
    ),
    "energy_balance": (
        "Check the energy",
        "If the step gains energy, repeat it damped.",
    ),
    "make_safe": ("Safe step", "Only if the solve or the balance failed: make the impulses harmless."),
    "move_on": ("Move on", "Store impulses and move the bodies."),
    "let_sleep": (
        "Let islands sleep",
        "Leave out of the next step what this one left as it was, to the bit.",
    ),
}
STEP_NUMBERS = ("most_looks",)
STEP_PASSED = {"most_work", "wakes", "end_impacts", "add_part", "keep_results"}
PATHS = {
    "accurate": "The impulses are those of the solve.",
    "joints_restored": "The solve missed its tolerance. Joints were solved exactly.",
    "budget_spent": "The same, after the budget ended the solve.",
    "impulses_scaled": "Contact impulses were reduced until the step gains no energy.",
    "bodies_stopped": "Bodies were stopped at fixed geometry.",
}

AUTO = {
    "accepts_start": ("Is the start a solution?", "Yes, if its residual is within the tolerance: return it."),
    "solve_on_device": (
        "Does a device serve the problem?",
        "Yes: the two first-order methods with passes there. All islands are one problem.",
    ),
    "solve_in_order": (
        "Only bilateral rows, more than {large_linear_system}?",
        "Yes: run the methods for linear systems. If they stall, go on.",
    ),
    "solve_directly": (
        "Are all islands small?",
        "Yes: eliminate the bilateral rows and solve each island of at most {most_rows} other rows "
        "directly. If this fails, other methods start from zero.",
    ),
    "solve_by_islands": (
        "Split into islands",
        "Otherwise: solve each island by itself, directly if it is small, or by these methods in order:",
    ),
}
AUTO_PASSED = {"name_elimination"}
GROUPS = {
    "linear_field": "Methods for linear systems",
    "first_order": "First the method that only needs products",
    "add_factoring": "Then methods that factor A, if it is not too large",
}
METHODS = {"spg": "p-spg-fb", "central_path": "interior-point"}

LAYER = {
    "base": "errors, vectors, rotations, threads, limits of work",
    "sets": "cones and intervals: what a constraint can transmit",
    "problem": "contacts, operators, residual, certificate",
    "solvers": "methods, from a problem to a solution",
    "collision": "shapes and contact manifolds",
    "multibody": "models, states and the time step",
    "picture": "pictures of triangles; uses base only",
}
PACKAGE = {
    "model": "bodies, joints, builders",
    "problem": "problems, cones, solve()",
    "simulation": "Simulation, State, Report",
    "io": "files: MJCF, URDF, FCLIB, recordings",
    "scenes": "scenes for tests, benchmarks and documents",
    "report": "figures, pictures and films",
    "studies": "studies of many runs",
    "viewer": "the page of amontons view",
    "device": "passes of first-order methods on a GPU",
    "cli": "the command",
    "gym": "environments for learning",
}


def same(found: list[str], captions: dict[str, str], what: str) -> None:
    if set(found) != set(captions):
        raise Changed(f"{what}: the sources have {found}, tools/diagrams.py describes {list(captions)}")


def step(root: Path) -> str:
    room = root / "src/multibody/step"
    source = room / "step.cpp"
    order = calls(body(source, r"Simulation::Outcome Simulation::advance\("))
    known = declared(room.glob("*.hpp")) | members(source, "Simulation")
    order = described(order, STEP, known, STEP_PASSED)
    numbers = {name: constant(room / "policy.hpp", name) for name in STEP_NUMBERS}
    drawing = Drawing("What happens in a step: " + ", ".join(STEP[name][0] for name in order))
    for number, name in enumerate(order, 1):
        title, text = STEP[name]
        kind = {"energy_balance": "choice", "make_safe": "danger"}.get(name, "plain")
        drawing.card(Card(f"{number}  {title}", text.format(**numbers), f"{name}()", kind))
    drawing.back(order.index("energy_balance"), 0)
    paths = enumerators(root / "include/amontons/multibody/step/report.hpp", "StepPath")
    same(paths, PATHS, "enum class StepPath")
    drawing.card(Card("Report.path", "The last of these that changed impulses or velocities:", kind="end"))
    for path in paths:
        drawing.card(Card(path, PATHS[path], kind="end"), indent=18, arrow=False)
    return drawing.svg()


def auto(root: Path) -> str:
    source = root / "src/solvers/choice/automatic.cpp"
    headers = (root / "include/amontons/solvers/choice").glob("*.hpp")
    signature = r"Solution automatic\(const Problem& problem, const Options& options, Budget& budget\)"
    found = calls(body(source, signature))
    order = described(found, AUTO, declared([source, *headers]), AUTO_PASSED)
    numbers = {
        "large_linear_system": constant(root / "src/solvers/choice/policy.hpp", "most_rows"),
        "most_rows": constant(root / "src/solvers/direct/policy.hpp", "most_rows"),
    }
    drawing = Drawing("How auto chooses a method")
    for name in order:
        title, text = AUTO[name]
        kind = "plain" if name == "solve_by_islands" else "choice"
        drawing.card(Card(title.format(**numbers), text.format(**numbers), f"{name}()", kind))
    groups = contenders(source)
    same(list(groups), GROUPS, "contenders of auto")
    first = next(iter(groups))
    for function, methods in groups.items():
        drawing.card(Card(GROUPS[function], code=f"{function}()", kind="end"), arrow=function == first)
        for method, why in methods:
            drawing.card(
                Card(METHODS.get(method, method.replace("_", " ")), why, kind="end"), indent=18, arrow=False
            )
    return drawing.svg()


def layers(root: Path) -> str:
    same(list(LAYERS), LAYER, "layers of C++")
    same([name for names in PACKAGES for name in names], PACKAGE, "packages of Python")
    drawing = Drawing("Layers: each uses those below it")
    apart = "; ".join(" and ".join(names) for names in reversed(PACKAGES) if len(names) > 1)
    rule = f"Packages. A package uses only those below it. These do not use each other: {apart}."
    drawing.card(Card("python/amontons", rule, kind="end"))
    for names in reversed(PACKAGES):
        for name in names:
            drawing.card(Card(name, PACKAGE[name], kind="end"), indent=18, arrow=False)
    drawing.card(Card("bindings", "nanobind, one file per bound type", kind="choice"))
    drawing.card(Card("C++ core: include/amontons, src", "Layers. A layer uses only those below it."))
    for name, rooms in reversed(LAYERS.items()):
        drawing.card(Card(name, LAYER[name], "  ".join(rooms)), indent=18, arrow=False)
    return drawing.svg()


DIAGRAMS = {"diagram-step.svg": step, "diagram-auto.svg": auto, "diagram-layers.svg": layers}


def main(folder: Path) -> None:
    for name, draw in DIAGRAMS.items():
        (folder / name).write_text(draw(ROOT))
        print(folder / name)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "docs/figures")
