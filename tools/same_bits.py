"""Whether systems give the same bits: hashes of scenes by the program amontons_bits of each, side by side.

    python tools/same_bits.py --write FOLDER
    python tools/same_bits.py OUTPUT ... [--table FILE]

The first form writes the models of the regression scenes (tests/physics/bits.py) and the table scenes.txt
that amontons_bits reads; they are made once, here, so that all systems start from the same numbers. The
second one compares outputs of that program, each in a file whose name says the system (linux-aarch64.txt),
and prints a table of hashes by scene and law; exit status 1 if two differ.
"""

from __future__ import annotations

import argparse
import sys
from collections import defaultdict
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent


def write(folder: Path) -> None:
    """The models and scenes.txt."""
    sys.path.insert(0, str(ROOT / "tests" / "physics"))
    import amontons
    from bits import SCENES

    folder.mkdir(parents=True, exist_ok=True)
    lines = []
    for name, (parameters, steps) in SCENES.items():
        scene = amontons.scenes.get(name)
        options = {"tolerance": 1e-4, "margin": 0.0, "method": "auto", **scene.options}
        options["tolerance"] = 1e-4
        amontons.write_model(scene.make(**parameters), folder / f"{name}.json")
        lines.append(
            f"{name} {steps} {scene.dt!r} {options['tolerance']!r} {options['margin']!r} {options['method']}"
        )
    (folder / "scenes.txt").write_text("\n".join(lines) + "\n")


Hashes = dict[tuple[str, str], set[str]]


def read(path: Path) -> dict[str, Hashes]:
    """By the instruction set: of each scene and law the hashes, one where threads change nothing."""
    found: dict[str, Hashes] = defaultdict(lambda: defaultdict(set))
    for line in path.read_text().splitlines():
        scene, law, _, isa, value = line.split()
        found[isa][scene, law].add(value)
    return found


def columns(paths: list[Path]) -> dict[str, Hashes]:
    """By system and instruction set."""
    return {f"{path.stem}, {isa}": hashes for path in paths for isa, hashes in read(path).items()}


def table(found: dict[str, Hashes]) -> tuple[list[str], bool]:
    """Markdown with a row for each scene and law, and whether all of each row are the same."""
    cases = sorted({case for hashes in found.values() for case in hashes})
    lines = [f"| Scene | Law | {' | '.join(found)} |", f"|---|---|{'---|' * len(found)}"]
    same = True
    for scene, law in cases:
        values = [hashes.get((scene, law), set()) for hashes in found.values()]
        different = len(set().union(*values)) > 1
        same = same and not different and all(values)
        cells = [" / ".join(f"`{v[:8]}`" for v in sorted(value)) or "missing" for value in values]
        lines.append(f"| {scene} | {law} | {' | '.join(cells)} |{' differs' if different else ''}")
    return lines, same


def summary(found: dict[str, Hashes]) -> list[str]:
    """Markdown with a row for each system and instruction set: the hashes, and whether they are equal."""
    reference = next(iter(found.values()), {})
    lines = ["| System | Instruction set | Scenes x laws | Equal |", "|---|---|--:|---|"]
    for column, hashes in found.items():
        system, isa = column.split(", ")
        equal = hashes == reference and all(len(values) == 1 for values in hashes.values())
        lines.append(f"| {system} | {isa} | {len(hashes)} | {'yes' if equal else '**no**'} |")
    return lines


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("outputs", nargs="*", type=Path)
    parser.add_argument("--write", type=Path, metavar="FOLDER")
    parser.add_argument("--table", type=Path, metavar="FILE")
    given = parser.parse_args()
    if given.write:
        write(given.write)
        return 0
    if not given.outputs:
        sys.exit("amontons: name outputs of amontons_bits, or --write FOLDER")
    lines, same = table(columns(given.outputs))
    lines.append("\nall bits are the same" if same else "\nsome bits differ")
    print("\n".join(lines))
    if given.table:
        given.table.write_text("\n".join(lines) + "\n")
    return 0 if same else 1


if __name__ == "__main__":
    sys.exit(main())
