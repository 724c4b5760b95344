"""What the viewer costs: processor time of the server for 25 updates per second of n bodies that all move.

The simulation does not step: its state is written, so that all processor time of the process is the viewer's.
A client in a process of its own takes what the server sends, as a page does. Writes viewer.csv: bodies,
updates per second that were sent, seconds of processor per second, bytes per second.
"""

from __future__ import annotations

import multiprocessing
import time
from typing import Any

import amontons
import numpy as np
from amontons import ModelBuilder, Simulation, shapes
from common import arguments, with_folders, write_csv

SIZES = (100, 1000, 4000)
RATE = 25.0


def field(bodies: int) -> Simulation:
    """A lattice of boxes, spheres and capsules."""
    builder = ModelBuilder(gravity=(0, 0, 0))
    kinds = (shapes.Box((0.2, 0.15, 0.1)), shapes.Sphere(0.2), shapes.Capsule(0.1, 0.2))
    side = round(bodies ** (1 / 3)) + 1
    for k in range(bodies):
        place = np.array([k % side, k // side % side, k // side**2], dtype=float)
        builder.add_body(f"{k}", shape=kinds[k % 3], density=1000, position=tuple(place))
    return Simulation(builder.build())


def client(address: str, received: Any, ready: Any) -> None:
    """Takes all that the server sends, and counts its bytes."""
    import viser
    from websockets.sync.client import connect

    protocol: Any = f"viser-v{viser.__version__}"
    with connect(address, subprotocols=[protocol], max_size=None) as socket:
        ready.set()
        while True:
            try:
                message = socket.recv()
            except Exception:  # the server ends
                return
            received.value += len(message)


def measure(bodies: int, seconds: float) -> dict[str, Any]:
    sim = field(bodies)
    start = sim.state.positions.copy()
    context = multiprocessing.get_context("spawn")
    received, ready = context.Value("q", 0), context.Event()
    with amontons.view(sim, play=None) as viewer:
        address = viewer.url.replace("http", "ws", 1)
        taker = context.Process(target=client, args=(address, received, ready), daemon=True)
        taker.start()
        ready.wait(60)
        time.sleep(1.0)  # the scene itself is sent
        wall, processor, before = time.perf_counter(), time.process_time(), received.value
        count = round(seconds * RATE)
        for k in range(count):
            sim.state.positions = start + 0.1 * np.sin(0.2 * k)
            viewer.show()
            time.sleep(max(0.0, wall + (k + 1) / RATE - time.perf_counter()))
        spent, elapsed = time.process_time() - processor, time.perf_counter() - wall
        row = {
            "bodies": bodies,
            "updates_per_second": round(count / elapsed, 1),
            "processor": round(spent / elapsed, 3),
            "bytes_per_second": round((received.value - before) / elapsed),
        }
    taker.terminate()
    taker.join()
    return row


def main() -> None:
    options = with_folders(arguments(__doc__).parse_args())
    rows = [measure(bodies, 1.0 if options.quick else 8.0) for bodies in SIZES]
    for row in rows:
        print("  ".join(f"{name} {value}" for name, value in row.items()))
    write_csv(options.out / "viewer.csv", rows)


if __name__ == "__main__":
    main()
