"""Draws docs/recipes.md and its pictures: python tools/recipes.py [RECIPE ...]

A picture per program of examples/recipes, of the simulation that it leaves behind. The page lists them all,
with the first line of what each says of itself.
"""

import argparse
import ast
import runpy
import sys
from pathlib import Path

import amontons
from gallery import saved

ROOT = Path(__file__).resolve().parent.parent
FOLDER = ROOT / "examples" / "recipes"
PICTURES = ROOT / "docs" / "figures" / "recipes"
PAGE = ROOT / "docs" / "recipes.md"
# Where the eye is: degrees about z from the x axis, above the horizon.
EYES = {
    "bowl": (-60, 40), "mug": (-60, 12), "nut": (-60, 20), "gears": (-75, 50), "rack": (-75, 15),
    "screw": (-60, 15), "belt": (-75, 20), "cam": (-75, 15), "geneva": (-75, 50), "scissor_lift": (-70, 12),
    "gripper_mug": (-30, 15), "tyre": (-65, 15), "part_feeder": (-60, 25),
}  # fmt: skip
HEAD = """# Recipes

Mechanisms that are often asked for. Each is a program of one screen in `examples/recipes`. It checks its
result against a closed form or a bound, and its last step is in the picture. Drawn by
[tools/recipes.py](../tools/recipes.py).

- Where a part is not convex, `shapes.decompose` makes convex parts of its mesh: bowl, mugs, Geneva wheel
  ([shapes](models.md#meshes-as-shapes)). `pip install amontons[decompose]` brings what this needs.
- Where its pieces are known, as teeth and threads are, hulls are the quicker and more exact way: gears, nut.
- Where contact does not matter, `add_coupling` or a tendon takes its place: rack, screw, belt.
"""


def draw(name: str) -> None:
    """Runs a recipe and draws what it leaves."""
    simulation = runpy.run_path(str(FOLDER / f"{name}.py"))["simulation"]
    azimuth, elevation = EYES[name]
    pixels = amontons.render(simulation, (560, 380), azimuth=azimuth, elevation=elevation)
    saved(pixels, PICTURES / f"{name}.png")


def page() -> str:
    """The page, from what the programs say of themselves."""
    rows = []
    for name in EYES:
        says = (ast.get_docstring(ast.parse((FOLDER / f"{name}.py").read_text())) or "").split("\n")[0]
        image = f"![{name}](figures/recipes/{name}.png)"
        rows.append(f"| {image} | **{name}**<br>{says}<br>`python examples/recipes/{name}.py` |\n")
    return HEAD + "\n| | |\n|---|---|\n" + "".join(rows)


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("recipes", nargs="*", choices=[[], *EYES], metavar="RECIPE")
    sys.path.insert(0, str(FOLDER))
    for name in parser.parse_args().recipes or EYES:
        draw(name)
    PAGE.write_text(page())
    print(PAGE)


if __name__ == "__main__":
    main()
