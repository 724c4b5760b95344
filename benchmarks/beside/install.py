"""Makes an environment of its own for each engine, in build/engines.

    python -m beside.install [NAME ...]

One that cannot be installed is named and left out: its rows are missing then. One that is there stays.
"""

from __future__ import annotations

import subprocess
import sys
import venv

from .engine import ENVIRONMENTS, NAMES, adapter, python_of


def install(key: str) -> bool:
    packages = adapter(key).PACKAGES
    if not packages or python_of(key):
        return True
    folder = ENVIRONMENTS / key
    venv.create(folder, with_pip=True)
    run = subprocess.run([str(folder / "bin" / "python"), "-m", "pip", "install", "-q", *packages])
    return run.returncode == 0


def main() -> None:
    for key in sys.argv[1:] or NAMES:
        print(f"{key}: {'installed' if install(key) else 'cannot be installed here'}", flush=True)


if __name__ == "__main__":
    main()
