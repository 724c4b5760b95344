"""How long model files take to load: python benchmarks/loading.py [FILE ...]

Without files: 1600 free boxes, and the humanoid of MuJoCo where the shared data are. Fastest of five, once
the packages are imported; beside it MuJoCo alone, whose compiler is part of the time.
"""

import argparse
import tempfile
import time
import warnings
from collections.abc import Callable
from pathlib import Path

import amontons
import mujoco

HUMANOID = Path(__file__).parents[2] / "shared/data/robots/mujoco/humanoid/humanoid.xml"


def boxes(count: int) -> str:
    """MJCF of free boxes in rows of 20, layers of 400."""
    bodies = "".join(
        f'<body pos="{0.3 * (i % 20):g} {0.3 * (i // 20 % 20):g} {0.2 + 0.3 * (i // 400):g}"><freejoint/>'
        '<geom type="box" size=".1 .1 .1"/></body>'
        for i in range(count)
    )
    return f'<mujoco><worldbody><geom type="plane" size="9 9 .1"/>{bodies}</worldbody></mujoco>'


def fastest(work: Callable[[], object], repeats: int = 5) -> float:
    """Seconds."""
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return min(times)


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("files", nargs="*", type=Path, metavar="FILE")
    files = parser.parse_args().files
    warnings.simplefilter("ignore")
    with tempfile.TemporaryDirectory() as folder:
        if not files:
            many = Path(folder) / "1600 boxes.xml"
            many.write_text(boxes(1600))
            files = [many, *([HUMANOID] if HUMANOID.exists() else [])]
        print(f"{'file':24} {'bodies':>7} {'load_model':>11} {'MuJoCo':>9}")
        for file in files:
            bodies = len(amontons.load_model(file).bodies)
            ours = fastest(lambda file=file: amontons.load_model(file))  # type: ignore[misc]
            theirs = ""
            if file.suffix in (".xml", ".mjcf", ".urdf"):
                alone = fastest(lambda file=file: mujoco.MjModel.from_xml_path(str(file)))  # type: ignore[misc]
                theirs = f"{alone:.3f} s"
            print(f"{file.stem:24} {bodies:7d} {ours:9.3f} s {theirs:>9}")


if __name__ == "__main__":
    main()
