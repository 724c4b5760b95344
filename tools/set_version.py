"""Writes the version of a release into every file that names it.

    python tools/set_version.py 1.2.3 2030-01-31

`pyproject.toml` is the one source: the build and the package read it. The other files are copies for their
readers. Without arguments the program prints every file that disagrees, and fails if there is one.
"""

from __future__ import annotations

import re
import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
# File -> the text before a version, and whether it is the whole one (1.2.3) or the minor one (1.2).
PLACES = {
    "pyproject.toml": (r'^version = "', True),
    "CITATION.cff": (r"^version: ", True),
    "recipe/recipe.yaml": (r'^  version: "', True),
    "docs/cli.md": (r"^amontons {9}", True),
    "docs/cpp.md": (r"^find_package\(amontons ", False),
    "README.md": (r"^Version ", False),
    **dict.fromkeys(
        (
            "examples/cpp/CMakeLists.txt",
            "examples/first_hour/cpp_loop/CMakeLists.txt",
            "tests/cpp/consumer/CMakeLists.txt",
        ),
        (r"^find_package\(amontons ", False),
    ),
}
NUMBER = r"\d+(?:\.\d+)+"
UNRELEASED = "## [Unreleased]\n"


def version_of(root: Path) -> str:
    return tomllib.loads((root / "pyproject.toml").read_text())["project"]["version"]


def faults(root: Path) -> list[str]:
    """The files that do not name the version of pyproject.toml, or not its date of release."""
    version = version_of(root)
    found = []
    for name, (before, whole) in PLACES.items():
        wanted = version if whole else version.rpartition(".")[0]
        named = re.findall(rf"(?m){before}({NUMBER})", (root / name).read_text())
        if named != [wanted]:
            found.append(f"{name}: names {', '.join(named) or 'no version'}, not {wanted}")
    date = re.findall(r"(?m)^date-released: (\S+)$", (root / "CITATION.cff").read_text())
    changelog = (root / "CHANGELOG.md").read_text()
    if not date or f"\n## [{version}] - {date[0]}\n" not in changelog:
        found.append(f"CHANGELOG.md: no section of {version} with the date of CITATION.cff")
    if UNRELEASED not in changelog:
        found.append("CHANGELOG.md: no section of what is unreleased")
    return found


def write(root: Path, version: str, date: str) -> None:
    """Sets version and date everywhere; what is unreleased in the changelog becomes that version."""
    for name, (before, whole) in PLACES.items():
        text = (root / name).read_text()
        new = version if whole else version.rpartition(".")[0]
        (root / name).write_text(re.sub(rf"(?m)({before}){NUMBER}", rf"\g<1>{new}", text, count=1))
    citation = root / "CITATION.cff"
    citation.write_text(re.sub(r"(?m)^date-released: .*$", f"date-released: {date}", citation.read_text()))
    changelog = root / "CHANGELOG.md"
    heading = f"{UNRELEASED}\n## [{version}] - {date}\n"
    changelog.write_text(changelog.read_text().replace(UNRELEASED, heading, 1))


def main(arguments: list[str]) -> int:
    if arguments:
        version, date = arguments
        if not re.fullmatch(r"\d+\.\d+\.\d+", version) or not re.fullmatch(r"\d{4}-\d\d-\d\d", date):
            raise SystemExit("give a version such as 1.2.3 and a date such as 2030-01-31")
        write(ROOT, version, date)
    found = faults(ROOT)
    print("\n".join(found) or f"one version everywhere: {version_of(ROOT)}")
    return bool(found)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
