"""The recipes of the gallery: the programs of examples/recipes, and a picture of what each leaves behind."""

import ast
import runpy
import sys
from pathlib import Path

from amontons.report.picture import Picture, View, frame_of
from cutout import cutout, saved

ROOT = Path(__file__).resolve().parent.parent
FOLDER = ROOT / "examples" / "recipes"
PICTURES = ROOT / "docs" / "figures" / "recipes"
WIDTH, HEIGHT = 560, 380
# Where the eye is: degrees about z from the x axis, above the horizon.
EYES = {
    "bowl": (-60, 40), "mug": (-60, 12), "nut": (-60, 20), "gears": (-75, 50), "rack": (-75, 15),
    "screw": (-60, 15), "belt": (-75, 20), "cam": (-75, 15), "geneva": (-75, 50), "scissor_lift": (-70, 12),
    "gripper_mug": (-30, 15), "tyre": (-65, 15), "part_feeder": (-60, 25),
}  # fmt: skip
DECOMPOSED = ("bowl", "mug", "gripper_mug")
"""Those that need the package coacd."""
HEAD = """
Mechanisms that are often asked for. Each is a program of one screen in `examples/recipes`, which checks its
result against a closed form or a bound.

- Where a part is not convex, `shapes.decompose` makes convex parts of its mesh: bowl, mugs
  ([shapes](models.md#meshes-as-shapes), `pip install amontons[decompose]`).
- Where its pieces are known, hulls are quicker and more exact: gears, nut, Geneva wheel.
- Where contact does not matter, `add_coupling` or a tendon takes its place: rack, screw, belt.
"""


def draw(name: str) -> None:
    """Runs a recipe and draws what it leaves."""
    sys.path.insert(0, str(FOLDER))
    try:
        simulation = runpy.run_path(str(FOLDER / f"{name}.py"))["simulation"]
    finally:
        sys.path.remove(str(FOLDER))
    picture, frame = Picture(simulation.model, View(*EYES[name])), frame_of(simulation)
    framing = picture.framing([frame], WIDTH / HEIGHT)
    saved(cutout(picture, frame, framing, (WIDTH, HEIGHT)), PICTURES / f"{name}.png")


def says(name: str) -> str:
    """The first line of what a program says of itself."""
    return (ast.get_docstring(ast.parse((FOLDER / f"{name}.py").read_text())) or "").split("\n")[0]
