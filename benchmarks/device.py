"""Devices: ns per contact and iteration beside the copy rate of the device, phases of steps, joints, a film.

    python benchmarks/device.py [--device NAME ...] [--largest CONTACTS] [--quick] [--out FOLDER]

Runs on every GPU that is found, or on the devices that are named. It writes device.csv, joints.csv,
simulations.csv, environment.csv and avalanche.webp to benchmarks/results/<device>. It needs Python, NumPy, a
compiler, and CuPy or pyopencl. --quick shows that everything runs: `--device opencl --quick` by pocl.
"""

from __future__ import annotations

import argparse
import os
import platform
import re
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import date
from pathlib import Path
from time import perf_counter
from typing import Any

import amontons
import numpy as np
from amontons import _core, scenes
from amontons.device.backend import Backend, Device, Memory
from amontons.device.found import chosen_device, open_device
from amontons.device.methods import DeviceMethod, tiles
from amontons.device.pairs import PairFinder
from amontons.problem.options import core_options
from common import RESULTS, Row, shown, write_csv

BYTES = {"p-spg-fb": 408, "apgd": 512}
"""bytes per contact and iteration, as kernels.cl counts them"""
BYTES_OF_BODY = 160
PHASES = ("collision", "assembly", "solve", "integration", "total")
COUNTED = ("searches", "launches", "reads", "sent", "read")
HOST_BYTES = 1500
"""per contact, that problem and layout take on the host"""


def lattice(n: int) -> amontons.vi.Problem:
    """About n contacts: spheres on a cubic lattice over the ground, each touching its neighbours."""
    side = max(2, round((n / 3) ** (1 / 3)))
    body = np.arange(side**3).reshape(side, side, side)
    a = [body[1:].ravel(), body[:, 1:].ravel(), body.reshape(side, side, side)[:, :, 1:].ravel()]
    b = [body[:-1].ravel(), body[:, :-1].ravel(), body[:, :, :-1].ravel()]
    normal = np.repeat(np.eye(3), [len(part) for part in a], axis=0)
    ground = body[:, :, 0].ravel()
    upper = np.concatenate([*a, ground]).astype(np.int32)
    lower = np.concatenate([*b, np.full(len(ground), -1)]).astype(np.int32)
    normal = np.concatenate([normal, np.tile([0.0, 0, 1], (len(ground), 1))])
    A = amontons.vi.Contacts(
        np.ones(body.size), np.full((body.size, 3), 2.5), upper, lower, -0.5 * normal, 0.5 * normal, normal
    )
    rng = np.random.default_rng(1)
    right = 0.01 * rng.normal(size=3 * len(upper))
    right[::3] -= 0.05 * np.where(lower < 0, 1.0, 0.1)
    return amontons.vi.Problem(A, right, [amontons.vi.Friction(np.full(len(upper), 0.5))])


def copy_rate(backend: Backend, nbytes: int) -> float:
    """GB/s that a kernel copies, what is read and what is written together."""
    memory = Memory(backend)
    count = nbytes // 8
    held = memory.buffer("copied", 2 * nbytes)
    best = float("inf")
    for _ in range(5):
        backend.download(held, 0, 1)
        begun = perf_counter()
        for _ in range(10):
            backend.launch("copy", tiles(count), held, np.uint32(0), np.uint32(count), np.uint32(count))
        backend.download(held, 0, 1)
        best = min(best, (perf_counter() - begun) / 10)
    return 2 * nbytes / best / 1e9


class Counted:
    """A source of solves on a device, of which the last one counts its launches and reads."""

    def __init__(self, backend: Backend) -> None:
        self.memory, self.made = Memory(backend), None
        self.source = _core.IterateSource(backend.device.name, self._make, True, 0, True)
        self._backend = backend

    def _make(self, problem: _core.Problem, law: _core.Law, threads: int = 0) -> DeviceMethod:
        self.made = DeviceMethod(problem, law, self._backend, self.memory, threads=threads)
        return self.made


def solve_time(problem: amontons.vi.Problem, method: str, iterations: int, source: Any = None) -> float:
    """s of a solve of so many iterations, its preparation and three products of the host included."""
    options = core_options(
        method, law="coulomb", tolerance=0, max_iterations=iterations, deadline=None, history=False,
        threads=None, method_options={},
    )  # fmt: skip
    options.iterates = source
    begun = perf_counter()
    _core.solve(problem._core, method, options, None, None)
    return perf_counter() - begun


