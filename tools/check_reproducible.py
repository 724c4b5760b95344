"""Makes the wheel twice, from copies of the sources in two folders, and compares the files.

    .venv/bin/python tools/check_reproducible.py [--keep]

Prints the SHA-256 of both; exit status 1 and the members that differ if they are not the same. Two full
compilations: minutes of processor time each. The compiler is $CXX or c++; caches of compilers are off. With
--keep the folder build/reproducible stays. Between two machines the compiler may differ: its name and version
are in the bill of materials of the wheel.
"""

from __future__ import annotations

import argparse
import hashlib
import os
import shutil
import sys
import tarfile
import zipfile
from pathlib import Path

from make_wheel import run

ROOT = Path(__file__).resolve().parent.parent
WORK = ROOT / "build" / "reproducible"


def source(name: str) -> Path:
    """The sources as the source distribution has them, unpacked into a folder of this name."""
    folder = WORK / name
    code = "import sys; from scikit_build_core.build import build_sdist; build_sdist(sys.argv[1])"
    run(sys.executable, "-c", code, folder, cwd=ROOT)
    (archive,) = folder.glob("*.tar.gz")
    with tarfile.open(archive) as tar:
        tar.extractall(folder, filter="data")
    return next(path for path in folder.iterdir() if path.is_dir())


def wheel(name: str) -> Path:
    """The wheel that the sources in a folder of this name give."""
    where = source(name)
    variables = {**os.environ, "CCACHE_DISABLE": "1", "SCCACHE_RECACHE": "1"}
    run(sys.executable, "-m", "pip", "wheel", "--no-build-isolation", "--no-deps", "-w", WORK / name,
        "--config-settings", f"build-dir={WORK / name / 'objects'}", where, env=variables)  # fmt: skip
    return next((WORK / name).glob("*.whl"))


def digest(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()


def members(path: Path) -> dict[str, tuple[str, tuple[int, ...], int]]:
    """Digest, date and mode of each file in a wheel, in its order."""
    with zipfile.ZipFile(path) as archive:
        files = archive.infolist()
        return {f.filename: (digest(archive.read(f)), f.date_time, f.external_attr) for f in files}


def compare(first: Path, second: Path) -> int:
    """Prints the digests of two wheels and what differs; 1 if anything does."""
    for path in (first, second):
        print(digest(path.read_bytes()), path.name)
    if first.read_bytes() == second.read_bytes():
        print("the same bytes twice")
        return 0
    a, b = members(first), members(second)
    for name in sorted(a.keys() | b.keys()):
        if a.get(name) != b.get(name):
            print(f"differs: {name}")
    if a == b:
        print("differs: order or compression of the members")
    return 1


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("--keep", action="store_true")
    given = parser.parse_args()
    shutil.rmtree(WORK, ignore_errors=True)
    status = compare(wheel("first"), wheel("the-second-folder"))
    if not given.keep:
        shutil.rmtree(WORK)
    return status


if __name__ == "__main__":
    sys.exit(main())
