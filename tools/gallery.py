"""Draws docs/gallery.md and its pictures: python tools/gallery.py [--replays] [NAME ...]

Robots first, then the recipes, an arch that falls, and a picture per scene of `amontons.scenes`, at a moment
where one sees what it is about. The ground is transparent. Joints are drawn, and the path of a point where
that is the matter. The page lists all, with the command that runs it. With --replays each is recorded, and
becomes a page with a play bar in out/replays. Those that are there are kept, so that `make docs` makes what
is missing. They are about a megabyte each, so that the repository does not hold them.
"""

import argparse
import contextlib
import importlib.util
import tempfile
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import amontons
import numpy as np
import recipes
from amontons import Simulation, scenes
from amontons.model.turns import rotate
from amontons.report.force_lines import line_rows
from amontons.report.picture import NO_LINES, Frame, Picture, View, frame_of
from cutout import cutout, saved
from numpy.typing import NDArray
from PIL import Image

ROOT = Path(__file__).resolve().parent.parent
PICTURES = ROOT / "docs" / "figures" / "gallery"
REPLAYS = ROOT / "out" / "replays"
PAGE = ROOT / "docs" / "gallery.md"
MODELS = ROOT / "examples" / "models"
WIDTH, HEIGHT = 480, 320
FPS = 12.5  # pictures per second of a replay: its size, but for that of the page itself, is in proportion
FORCES = SLOW = ("wall",)
TRAIL = (215, 80, 40)


@dataclass(frozen=True)
class Moment:
    """When a scene is drawn, and from where."""

    seconds: float
    azimuth: float  # degrees about z from the x axis
    elevation: float  # degrees above the horizon
    parameters: dict[str, Any] = field(default_factory=dict)
    trail: tuple[int, tuple[float, float, float]] | None = None
    """a body and a point of it (m) whose path up to the moment is drawn"""
    target: tuple[float, float, float] | None = None
    """what is in the middle (m), with the width (m) that is seen; None: all that moves"""
    width: float | None = None


MOMENTS = {
    "arch": Moment(0.5, -70, 12),
    "avalanche": Moment(1.2, -55, 25),
    "capstan": Moment(0.5, -80, 10),
    "card_house": Moment(0.5, -60, 12),
    "chain": Moment(0.6, -80, 8, {"links": 40}, (40, (0, 0, 0))),
    "domino_run": Moment(0.6, -50, 22, {"count": 14}),
    "drum": Moment(1.5, -65, 15, {}, None, (0, 0, 0), 2.0),
    "four_bar": Moment(0.8, -75, 12, {}, (1, (0, 0, 0)), None, 1.9),
    "free_body": Moment(3.0, -60, 20, {}, (0, (0, 0.1, 0))),
    "hopper": Moment(1.6, -60, 18, {"count": 200}),
    "incline": Moment(0.5, -50, 26, {"angle": 20}),
    "network": Moment(0.4, -60, 20, {"columns": 6, "layers": 6}),
    "newtons_cradle": Moment(0.9, -62, 14, {"raised": 2}, None, (0.2, 0, -0.27), 1.15),
    "pendulum": Moment(0.8, -75, 12, {"angle": 40}, (0, (0, 0, -0.5)), (0, 0, -0.5), 2.0),
    "pile": Moment(0.8, -60, 25, {}, None, (0, 0, 0.2), 3.0),
    "plates": Moment(0.5, -60, 12),
    "rolling_balls": Moment(0.8, -60, 15),
    "rolling_sphere": Moment(0.3, -60, 15, {}, (0, (0, 0, 0.1))),
    "slider_crank": Moment(0.7, -75, 14, {}, (1, (0, 0, 0)), None, 1.2),
    "sliding_cube": Moment(0.6, -60, 15, {}, (0, (0, 0, 0))),
    "spheres_in_box": Moment(0.8, -60, 28, {"count": 300}),
    "stack": Moment(0.3, -60, 12),
    "tipping_box": Moment(0.4, -50, 26, {"angle": 25}),
    "tracked_vehicle": Moment(2.0, -55, 18, {"slabs": 8}),
    "wall": Moment(0.9, 50, 18),
    "wall_at_rest": Moment(0.05, -60, 15, {"columns": 16, "rows": 10}),
}


def quadruped() -> Simulation:
    """Rises from a crouch by PD control of its joints."""
    simulation = Simulation(amontons.load_model(MODELS / "quadruped.xml"), dt=2e-3, on_failure="ignore")
    model = simulation.model
    simulation.reset("stand")
    standing = simulation.q
    simulation.reset("crouch")
    crouching = simulation.q
    joints = [model.coordinates[name] for name in model.actuator_names]
    in_q, in_qd = (np.array([getattr(j, k).start for j in joints]) for k in ("q", "qd"))

    def hold(now: Simulation) -> None:
        s = min(now.time, 1.0)
        wanted = (1 - s) * crouching + s * standing
        now.controls = 80.0 * (wanted - now.q)[in_q] - 2.0 * now.qd[in_qd]

    simulation.before_step.append(hold)
    return simulation