def per_iteration(problem: amontons.vi.Problem, method: str, source: Any = None) -> float:
    """s of one iteration: a long solve less a short one. The preparation of the problem, which both contain,
    would hide the difference of too few iterations."""
    few, many = (min(solve_time(problem, method, n, source) for _ in range(2)) for n in (2, 202))
    return max(many - few, 0) / 200


def fits_host(contacts: int) -> bool:
    try:
        return HOST_BYTES * contacts < 0.8 * os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (ValueError, OSError):
        return True


def sizes(options: argparse.Namespace, backend: Backend, rate: float) -> Iterator[Row]:
    n = 1_000 if options.quick else 10_000
    while n <= options.largest and fits_host(n):
        begun = perf_counter()
        problem = lattice(n)
        made = perf_counter() - begun
        contacts, bodies = problem.rows // 3, problem.A.bodies
        for method in ("p-spg-fb", "apgd"):
            try:
                begun = perf_counter()
                counted = Counted(backend)
                counted._make(problem._core, _core.Law.coulomb)
                uploaded = perf_counter() - begun
                time = per_iteration(problem, method, counted.source)
            except amontons.InputError as error:  # no room
                print(error)
                return
            read = BYTES[method] * contacts + BYTES_OF_BODY * bodies
            yield {
                "problem": "lattice", "contacts": contacts, "bodies": bodies, "method": method,
                "ns": 1e9 * time / contacts, "ns_cpu": 1e9 * per_iteration(problem, method) / contacts,
                "gb_per_s": read / time / 1e9, "copy_gb_per_s": rate, "share": read / time / 1e9 / rate,
                "memory_bytes_per_contact": counted.memory.nbytes / contacts, "make_s": made,
                "upload_s": uploaded, "us_iteration": 1e6 * time,
                "launches_iteration": counted.made.launches / 202,
                "reads_iteration": counted.made.reads / 202,
            }  # fmt: skip
            del counted
        n *= 10


def with_joints(backend: Backend) -> Iterator[Row]:
    """A vehicle on its tracks and a long chain: rows of joints."""
    for name, parameters in (("tracked_vehicle", {}), ("network", {})):
        sim = amontons.Simulation(scenes.make(name, **parameters), tolerance=1e-3, on_failure="ignore")
        sim.step()
        problem = sim.problem()
        for method in ("p-spg-fb", "apgd"):
            time = per_iteration(problem, method, Counted(backend).source)
            yield {
                "problem": name, "contacts": problem.contacts, "rows": problem.rows - 3 * problem.contacts,
                "method": method, "us_iteration": 1e6 * time, "us_cpu": 1e6 * per_iteration(problem, method),
            }  # fmt: skip


def phases(sim: amontons.Simulation, steps: int) -> dict[str, float]:
    """ms of a step by its phases, and iterations: means over some steps, after one that fills the memory."""
    sim.step()
    sums: dict[str, float] = dict.fromkeys((*PHASES, "iterations"), 0.0)
    for _ in range(steps):
        report = sim.step()
        sums["iterations"] += report.iterations / steps
        for phase in PHASES:
            sums[phase] += 1e3 * getattr(report.timings, phase) / steps
    return sums


@contextmanager
def traffic(backend: Backend) -> Iterator[dict[str, float]]:
    """Counts what a device launches, reads (MB: `read`) and is sent (MB), by searches and solves."""
    held: Any = backend
    own = {name: getattr(held, name) for name in ("upload", "download", "launch", "program")}
    counts = dict.fromkeys((f"{what}_{part}" for part in ("search", "solve") for what in COUNTED), 0.0)
    find, part = PairFinder.find, ["solve"]

    def note(what: str, amount: float) -> None:
        counts[f"{what}_{part[0]}"] += amount

    def upload(buffer: Any, values: Any, begin: int = 0) -> None:
        note("sent", values.nbytes / 1e6)
        own["upload"](buffer, values, begin)

    def download(buffer: Any, begin: int, count: int) -> Any:
        note("reads", 1)
        note("read", 8 * count / 1e6)
        return own["download"](buffer, begin, count)

    def launch(*given: Any) -> None:
        note("launches", 1)
        own["launch"](*given)

    def program(launches: Any) -> Any:
        run = own["program"](launches)

        def counted() -> None:
            before = counts["launches_solve"]
            run()
            if counts["launches_solve"] == before:  # a graph, which launches by itself
                note("launches", len(launches))

        return counted

    def searched(finder: Any, *given: Any) -> Any:
        part[0] = "search"
        note("searches", 1)
        try:
            return find(finder, *given)
        finally:
            part[0] = "solve"

    held.upload, held.download, held.launch, held.program = upload, download, launch, program
    PairFinder.find = searched  # type: ignore[method-assign]
    try:
        yield counts
    finally:
        PairFinder.find = find  # type: ignore[method-assign]
        for name in own:
            delattr(held, name)


