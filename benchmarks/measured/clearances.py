"""A slider-crank whose slider has a clearance in its guide (Flores, Leine and Glocker, 2010).

The file of Siconos holds names of columns and the state at the start, no motion: so our own runs with
longer steps stand beside the one with the shortest.
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import amontons
import numpy as np
from amontons.shapes import Box

Array = np.ndarray[Any, Any]
CRANK, ROD = 0.153, 0.306  # lengths (m)
HALF = (0.05, 0.025)  # of the slider, along and across the guide (m)
CLEARANCE = 1e-3  # m
MASSES = (0.038, 0.038, 0.076)  # crank, rod, slider (kg)
INERTIAS = (7.4e-5, 5.9e-4, 2.7e-6)  # kg m^2
FRICTION, RESTITUTION = 0.01, 0.4
TURN = 2 * np.pi / 150  # s, of the crank at its first speed
STEPS = (1e-4, 1e-5, 1e-6)  # s


def read_states(path: Path) -> dict[int, dict[str, Array]]:
    """By body: position (m), orientation (w, x, y, z), velocity and angular velocity in the first row."""
    names, *rows = (line.split("\t") for line in path.read_text().splitlines() if line.strip())
    first, found = dict(zip(names, rows[0], strict=False)), {}
    for name, value in first.items():
        part = re.fullmatch(r"(position|velocity)\d+_ds_(\d+)", name.strip())
        if part:
            found.setdefault(int(part[2]), {}).setdefault(part[1], []).append(float(value))
    return {
        body: {
            "position": np.array(values["position"][:3]), "orientation": np.array(values["position"][3:]),
            "linear_velocity": np.array(values["velocity"][:3]),
            "angular_velocity": np.array(values["velocity"][3:]),
        }
        for body, values in found.items()
    }  # fmt: skip


def slider_crank(states: dict[int, dict[str, Array]]) -> amontons.Model:
    """In the plane of x and z: hinges along y, and a slider between two fixed boxes."""
    builder = amontons.ModelBuilder(gravity=(0, 0, -9.81))
    surface = amontons.Material(friction=FRICTION, restitution=RESTITUTION)
    names = ("crank", "rod", "slider")
    for k, name in enumerate(names):
        builder.add_body(name, mass=MASSES[k], inertia=(INERTIAS[k],) * 3, **states[k])
    builder.add_geom("slider", Box((HALF[0], 0.025, HALF[1])), material=surface)
    for side in (-1, 1):
        at = (0.4, 0, side * (HALF[1] + CLEARANCE + 0.1))
        builder.add_geom(None, Box((0.5, 0.05, 0.1)), position=at, material=surface)
    y = (0, 1, 0)
    builder.add_revolute_joint("crank", point=(0, 0, 0), axis=y)
    builder.add_revolute_joint("rod", "crank", point=(CRANK, 0, 0), axis=y)
    builder.add_revolute_joint("slider", "rod", point=(CRANK + ROD, 0, 0), axis=y)
    return builder.build()


def run(states: dict[int, dict[str, Array]], dt: float, seconds: float) -> dict[str, Array]:
    """Position of the slider along and across the guide at each tenth of a millisecond (m), the number of
    times at which a pair began to touch, and energies (J)."""
    simulation = amontons.Simulation(slider_crank(states), dt=dt, on_failure="ignore")
    every, places, touches, energies = round(STEPS[0] / dt), [], 0, []
    for k in range(every * round(seconds / STEPS[0])):
        energies.append(simulation.step().energy)
        touches += len(simulation.contact_events.began)
        if (k + 1) % every == 0:
            places.append(simulation.state.positions[2].copy())
    return {"places": np.array(places), "touches": np.array(touches), "energies": np.array(energies)}


def rows(folder: Path, quick: bool) -> Iterator[dict[str, Any]]:
    warnings.simplefilter("ignore", amontons.StepWarning)
    seconds = TURN * (0.1 if quick else 1.0)
    for path in sorted(folder.glob("slider_crank*.ref")):
        states = read_states(path)
        runs = [run(states, dt, seconds) for dt in STEPS]
        for dt, found in zip(STEPS, runs, strict=True):
            apart = found["places"] - runs[-1]["places"]
            yield {
                "mechanism": path.stem, "step_ms": 1e3 * dt, "turns": seconds / TURN,
                "touches": int(found["touches"]),
                "largest_across_mm": 1e3 * float(np.abs(found["places"][:, 2]).max()),
                "energy_lost_percent": 100 * float(1 - found["energies"][-1] / found["energies"][0]),
                "energy_rise_percent": 100 * float(np.diff(found["energies"]).max() / found["energies"][0]),
                "rms_along_mm": 1e3 * float(np.sqrt(np.mean(apart[:, 0] ** 2))),
                "rms_across_mm": 1e3 * float(np.sqrt(np.mean(apart[:, 2] ** 2))),
            }  # fmt: skip
