"""Draws docs/figures/creep.webp: a card house in MuJoCo and here: python tools/creep.py

Both engines get the same house, the same material and the same time step, 2 ms, MuJoCo's default. All other
options are the defaults of each. Counted is the largest way of a card from where it stood. With this friction
the house stands, so that the right figure is zero. `benchmarks/beside` makes the model of MuJoCo. The last
figures go to docs/figures/creep.csv.
"""

import csv
import sys
from collections.abc import Iterator
from pathlib import Path

import matplotlib
import numpy as np
from amontons import Simulation, scenes
from amontons.report.picture import Frame, Picture, View
from cutout import cutout
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "benchmarks"))
FILE = ROOT / "docs" / "figures" / "creep.webp"
TABLE = FILE.with_suffix(".csv")
STEP, SECONDS, FRAMES = 2e-3, 4.0, 32
WIDTH, HEIGHT, TEXT = 380, 225, 58
GREY, RED, GREEN = (125, 130, 138, 255), (214, 84, 48, 255), (46, 139, 87, 255)
Poses = tuple[NDArray[np.float64], NDArray[np.float64]]


def in_mujoco() -> Iterator[Poses]:
    """Positions and orientations of all cards, at the start and after each of FRAMES parts of the time."""
    from beside import in_mujoco as engine
    from beside.scenes import plain

    running = engine.start(plain(scenes.make("card_house")), STEP, {})
    for _ in range(FRAMES + 1):
        motion = running.motion()
        yield motion.positions, motion.orientations
        running.advance(round(SECONDS / FRAMES / STEP))


def in_amontons() -> Iterator[Poses]:
    simulation = Simulation(scenes.make("card_house"), dt=STEP)
    for _ in range(FRAMES + 1):
        yield simulation.state.positions.copy(), simulation.state.orientations.copy()
        simulation.run(SECONDS / FRAMES)


def font(size: int, *, bold: bool = False) -> ImageFont.FreeTypeFont:
    name = "DejaVuSans-Bold.ttf" if bold else "DejaVuSans.ttf"
    return ImageFont.truetype(str(Path(matplotlib.get_data_path()) / "fonts" / "ttf" / name), size)


def panels(runs: dict[str, list[Poses]]) -> list[Image.Image]:
    """The runs side by side, each with its name and its counter, at all times."""
    picture = Picture(scenes.make("card_house"), View(azimuth=-60, elevation=12))
    first = [Frame(0.0, *poses[0]) for poses in runs.values()]
    framing = picture.framing(first, 1.2 * WIDTH / HEIGHT)
    drawn = []
    for k in range(FRAMES + 1):
        sheet = Image.new("RGBA", (len(runs) * WIDTH, HEIGHT + TEXT))
        pen = ImageDraw.Draw(sheet)
        for column, (name, poses) in enumerate(runs.items()):
            moment = Frame(k * SECONDS / FRAMES, *poses[k])
            sheet.paste(cutout(picture, moment, framing, (WIDTH, HEIGHT)), (column * WIDTH, TEXT))
            middle = (column + 0.5) * WIDTH
            creep = crept(poses, k)
            pen.text((middle, 12), name, GREY, font(15), anchor="mm")
            colour = RED if creep > 0.01 else GREEN
            pen.text((middle, 40), f"{creep:.2f} mm", colour, font(26, bold=True), anchor="mm")
        drawn.append(sheet)
    return drawn


def crept(poses: list[Poses], k: int) -> float:
    """The largest way of a card (mm)."""
    return 1e3 * float(np.linalg.norm(poses[k][0] - poses[0][0], axis=1).max())


def main() -> None:
    import mujoco

    runs = {
        f"MuJoCo {mujoco.__version__}, defaults": list(in_mujoco()),
        "amontons, defaults": list(in_amontons()),
    }
    with TABLE.open("w", newline="") as file:
        rows = csv.writer(file, lineterminator="\n")
        rows.writerow(("engine", "step", "seconds", "creep"))
        rows.writerows((name, STEP, SECONDS, f"{crept(poses, FRAMES):.3g}") for name, poses in runs.items())
    frames = panels(runs)
    times = [round(1e3 * SECONDS / FRAMES)] * FRAMES + [1500]
    frames[0].save(
        FILE, save_all=True, append_images=frames[1:], duration=times, loop=0, quality=70, method=6
    )
    print(TABLE.read_text(), FILE, f"{FILE.stat().st_size // 1024} KB")


if __name__ == "__main__":
    main()