def gripper() -> Simulation:
    """Takes a cube from the table and lifts it: the fingers hold it by friction alone."""
    simulation = Simulation(amontons.load_model(MODELS / "gripper.xml"), dt=2e-3, on_failure="ignore")
    simulation.reset("open")
    times = (0.0, 0.7, 1.0, 1.3, 1.5, 2.3)
    lifts = (0.0, -0.21, -0.21, -0.21, -0.21, 0.05)
    fingers = (0.05, 0.05, 0.05, 0.0, 0.0, 0.0)

    def glide(now: Simulation) -> None:
        finger = np.interp(now.time, times, fingers)
        now.controls = np.array([np.interp(now.time, times, lifts), finger, finger])

    simulation.before_step.append(glide)
    return simulation


def humanoid() -> Simulation:
    """Gymnasium's humanoid, as its file is, under torques that vary."""
    import gymnasium

    file = Path(gymnasium.__file__).parent / "envs" / "mujoco" / "assets" / "humanoid.xml"
    simulation = Simulation(amontons.load_model(file), dt=5e-3, on_failure="ignore")
    phases = np.arange(len(simulation.controls))

    def sway(now: Simulation) -> None:
        now.controls = 0.1 * np.sin(6.0 * now.time + phases)

    simulation.before_step.append(sway)
    return simulation


ROBOTS: dict[str, tuple[Callable[[], Simulation], Moment, str]] = {
    "quadruped": (quadruped, Moment(1.2, -55, 16), "python examples/hold_quadruped.py"),
    "gripper": (gripper, Moment(2.4, -12, 12), "python examples/grasp_cube.py"),
    "humanoid": (humanoid, Moment(0.35, -30, 12), 'gymnasium.make("amontons/Humanoid-v5")'),
}
SHELLS = {"tracked_vehicle": "pins of its shoes would hide them"}
MASONRY = "masonry"
ARCH = ROOT / "docs" / "figures" / "masonry_arch"
HEAD = """# Gallery

Robots, [recipes](#recipes) of mechanisms, an [arch](#masonry), and every scene of `amontons.scenes`.
`amontons scenes NAME` lists the parameters of a [scene](scenes.md), `amontons view NAME` plays it in the
browser. Hinges have pins, strings and rods are lines, and an orange line is the path of a point. Drawn by
[tools/gallery.py](../tools/gallery.py).
"""


def started(name: str) -> tuple[Simulation, Moment]:
    if name in ROBOTS:
        start, moment, _ = ROBOTS[name]
        return start(), moment
    scene, moment = scenes.get(name), MOMENTS[name]
    options = {"tolerance": 1e-3, "on_failure": "ignore"} | dict(scene.options)
    return Simulation(scene.make(**moment.parameters), dt=scene.dt, **options), moment


def picture(name: str) -> None:
    """Runs a scene up to its moment and draws it."""
    simulation, moment = started(name)
    passed: list[NDArray[np.float64]] = []

    def note(now: Simulation, _: object) -> None:
        body, point = moment.trail or (0, (0, 0, 0))
        turn = now.state.orientations[[body]]
        passed.append(now.state.positions[body] + rotate(turn, np.array([point]))[0])

    simulation.run(moment.seconds, after_step=note if moment.trail else None)
    view = View(
        moment.azimuth, moment.elevation, moment.target, moment.width, joints=name not in ROBOTS | SHELLS
    )
    drawn = Picture(simulation.model, view)
    frame = frame_of(simulation)
    # The window holds the start too, so that a path has room.
    held = [frame, Frame(0.0, *_poses(started(name)[0]))] if moment.trail else [frame]
    framing = drawn.framing(held, WIDTH / HEIGHT)
    image = cutout(drawn, frame, framing, (WIDTH, HEIGHT), _path(passed, framing.width))
    saved(image, PICTURES / f"{name}.png")


def masonry() -> None:
    """An arch of stones falls by four hinges, once its ground accelerates by 0.29 g."""
    from amontons.studies import horizontal, read_assembly, stability
    from amontons.studies.masonry.picture import film, write_film, write_picture

    arch = read_assembly(amontons.examples.path("arch.obj"), unit="m", up="z", density=2400, friction=0.6)
    verdict = stability(arch, loads=[horizontal(1)])
    write_picture(verdict, ARCH.with_suffix(".png"))
    write_film(verdict, ARCH.with_suffix(".webp"), size=(400, 300))
    saved(Image.fromarray(film(verdict, size=(WIDTH, HEIGHT))[-1]), PICTURES / f"{MASONRY}.png")


