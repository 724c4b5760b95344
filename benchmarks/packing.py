"""What a solve on a device costs the host before its first kernel: ms to pack the arrays, and bytes sent.

    python benchmarks/packing.py [--quick] [--threads N] [--out FOLDER]

Lattices of spheres of 10^4, 10^5 and 10^6 contacts. Four solves follow each other in the same memory: the
first one; one of the same pairs with other normals and another b, as in a step that finds the pairs of the
last one; the same problem again; one without the last contact, as in a step that finds other pairs. Bytes are
those of the arrays that differ from the solve before, and of x. No device is needed. Times are medians of
processor time, summed over all threads: other work on the machine counts little.
"""

from __future__ import annotations

import statistics
from time import process_time
from typing import Any

import amontons
import numpy as np
from amontons import _core
from common import arguments, with_folders, write_csv
from device import lattice

REPEATS = 5


def turned(problem: amontons.vi.Problem) -> amontons.vi.Problem:
    """The same pairs, with normals, arms and b a little different."""
    A = problem.A
    normal = A.normal + 1e-3 * np.roll(A.normal, 1, axis=1)
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    other = amontons.vi.Contacts(
        A.inverse_mass, A.inverse_inertia[:, :3], A.body_a, A.body_b, -0.5 * normal, 0.5 * normal, normal
    )
    return amontons.vi.Problem(other, 1.01 * problem.b, problem.cones)


def fewer(problem: amontons.vi.Problem) -> amontons.vi.Problem:
    """The same without the last contact."""
    A = problem.A
    rest = (A.body_a[:-1], A.body_b[:-1], A.r_a[:-1], A.r_b[:-1], A.normal[:-1])
    other = amontons.vi.Contacts(A.inverse_mass, A.inverse_inertia[:, :3], *rest)
    return amontons.vi.Problem(other, problem.b[:-3], [amontons.vi.Friction(problem.cones[0].mu[:-1])])


def sent(layout: _core.DeviceLayout) -> int:
    """Bytes of the arrays that differ from those of the solve before, and of x."""
    arrays = layout.arrays()
    return sum(arrays[name].nbytes for name in layout.changed()) + 8 * layout.size


def measured(problem: amontons.vi.Problem, threads: int) -> dict[str, Any]:
    other, less = turned(problem)._core, fewer(problem)._core
    times: dict[str, list[float]] = {"first": [], "other_numbers": [], "same": [], "other_pairs": []}
    sizes: dict[str, int] = {}
    for _ in range(REPEATS):
        begun = process_time()
        layout = _core.DeviceLayout(problem._core, threads)
        times["first"].append(1e3 * (process_time() - begun))
        sizes["first"] = sent(layout)
        for kind, next_one in (("other_numbers", other), ("same", other), ("other_pairs", less)):
            begun = process_time()
            layout.fill(next_one, threads)
            times[kind].append(1e3 * (process_time() - begun))
            sizes[kind] = sent(layout)
    row: dict[str, Any] = {"contacts": problem.contacts, "bodies": layout.bodies, "threads": threads}
    row |= {f"pack_ms_{kind}": statistics.median(all_of) for kind, all_of in times.items()}
    return row | {f"bytes_{kind}": size for kind, size in sizes.items()}


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("--threads", type=int, default=1, help="0: one per core (default: 1)")
    options = with_folders(parser.parse_args())
    sizes = (10_000,) if options.quick else (10_000, 100_000, 1_000_000)
    made = []
    for n in sizes:
        made.append(measured(lattice(n), options.threads))
        print(", ".join(f"{key} {value:.4g}" for key, value in made[-1].items()))
    write_csv(options.out / "packing.csv", made)


if __name__ == "__main__":
    main()
