"""Hashes of what small scenes do, under both laws: they tell when a change alters results to the last bit.

    python tests/physics/golden.py            computes and compares, on all threads and instruction sets
    python tests/physics/golden.py --renew    writes golden.json

Renew when a change is meant to alter results (another default, another order of a sum, better contact
points), and say so in its message; never to silence a difference between numbers of threads or instruction
sets, which is a fault. The core and the scenes take sines and powers from the C library and NumPy, which
round them differently in other versions and on other processors: golden.json names the platform that it
holds for, by its versions and by a hash of such values. Elsewhere only threads and instruction sets are
compared with each other.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import math
import os
import platform
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
from measures import simulate

FILE = Path(__file__).with_name("golden.json")
THREADS = (1, 2, 3)
# Scene: parameters, steps. The resting wall is large enough that its contacts are divided among threads.
SCENES: dict[str, tuple[dict[str, Any], int]] = {
    "wall": ({"columns": 4, "rows": 4, "speed": 6.0}, 25),
    "wall_at_rest": ({}, 1),
    "hopper": ({"count": 40}, 120),
    "card_house": ({"levels": 2}, 30),
    "chain": ({"links": 10}, 60),
    "newtons_cradle": ({}, 100),
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


def scene_hash(name: str, law: str, threads: int) -> str:
    """Of positions, orientations, velocities and contact impulses after the steps of the scene."""
    parameters, steps = SCENES[name]
    sim = simulate(name, parameters, law=law, threads=threads, tolerance=1e-4)
    for _ in range(steps):
        sim.step()
    s = sim.state
    velocities = (s.linear_velocities, s.angular_velocities)
    return digest(s.positions, s.orientations, *velocities, sim.contacts["impulse"])


def hashes(threads: int) -> dict[str, dict[str, str]]:
    return {name: {law: scene_hash(name, law, threads) for law in LAWS} for name in SCENES}


def this_platform() -> dict[str, str]:
    x = np.linspace(-3, 3, 20001)
    library = [[f(v) for v in x.tolist()] for f in (math.sin, math.cos, math.tan)]
    library += [[f(v, 0.7) for v in x.tolist()] for f in (math.atan2, math.hypot, math.remainder)]
    arrays = (np.sin(x), np.cos(x), np.arctan2(x, 0.7), np.hypot(x, 0.7), np.exp(x), np.abs(x) ** 0.3)
    products = x[:900].reshape(100, 3, 3) @ x[9000:9900].reshape(100, 3, 3)
    return {
        "machine": platform.machine(),
        "C library": " ".join(platform.libc_ver()) or platform.platform(),
        "NumPy": np.__version__,
        "sines and powers": digest(*library, *arrays, products),
    }


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
    parser.add_argument("--renew", action="store_true", help="write golden.json")
    parser.add_argument("--print", action="store_true", help="print the hashes of this process as JSON")
    arguments = parser.parse_args()
    if arguments.print:
        print(json.dumps({threads: hashes(threads) for threads in THREADS}))
        return 0
    found = hashes(1)
    for isa in sets_of_the_processor():
        for threads, others in hashes_of_set(isa).items():
            if unlike := differences(found, others):
                print(f"a fault: {isa} on {threads} threads has other bits of {', '.join(unlike)}")
                return 1
    if arguments.renew:
        FILE.write_text(json.dumps({"platform": this_platform(), "hashes": found}, indent=2) + "\n")
        print(FILE)
        return 0
    committed = json.loads(FILE.read_text())
    for name, value in this_platform().items():
        if committed["platform"][name] != value:
            print(f"another platform: {name} is {value}, in golden.json {committed['platform'][name]}")
    unlike = differences(committed["hashes"], found)
    print(
        "\n".join(f"{entry}: other bits than in golden.json" for entry in unlike)
        or "all bits as in golden.json"
    )
    return bool(unlike)


if __name__ == "__main__":
    sys.exit(main())
