"""Measurements and results of others beside ours: tosses, Adams, impacts, a damper, masonry, clearances,
a four-bar linkage.

    python benchmarks/measurements.py [--quick] [--only PART ...] [--data FOLDER] [--out FOLDER]

Reads all files of the folders of DATA/measured, and skips with a message what is not there. Writes
measured_PART.csv, a row per figure.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

from common import Row, arguments, fill, with_folders
from measured import adams, clearances, damper, four_bar, impacts, masonry, tosses

PARTS: dict[str, tuple[str, Callable[[Path, bool], Iterator[Row]]]] = {
    "tosses": ("cube_tosses", tosses.rows),
    "adams": ("adams_joints", adams.rows),
    "impacts": ("impacts_ellipse", impacts.rows),
    "damper": ("friction_damper", damper.rows),
    "masonry": ("masonry", masonry.rows),
    "clearances": ("siconos", clearances.rows),
    "four_bar": ("siconos", four_bar.rows),
}
"""By name: a folder of DATA/measured, and the function that makes rows of it."""


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("--only", nargs="+", choices=PARTS, default=list(PARTS), metavar="PART")
    options = with_folders(parser.parse_args(), needs=())
    for name in options.only:
        folder, rows = PARTS[name]
        path = options.data / "measured" / folder
        if not path.is_dir():
            print(f"{name}: skipped, there is no {path}")
            continue
        fill(options.out / f"measured_{name}.csv", [path], lambda path, rows=rows: rows(path, options.quick))


if __name__ == "__main__":
    main()
