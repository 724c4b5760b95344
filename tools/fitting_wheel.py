"""Prints the wheel in dist that this Python and this system can install, of the version in pyproject.toml.

    .venv/bin/python tools/fitting_wheel.py [FOLDER]

Exit status 1 and no output where there is none: `make demo` then compiles. Needs pip, as every virtual environment has it.
"""

from __future__ import annotations

import sys
import tomllib
from pathlib import Path

from pip._vendor.packaging.tags import sys_tags
from pip._vendor.packaging.utils import InvalidWheelFilename, parse_wheel_filename
from pip._vendor.packaging.version import Version

ROOT = Path(__file__).resolve().parent.parent


def fitting(folder: Path, root: Path = ROOT) -> Path | None:
    """The wheel whose tag pip would prefer among those of this version; None where none fits."""
    project = tomllib.loads((root / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    ranks = {tag: rank for rank, tag in enumerate(sys_tags())}
    found = []
    for path in sorted(folder.glob("*.whl")):
        try:
            name, version, _, tags = parse_wheel_filename(path.name)
        except InvalidWheelFilename:
            continue  # a file that pip would refuse too
        rank = min((ranks[tag] for tag in tags if tag in ranks), default=None)
        if name == project["name"] and version == Version(project["version"]) and rank is not None:
            found.append((rank, path))
    return min(found)[1] if found else None


if __name__ == "__main__":
    wheel = fitting(Path(sys.argv[1]) if sys.argv[1:] else ROOT / "dist")
    if wheel is None:
        sys.exit(1)
    print(wheel)
