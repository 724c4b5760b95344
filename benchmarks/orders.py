"""The order of a step: errors of poses and velocities at four steps, each half of the one before.

    python benchmarks/orders.py [--quick] [--out FOLDER]

The scenes of tests/physics/instants.py, with joints as rows and in coordinates of trees. Errors are those at
the end, beside the limit of the two shortest of six steps by extrapolation. A humanoid of DATA/robots stands
and swings its arms; its errors are those beside a step of 0.1 ms, and it is skipped where it is absent.
Writes orders.csv, a row per scene and form with the errors at four steps and the mean order, log2 of the
first over the last by three. Rows of joints leave errors of position below 1e-4 of
`Model.length` as they are.
"""

from __future__ import annotations

import math
import sys
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
from amontons import ModelBuilder, Simulation, load_model
from common import ROOT, Row, arguments, fill, with_folders

sys.path.insert(0, str(ROOT / "tests" / "physics"))  # where instants is
from instants import MOTIONS, distances, end_of, errors

FORMS = {"none": "rows", "auto": "trees"}
UNSOLVED = [("four-bar", "auto")]
"""Redundant rows of loops of trees miss the tolerance here."""
STANDING = "humanoid that swings its arms"
EXACT = 1e-9
"""m, m/s, rad/s"""


def order(errors: np.ndarray) -> float | str:
    """The mean over halved steps; none where all is exact but for the tolerance of solves."""
    return "" if errors.max() < EXACT else math.log2(errors[0] / errors[-1]) / (len(errors) - 1)


ROBOT = Path("robots") / "mujoco" / "humanoid" / "humanoid.xml"
STANCE, ARMS, LIFT = {"kp": 2000, "kd": 100}, {"kp": 8, "kd": 0.2}, 0.8
"""Gains of servos (N m/rad, N m s/rad); where those of the shoulders swing to, and back (rad)."""


def humanoid(path: Path, h: float, trees: str) -> Simulation:
    """Servos hold the stance; loose ones swing the arms, which start at their sides."""
    model = replace(load_model(path), actuators=(), keyframes=())
    b = ModelBuilder(trees=trees)
    b.add_model(model)
    for joint, dof in ((j, k) for j in model.joints for k in range(len(j.dofs))):
        swings = "shoulder" in joint.name
        to = (LIFT if "right" in joint.name else -LIFT) if swings else 0.0
        b.add_actuator(joint=joint.name, dof=dof, law="position", control=to, **(ARMS if swings else STANCE))
    return Simulation(b.build(), dt=h)


def measured(name: str, trees: str, robot: Path, steps: int = 4) -> Row:
    if name == STANDING:
        duration, longest, make = 0.5, 1e-2, partial(humanoid, robot)
        ends = [end_of(make, duration, longest / 2**k, trees) for k in range(steps)]
        found = distances(ends, end_of(make, duration, 1e-4, trees))
    else:
        (_, duration, longest), found = MOTIONS[name], errors(name, trees, steps)
    row: Row = {"scene": name, "joints": FORMS[trees], "duration": duration, "dt": longest}
    for k, what in enumerate(("position", "velocity")):
        row |= {f"{what}_{n}": found[n, k] for n in range(len(found))} | {f"{what}_order": order(found[:, k])}
    return row


def main() -> None:
    options = with_folders(arguments(__doc__).parse_args())
    cases = [(name, trees) for name in MOTIONS for trees in FORMS if (name, trees) not in UNSOLVED]
    cases, robot = cases[::4] if options.quick else cases, options.data / ROBOT
    if robot.exists():
        cases += [(STANDING, trees) for trees in FORMS]
    else:
        print(f"orders: {STANDING}: skipped, there is no {robot}")
    show = "scene joints position_order velocity_order"
    fill(options.out / "orders.csv", cases, lambda case: [measured(*case, robot)], show)


if __name__ == "__main__":
    main()
