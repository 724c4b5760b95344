"""How the cost of a step grows with height, plates, mass ratio, length and number; with fitted exponents.

    python benchmarks/growth.py [--quick] [--out FOLDER] [--only PART ...]

Writes growth.csv, a row per family, size and engine: ours at two tolerances, and MuJoCo with its default
settings where it is installed. The exponent of a family is the slope of log(time)
over log(size) by least squares. All run in turns on one core; an engine leaves a family once a step takes too
long.

Writes stages.csv too: spheres with friction that fall into a box, 300 to 300,000 of them, and the
microseconds per contact of our collision, assembly, integration and solve; the last also per product. These
are wall clock, so that they hold on an idle core only. --only stages measures nothing else.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from statistics import median
from typing import Any

import amontons
import amontons.scenes
from beside.engine import Engine, Timed
from beside.engine import engines as installed
from beside.plain import Unsupported
from beside.scenes import plain
from common import Row, arguments, begin, fill, task_row

LIMIT, QUICK_LIMIT = 60.0, 1.0
"""s of processor time of an engine for one size."""
LONG = 0.2
"""s a step, from which on an engine gets no larger size of a family; ours at 1e-3 gets all."""
PARTS = 5
COARSE = 0.1
"""of the steps that are divided into stages"""
STAGES = ("collision", "assembly", "integration", "solve")
SHOWN = ("spheres", "contacts", *STAGES)
STAGED = (300, 3_000, 30_000, 300_000)
"""Spheres whose step is divided into stages; a sample has the first two."""


@dataclass(frozen=True)
class Family:
    """A scene of many sizes. The steps measured are those after `before`, and `steps` of them."""

    name: str
    make: Callable[[float], amontons.Model]
    sizes: tuple[float, ...]
    dt: float
    before: int
    steps: int


def scene(name: str, parameter: str, **fixed: Any) -> Callable[[float], amontons.Model]:
    entry = amontons.scenes.get(name)
    whole = parameter not in ("ratio", "end_mass_ratio")
    return lambda size: entry.make(**{parameter: int(size) if whole else size}, **fixed)


FAMILIES = (
    Family("wall, rows", scene("wall_at_rest", "rows", columns=10), (4, 8, 16, 32, 64), 5e-3, 5, 20),
    Family("plates 1:100", scene("plates", "count", ratio=100.0), (5, 10, 20, 40, 80), 1e-2, 5, 40),
    Family("20 plates, mass ratio", scene("plates", "ratio"), (1, 10, 100, 1e3, 1e4), 1e-2, 5, 40),
    Family("chain, links", scene("chain", "links", end_mass_ratio=10.0), (10, 30, 100, 300, 1000),
           5e-3, 5, 20),
    Family("chain of 40, mass ratio", scene("chain", "end_mass_ratio", links=40), (1, 10, 100, 1e3, 1e4),
           5e-3, 5, 40),
    # After 0.1 s of fall the spheres meet from the floor upwards.
    Family("spheres in a box", scene("spheres_in_box", "count", mu=0.5), (100, 1e3, 1e4, 1e5), 1e-2, 10, 5),
)  # fmt: skip


def engines() -> Iterator[Engine]:
    yield from (e for e in installed("amontons", "mujoco") if e.key == "amontons" or not e.tuned)


@dataclass
class Entry(Timed):
    engine: Engine
    spent: float = 0.0

    def part(self, steps: int, limit: float) -> bool:
        """So many steps, none once the processor time is used up. Whether the engine can."""
        if self.spent < limit and self.go_on(steps):
            self.spent += steps * self.times[-1]
        if self.why:
            print(f"growth: {self.engine.name} has {self.why}")
        return not self.why


def measured(family: Family, size: float, chosen: Iterable[Engine], limit: float) -> list[Row]:
    """A row per engine: the median time of a step over equal parts, made in turns."""
    scene, entries = plain(family.make(size)), []
    for engine in chosen:
        try:
            entries.append(Entry(engine.start(scene, family.dt), engine))
        except Unsupported as missing:
            print(f"growth: {family.name}: {engine.name} has no {missing}")
    # Step by step before the measurement, where one may take long.
    entries = [entry for entry in entries if all(entry.part(1, limit) for _ in range(family.before))]
    for entry in entries:
        entry.times.clear()
    for _ in range(PARTS):
        entries = [entry for entry in entries if entry.part(max(1, family.steps // PARTS), limit)]
    for entry in entries:
        entry.running.close()
    known = {"size": size, "bodies": len(scene.bodies), "dt": family.dt}
    return [
        task_row(family.name, e.engine.name, median(e.times) if e.times else "")
        | known | {"over": e.spent >= limit or not e.times}
        for e in entries
    ]  # fmt: skip


def staged(count: int, before: int = 20, steps: int = 5) -> Row:
    """Microseconds per contact of each stage of a step: medians over steps of spheres that fall into a box.

    The tolerance is coarse: solves of large piles would take minutes, and say nothing of the other stages.
    """
    model = amontons.scenes.get("spheres_in_box").make(count=count, mu=0.5)
    sim = amontons.Simulation(model, dt=1e-2, tolerance=COARSE, threads=1)
    for _ in range(before):
        sim.step()
    reports = [sim.step() for _ in range(steps)]
    row: Row = {"spheres": count, "contacts": median(r.contacts for r in reports)}
    for stage in STAGES:
        row[stage] = median(1e6 * getattr(r.timings, stage) / max(r.contacts, 1) for r in reports)
    row["products"] = median(r.products for r in reports)
    row["solve_per_product"] = row["solve"] / max(row["products"], 1)
    row["missed"] = sum(r.residual > COARSE for r in reports)
    return row


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("--only", nargs="*", default=[], help="families whose names contain one of these")
    options = parser.parse_args()
    begin(options, sample=bool(options.only))

    def rows(family: Family) -> Iterator[Row]:
        chosen = list(engines())
        for size in family.sizes[:3] if options.quick else family.sizes:
            found = measured(family, size, chosen, QUICK_LIMIT if options.quick else LIMIT)
            yield from found
            late = {r["method"] for r in found if r["over"] or r["time"] > LONG} - {"amontons, 1e-3"}
            chosen = [e for e in chosen if e.name not in late]

    families = [f for f in FAMILIES if not options.only or any(part in f.name for part in options.only)]
    fill(options.out / "growth.csv", families, rows, "task size method time")
    if not options.only or "stages" in options.only:
        counts = STAGED[:2] if options.quick else STAGED
        fill(options.out / "stages.csv", counts, lambda count: [staged(count)], " ".join(SHOWN))


if __name__ == "__main__":
    main()
