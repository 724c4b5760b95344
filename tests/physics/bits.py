"""Hashes of what small scenes do, under both laws: threads and instruction sets must not change them.

    python tests/physics/bits.py            computes and compares, on all threads and instruction sets

Hashes are compared with each other and kept nowhere: another algorithm may change the bits. Other systems
have the same ones: tools/wheels_test.py compares them. What a scene must do whatever the algorithm is in
bands.py.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import amontons
import numpy as np
from measures import simulate

THREADS = (1, 2, 3)
# Scene: parameters, steps. The resting wall is large enough that its contacts are divided among threads; the
# first ball of the cradle hits the second after 355 steps.
SCENES: dict[str, tuple[dict[str, Any], int]] = {
    "wall": ({"columns": 4, "rows": 4, "speed": 6.0}, 25),
    "wall_at_rest": ({}, 1),
    "hopper": ({"count": 40}, 120),
    "card_house": ({"levels": 2}, 30),
    "chain": ({"links": 10}, 60),
    "newtons_cradle": ({}, 400),
    "tracked_vehicle": ({"slabs": 2}, 15),
}
LAWS = ("coulomb", "associated")
# Flags of /proc/cpuinfo that each instruction set needs; the names are those of AMONTONS_ISA.
SETS = {"baseline": set(), "avx2": {"avx2"}, "avx512": {"avx2", "avx512f", "avx512dq", "avx512vl"}}


def digest(*arrays: Any) -> str:
    state = hashlib.sha256()
    for array in arrays:
        state.update(np.ascontiguousarray(array, dtype=np.float64).tobytes())
    return state.hexdigest()[:16]


def scene_hash(name: str, law: str, threads: int, models: Path | None = None) -> str:
    """Of positions, orientations, velocities and contact impulses after the steps of the scene.

    The model comes from a file of tools/same_bits.py where a folder of these is given: NumPy and SciPy, by
    which the scene of the vehicle finds the pins of its track, have other bits on other systems.
    """
    parameters, steps = SCENES[name]
    options = {"law": law, "threads": threads, "tolerance": 1e-4}
    if models is None:
        sim = simulate(name, parameters, **options)
    else:
        scene = amontons.scenes.get(name)
        model = amontons.load_model(models / f"{name}.json")
        sim = amontons.Simulation(model, **{"dt": scene.dt, **scene.options, **options})
    for _ in range(steps):
        sim.step()
    s = sim.state
    velocities = (s.linear_velocities, s.angular_velocities)
    return digest(s.positions, s.orientations, *velocities, sim.contacts["impulse"])


def hashes(threads: int, models: Path | None = None) -> dict[str, dict[str, str]]:
    return {name: {law: scene_hash(name, law, threads, models) for law in LAWS} for name in SCENES}


def sets_of_the_processor() -> list[str]:
    cpu = Path("/proc/cpuinfo")
    lines = cpu.read_text().split("\n") if cpu.is_file() else []
    flags = set(next((line.split(":")[1] for line in lines if line.startswith("flags")), "").split())
    return [name for name, needed in SETS.items() if needed <= flags]


def hashes_of_set(isa: str) -> dict[str, dict[str, dict[str, str]]]:
    """By the number of threads, in a process that is restricted to one instruction set."""
    command = [sys.executable, __file__, "--print"]
    environment = {**os.environ, "AMONTONS_ISA": isa}
    run = subprocess.run(command, stdout=subprocess.PIPE, text=True, env=environment, check=True)
    return json.loads(run.stdout)


def differences(one: dict[str, dict[str, str]], other: dict[str, dict[str, str]]) -> list[str]:
    """The scenes and laws whose hashes differ, or that only one of both has."""
    keys = {(scene, law) for hashes in (one, other) for scene in hashes for law in hashes[scene]}
    return sorted(
        f"{scene} under {law}"
        for scene, law in keys
        if one.get(scene, {}).get(law) != other.get(scene, {}).get(law)
    )


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--print", action="store_true", help="print the hashes of this process as JSON")
    parser.add_argument("--threads", type=int, nargs="+", default=THREADS, metavar="N")
    parser.add_argument("--models", type=Path, metavar="FOLDER", help="models written by tools/same_bits.py")
    arguments = parser.parse_args()
    if arguments.print:
        print(json.dumps({threads: hashes(threads, arguments.models) for threads in arguments.threads}))
        return 0
    found = hashes(1)
    for isa in sets_of_the_processor():
        for threads, others in hashes_of_set(isa).items():
            if unlike := differences(found, others):
                print(f"a fault: {isa} on {threads} threads has other bits of {', '.join(unlike)}")
                return 1
    print("all bits are the same")
    return 0


if __name__ == "__main__":
    sys.exit(main())