def _poses(simulation: Simulation) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    return simulation.state.positions.copy(), simulation.state.orientations.copy()


def _path(points: list[NDArray[np.float64]], width: float) -> NDArray[np.float64]:
    """The lines of a path in a picture so wide (m)."""
    if len(points) < 2:
        return NO_LINES
    kept = np.array(points)[:: max(1, len(points) // 150)]
    widths = np.full(len(kept) - 1, 0.006 * width)
    return line_rows(
        (kept[:-1], kept[1:], widths, np.tile(np.array(TRAIL, dtype=np.uint8), (len(widths), 1)))
    )


def replay(name: str) -> None:
    """Records a scene for twice the time of its picture and makes a page of it; one more of FORCES, with the
    force network."""
    from amontons.viewer.page import write_page

    simulation, moment = started(name)
    every = max(1, round(0.04 / simulation.dt))
    REPLAYS.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        files = {
            forces: Path(folder) / f"{name}-{forces}.h5" for forces in (False, True)[: 1 + (name in FORCES)]
        }
        with contextlib.ExitStack() as stack:
            recorders = [
                stack.enter_context(
                    amontons.record(file, simulation, every=every, contacts=forces, source=name)
                )
                for forces, file in files.items()
            ]

            def note(now: Simulation, report: amontons.Report) -> None:
                for recorder in recorders:
                    recorder(now, report)

            simulation.run(2 * moment.seconds, after_step=note)
        for forces, file in files.items():
            page = REPLAYS / f"{name}{'-forces' * forces}.html"
            with amontons.read_recording(file) as recording:
                write_page(
                    recording, page, fps=FPS, forces=forces, speed=0.5 if name in SLOW and not forces else 1
                )
            print(f"{page.stem}: {page.stat().st_size // 1024} KB")


def command(name: str) -> str:
    moment = MOMENTS[name]
    words = "".join(f" --set {key}={value}" for key, value in moment.parameters.items())
    return f"amontons run {name}{words} --duration {moment.seconds:g}"


def card(name: str, says: str, how: str, folder: str = "gallery") -> str:
    return f"-   ![{name}](figures/{folder}/{name}.png)\n\n    **{name}**\n\n    {says}\n\n    `{how}`\n"


def page() -> str:
    """The page, from the lists of robots, recipes and scenes and what each says of itself."""
    robots = [card(name, str(start.__doc__), how) for name, (start, _, how) in ROBOTS.items()]
    mechanisms = [
        card(name, recipes.says(name), f"python examples/recipes/{name}.py", "recipes")
        for name in recipes.EYES
    ]
    made = [
        card(name, (scenes.get(name).make.__doc__ or "").strip().split("\n")[0], command(name))
        for name in scenes.names()
    ]
    arch = card(MASONRY, str(masonry.__doc__), "amontons stability arch --horizontal x --film arch.gif")
    grid = '\n<div class="grid cards" markdown>\n\n{}\n</div>\n'
    cards = (robots, mechanisms, [arch], made)
    parts = [grid.format("\n".join(some)) for some in cards]
    heads = ("## Robots\n", f"## Recipes\n{recipes.HEAD}", "## Masonry\n", "## Scenes\n")
    return HEAD + "".join(f"\n{head}{part}" for head, part in zip(heads, parts, strict=True))


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    choices = [[], *ROBOTS, *recipes.EYES, MASONRY, *MOMENTS]
    parser.add_argument("names", nargs="*", choices=choices, metavar="NAME")
    parser.add_argument("--replays", action="store_true", help="pages with a play bar, in out/replays")
    options = parser.parse_args()
    mechanisms = [] if options.replays else [*recipes.EYES, MASONRY]
    to_replay: list[str] = []
    for name in options.names or [*ROBOTS, *mechanisms, *scenes.names()]:
        needs = "coacd" if name in recipes.DECOMPOSED else "gymnasium" if name == "humanoid" else ""
        if needs and not importlib.util.find_spec(needs):
            print(f"{name}: left out, it needs the package {needs}")
        elif name in recipes.EYES:
            recipes.draw(name)
        elif name == MASONRY:
            masonry()
        elif not options.replays:
            picture(name)
        elif options.names or not (REPLAYS / f"{name}.html").exists():
            to_replay.append(name)
    with ProcessPoolExecutor(2) as pool:
        list(pool.map(replay, to_replay))
    if not options.replays:
        PAGE.write_text(page())
        print(PAGE)


if __name__ == "__main__":
    main()
