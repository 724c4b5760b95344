"""Draws docs/gallery.md and its pictures: python tools/gallery.py [--replays] [SCENE ...]

A picture per scene of `amontons.scenes`, at a moment where one sees what it is about. The page lists every
scene, with the command that runs it. With --replays each scene is recorded instead, and becomes a page with
a play bar in out/replays; `make docs` takes them into the site where they are there. They are about a
megabyte each, so that the repository does not hold them.
"""

import argparse
import io
import subprocess
import sys
import tempfile
from pathlib import Path

import amontons
import numpy as np
from amontons import Simulation, scenes
from numpy.typing import NDArray
from PIL import Image

ROOT = Path(__file__).resolve().parent.parent
PICTURES = ROOT / "docs" / "figures" / "gallery"
REPLAYS = ROOT / "out" / "replays"
PAGE = ROOT / "docs" / "gallery.md"
WIDTH, HEIGHT = 560, 380
# s, and where the eye is (degrees about z from the x axis, above the horizon); scene parameters.
MOMENTS: dict[str, tuple[float, float, float, dict[str, object]]] = {
    "arch": (0.5, -70, 12, {}),
    "capstan": (0.5, -80, 10, {}),
    "card_house": (0.5, -60, 12, {}),
    "chain": (0.6, -80, 8, {"links": 40}),
    "domino_run": (0.6, -50, 22, {"count": 14}),
    "four_bar": (0.4, -75, 12, {}),
    "free_body": (0.7, -60, 20, {}),
    "hopper": (1.6, -60, 18, {"count": 200}),
    "incline": (0.5, -70, 12, {"angle": 20}),
    "network": (0.4, -60, 20, {"columns": 6, "layers": 6}),
    "newtons_cradle": (0.9, -70, 12, {"raised": 2}),
    "pendulum": (0.3, -75, 12, {}),
    "plates": (0.5, -60, 12, {}),
    "rolling_balls": (0.8, -60, 15, {}),
    "rolling_sphere": (0.3, -60, 15, {}),
    "slider_crank": (0.4, -75, 14, {}),
    "sliding_cube": (0.6, -60, 15, {}),
    "spheres_in_box": (0.8, -60, 28, {"count": 300}),
    "stack": (0.3, -60, 12, {}),
    "tipping_box": (0.4, -70, 12, {"angle": 25}),
    "tracked_vehicle": (2.0, -55, 18, {"slabs": 8}),
    "wall": (0.9, 50, 18, {}),
    "wall_at_rest": (0.05, -60, 15, {"columns": 16, "rows": 10}),
}
HEAD = """# Gallery

Every scene of `amontons.scenes`, a moment of each; what they show and their parameters: [scenes](scenes.md).
`amontons view NAME` plays any of them in the browser. Drawn by [tools/gallery.py](../tools/gallery.py).
"""


def picture(name: str) -> None:
    """Runs a scene up to its moment and draws it."""
    seconds, azimuth, elevation, parameters = MOMENTS[name]
    scene = scenes.get(name)
    options = {"tolerance": 1e-3, "on_failure": "ignore"} | dict(scene.options)
    simulation = Simulation(scene.make(**parameters), dt=scene.dt, **options)
    simulation.run(seconds)
    pixels = amontons.render(simulation, (WIDTH, HEIGHT), azimuth=azimuth, elevation=elevation)
    saved(pixels, PICTURES / f"{name}.png")


def saved(pixels: NDArray[np.uint8], path: Path) -> None:
    """Writes a picture in 48 colours, which takes a third of the bytes."""
    buffer = io.BytesIO()
    Image.fromarray(pixels).quantize(48, dither=Image.Dither.NONE).save(buffer, "PNG", optimize=True)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(buffer.getvalue())
    print(f"{path.stem}: {len(buffer.getvalue()) // 1024} KB")


def replay(name: str) -> None:
    """Records a scene for twice the time of its picture and makes a page of it, by the commands of a user."""
    seconds, _, _, parameters = MOMENTS[name]
    words = [word for key, value in parameters.items() for word in ("--set", f"{key}={value}")]
    REPLAYS.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        recording = Path(folder) / f"{name}.h5"
        run = ["run", name, *words, "--duration", f"{2 * seconds:g}", "--tolerance", "1e-3"]
        record = ["--record", str(recording), "--record-every", "4", "--no-record-contacts"]
        subprocess.run([sys.executable, "-m", "amontons", *run, *record], stdout=subprocess.DEVNULL)
        page = REPLAYS / f"{name}.html"
        subprocess.run(
            [sys.executable, "-m", "amontons", "export", str(recording), "--html", str(page)], check=True
        )


def command(name: str) -> str:
    seconds, _, _, parameters = MOMENTS[name]
    words = "".join(f" --set {key}={value}" for key, value in parameters.items())
    return f"amontons run {name}{words} --duration {seconds:g}"


def page() -> str:
    """The page, from the list of scenes and what each says of itself."""
    rows = []
    for name in scenes.names():
        says = (scenes.get(name).make.__doc__ or "").strip().split("\n")[0]
        image = f"![{name}](figures/gallery/{name}.png)"
        rows.append(f"| {image} | **{name}**<br>{says}<br>`{command(name)}` |\n")
    return HEAD + "\n| | |\n|---|---|\n" + "".join(rows)


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("scenes", nargs="*", choices=[[], *MOMENTS], metavar="SCENE")
    parser.add_argument("--replays", action="store_true", help="pages with a play bar, in out/replays")
    options = parser.parse_args()
    for name in options.scenes or scenes.names():
        (replay if options.replays else picture)(name)
    if not options.replays:
        PAGE.write_text(page())
        print(PAGE)


if __name__ == "__main__":
    main()