def simulated(device: Device, counts: tuple[int, ...], steps: int) -> Iterator[Row]:
    """The same steps of falling spheres on the CPU and on the device, and what the device is sent."""
    for count in counts:
        model = scenes.make("spheres_in_box", count=count, radius=0.05)
        start = amontons.Simulation(model, tolerance=1e-2, max_iterations=20, on_failure="ignore")
        start.run(0.4)
        row: Row = {"spheres": count}
        given = dict(device_contacts=1, method="apgd", tolerance=1e-3, max_iterations=300)
        for name in ("cpu", device.name):
            sim = start.copy()
            sim.change_options(device=name, **given)
            where = "cpu" if name == "cpu" else "device"
            for key, value in phases(sim, steps).items():
                row[f"{key}_{where}" if key == "iterations" else f"{key}_ms_{where}"] = value
        with traffic(open_device(device)) as counted:
            sim.change_options(device=device.name, **given)
            sim.step()
            counted.update(dict.fromkeys(counted, 0.0))
            for _ in range(steps):
                sim.step()
        row |= {name: value / steps for name, value in counted.items() if name != "searches_solve"}
        yield row | {"contacts": len(sim.contacts)}


def film(device: Device, path: Path, count: int, duration: float) -> None:
    """An avalanche on the device, by the command that users have."""
    words = ["run", "avalanche", "--count", str(count), "--duration", str(duration), "--method", "apgd"]
    words += ["--tolerance", "1e-3", "--device", device.name, "--film", str(path), "--azimuth", "-55"]
    subprocess.run([sys.executable, "-m", "amontons", *words], check=False)  # 1: a step missed its tolerance
    if not path.exists():
        raise SystemExit(f"{path}: no film was drawn")


def write(path: Path, rows: list[Row]) -> None:
    write_csv(path, rows)
    for row in rows:
        print(", ".join(f"{key} {shown(value)}" for key, value in row.items()))


def measure(device: Device, options: argparse.Namespace) -> None:
    folder = options.out or RESULTS / (
        re.sub(r"[^a-z0-9]+", "-", device.hardware.lower()).strip("-") or "device"
    )
    folder.mkdir(parents=True, exist_ok=True)
    backend = open_device(device)
    rate = copy_rate(backend, min(1 << 29, device.memory // 8) // 256 * 256)
    print(f"{device.name}: {device.hardware}, {device.driver}, copies {rate:.4g} GB/s")
    rows = list(sizes(options, backend, rate))
    write(folder / "device.csv", rows)
    write(folder / "joints.csv", list(with_joints(backend)))
    counts = (300,) if options.quick else tuple(n for n in (10_000, 100_000) if n <= options.largest)
    if counts:
        write(folder / "simulations.csv", list(simulated(device, counts, steps=5)))
    environment = {
        "device": device.hardware, "driver": device.driver, "memory": device.memory, "copy_gb_per_s": rate,
        "cores": os.cpu_count(), "system": platform.platform(), "compiler": _core.compiler(),
        "amontons": amontons.__version__, "numpy": np.__version__, "date": date.today().isoformat(),
    }  # fmt: skip
    write(folder / "environment.csv", [environment])
    film(device, folder / "avalanche.webp", *((60, 0.3) if options.quick else (20_000, 1.2)))


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--device", action="append", help="devices by name (default: every GPU)")
    parser.add_argument("--largest", type=int, default=10_000_000, help="contacts of the largest problem")
    parser.add_argument("--out", type=Path, help="folder for the CSV files (default: by device)")
    parser.add_argument("--quick", action="store_true", help="a sample, to see that everything runs")
    options = parser.parse_args()
    if options.quick:
        options.largest = min(options.largest, 1_000)
    named = [chosen_device(name) for name in options.device or ()]
    chosen = named or [d for d in amontons.devices() if d.kind == "gpu" and d.doubles]
    if not chosen:
        raise SystemExit(
            "no GPU was found; `amontons doctor` says what is missing, --device opencl takes pocl"
        )
    for device in chosen:
        measure(device, options)


if __name__ == "__main__":
    main()
