"""Prints the requirements of pyproject.toml, one per line: to build, to run, to test and to develop.

With the name of an extra as argument, those of the extra alone; with "build", those of the build.
"""

import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent


def requirements(root: Path = ROOT, extra: str = "") -> list[str]:
    data = tomllib.loads((root / "pyproject.toml").read_text())
    if extra == "build":
        return data["build-system"]["requires"]
    extras = data["project"]["optional-dependencies"]
    if extra:
        return extras[extra]
    return [
        *data["build-system"]["requires"],
        *data["project"]["dependencies"],
        *extras["cli"],
        *extras["test"],
        *extras["dev"],
    ]


if __name__ == "__main__":
    print("\n".join(requirements(extra="".join(sys.argv[1:]))))
