"""Runs that the tests of studies share: a module that worker processes and threads can import too."""

import os
import signal
import time
from pathlib import Path


def slide(mu, speed=1.0, seed=0):
    """How far a block slides, in closed form; and two steps of a simulation, so that there is a residual."""
    import amontons
    from amontons import scenes

    simulation = amontons.Simulation(scenes.free_body(), dt=1e-3)
    simulation.run(2e-3)
    return {"way": speed**2 / (2 * 9.81 * mu), "seeded": seed % 1000}


def marked(folder, k, seconds=0.0):
    """Leaves a line per call in a file of its own."""
    with open(Path(folder) / f"{k}", "a") as file:
        file.write("called\n")
    time.sleep(seconds)
    return {"square": k * k}


HELD = 6


def held(folder, k):
    """As `marked`; from HELD on it lasts until somebody writes the file `go` there."""
    row = marked(folder, k)
    while k >= HELD and not (Path(folder) / "go").exists():
        time.sleep(0.02)
    return row


def dies_first(folder, k, killed=False):
    """Its process dies at the first call; k = 99 always. killed: by who finds its number in the folder."""
    mark = Path(folder) / f"died-{k}"
    if k == 99 or (k == 1 and not mark.exists()):
        mark.touch()
        if killed:
            (Path(folder) / f"kill-{os.getpid()}").touch()
            time.sleep(3600)
        os.kill(os.getpid(), signal.SIGKILL)
    return {"square": k * k}


def troubled(k):
    if k == 1:
        raise ValueError("no\nsuch thing")
    if k == 2:
        return 5
    if k == 3:
        return {"object": object()}
    if k == 4:
        return {"status": "mine"}
    if k == 5:
        return {"value": "text"}
    return {"value": float(k)}


def forever(k, stepping):
    """Comes to steps of a simulation, or never does."""
    import amontons
    from amontons import scenes

    simulation = amontons.Simulation(scenes.free_body(), dt=1e-3)
    while k:
        if stepping:
            simulation.step()
        else:
            time.sleep(1)
