"""What small scenes do, in quantities with bands: they tell when a change alters the physics or the work.

    python tests/physics/bands.py             measures and compares
    python tests/physics/bands.py --derive    prints bands.csv as the rules below derive it

Quantities of a run at the tolerance 1e-4, a row per scene and law:
- residual: the worst of all steps. Every step converges, so that it is at most the tolerance.
- iterations, factorizations: sums over all steps; solves: solver calls of the step with most of them, where
  the report counts them. At most three times what `auto` needed when the band was derived, or what the
  interior point alone needs, so that `auto` may take either way, or one per step.
- penetration, joint_error (m): the largest of all steps. At most three times the largest of the VARIANTS.
- energy (J), in the middle of the last step, and height of the centre of mass (m) at the end. Within three
  times the largest difference that a variant makes.
The variants are honest changes of algorithm: other methods, tolerances and starts, and positions corrected by
velocities. No band is narrower than what moves everything by 1e-5 of the size of a body: a step at the
tolerance leaves velocities of about 1e-4 g h = 5e-6 m/s, which is 1e-6 m after 40 steps of 5 ms.

A band that is derived anew may become narrower. One that must become wider needs a reason in the message of
the change.
"""

from __future__ import annotations

import argparse
import csv
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import amontons
import numpy as np
from bits import LAWS, SCENES
from measures import energy_in_the_middle, simulate

FILE = Path(__file__).with_name("bands.csv")
TOLERANCE = 1e-4
VARIANTS: dict[str, dict[str, Any]] = {
    "first order": {"method": "apgd"},
    "interior point": {"method": "interior-point"},
    "loose": {"tolerance": 1e-3},
    "tight": {"tolerance": 1e-6},
    "cold": {"warm_start": False},
    "velocities": {"recovery": "velocity"},
}
FACTOR = 3.0
FLOOR = 1e-5
"""of `Model.length`"""
WORK = ("solves", "iterations", "factorizations")
ERRORS = ("penetration", "joint_error")
CENTRED = ("energy", "height")

Quantities = dict[str, float]
Fault = Callable[[amontons.Simulation, int], None]
"""changes a simulation after a step, of which it gets the number"""


def scene(name: str, law: str, **options: Any) -> amontons.Simulation:
    return simulate(name, SCENES[name][0], law=law, **{"threads": 1, "tolerance": TOLERANCE, **options})


def measure(sim: amontons.Simulation, steps: int, fault: Fault | None = None) -> Quantities:
    reports = []
    for step in range(steps):
        reports.append(sim.step())
        if fault is not None:
            fault(sim, step)
    found = {
        "residual": max(r.residual for r in reports),
        "iterations": float(sum(r.iterations for r in reports)),
        "factorizations": float(sum(r.factorizations for r in reports)),
        "penetration": max(r.penetration for r in reports),
        "joint_error": max(r.joint_error for r in reports),
        "energy": energy_in_the_middle(sim) + reports[-1].spring_energy,
        "height": float(masses(sim) @ sim.state.positions[:, 2] / masses(sim).sum()),
    }
    if hasattr(reports[0], "solves"):
        found["solves"] = float(max(r.solves for r in reports))
    return found


def masses(sim: amontons.Simulation) -> np.ndarray:
    """The masses of the dynamic bodies, zero for the others (kg)."""
    return np.array([body.mass if body.motion == "dynamic" else 0.0 for body in sim.model.bodies])


def measured(name: str, law: str, **options: Any) -> Quantities:
    return measure(scene(name, law, **options), SCENES[name][1])


def outside(found: Quantities, band: dict[str, str]) -> list[str]:
    """The quantities that are outside their bands; one that is not finite is."""
    out = [] if found["residual"] <= TOLERANCE else ["residual"]
    out += [q for q in (*WORK, *ERRORS) if q in found and band[q] and not found[q] <= float(band[q])]
    out += [q for q in CENTRED if not abs(found[q] - float(band[q])) <= float(band[f"{q}_within"])]
    return out


def read_bands() -> dict[tuple[str, str], dict[str, str]]:
    """The rows of bands.csv by scene and law."""
    with FILE.open() as lines:
        return {(row["scene"], row["law"]): row for row in csv.DictReader(lines)}


def derive(name: str, law: str) -> dict[str, str]:
    """A row of bands.csv."""
    sim = scene(name, law)
    floor = FLOOR * sim.model.length
    floors = {
        "penetration": floor,
        "joint_error": floor,
        "height": floor,
        "energy": floor * float(masses(sim).sum() * np.linalg.norm(sim.model.gravity)),
    }
    now = measured(name, law)
    others = {variant: measured(name, law, **options) for variant, options in VARIANTS.items()}
    row = {"scene": name, "law": law}
    for q in WORK:
        alone, each = others["interior point"], 1 if q == "solves" else SCENES[name][1]
        row[q] = f"{max(FACTOR * now[q], alone[q], each):.0f}" if q in now else ""
    for q in ERRORS:
        row[q] = f"{max(FACTOR * max(other[q] for other in (now, *others.values())), floors[q]):.2g}"
    for q in CENTRED:
        difference = max(abs(other[q] - now[q]) for other in others.values())
        row[q], row[f"{q}_within"] = f"{now[q]:.9g}", f"{max(FACTOR * difference, floors[q]):.2g}"
    return row


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--derive", action="store_true", help="print bands.csv as the rules derive it")
    entries = [(name, law) for name in SCENES for law in LAWS]
    if parser.parse_args().derive:
        rows = [derive(*entry) for entry in entries]
        writer = csv.DictWriter(sys.stdout, rows[0], lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
        return 0
    bands, faults = read_bands(), 0
    for entry in entries:
        found = measured(*entry)
        out = outside(found, bands[entry])
        faults += bool(out)
        values = ", ".join(f"{q} {value:.6g}" for q, value in found.items())
        print(f"{' under '.join(entry)}: {'outside: ' + ', '.join(out) if out else 'within'} ({values})")
    return int(faults > 0)


if __name__ == "__main__":
    sys.exit(main())
