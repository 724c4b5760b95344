"""What users write, for the type checkers, never run: the public interface with arrays, lists, callbacks."""

from collections.abc import Mapping
from pathlib import Path

import amontons
import numpy as np
from amontons import Material, ModelBuilder, Simulation, shapes
from numpy.typing import NDArray


def build(sides: NDArray[np.float64]) -> amontons.Model:
    builder = ModelBuilder(gravity=[0, 0, -9.81])
    builder.add_geom(None, shapes.Plane(), material=Material(friction=0.4))
    builder.add_body("box", shape=shapes.Box(sides), density=500.0, position=np.array([0.0, 0.0, 1.0]))
    builder.add_body(
        "ball", shape=shapes.Sphere(0.1), density=500, position=(1, 0, 1), orientation=[1, 0, 0, 0]
    )
    builder.add_revolute_joint("box", "ball", point=np.zeros(3), axis=(0, 0, 1), name="hinge")
    return builder.build()


def watch(simulation: Simulation, report: amontons.Report) -> bool:
    return report.energy < 0.0 or simulation.time > 1.0


def simulate(model: amontons.Model) -> float:
    simulation = Simulation(model, dt=1e-3, law="coulomb", threads=2)
    simulation.before_step.append(lambda sim: sim.set_control("hinge", 0.1))
    report: amontons.Report = simulation.run(0.5, after_step=watch)
    heights: NDArray[np.float64] = simulation.state.positions[:, 2]
    force = simulation.contacts["force"].sum(axis=0)
    simulation.q = np.zeros(model.nq)
    return float(heights.max() + force[2]) + report.residual


def solve(path: Path) -> NDArray[np.float64]:
    problem = amontons.vi.read_problem(path)
    solution = problem.solve(method="auto", law="coulomb", history=True)
    assert solution.history is not None
    cones = [amontons.vi.Friction(0.5, n=2), amontons.vi.Bilateral(1), amontons.vi.Interval([-1.0], [1.0])]
    other = amontons.vi.solve(np.eye(8), np.ones(8), cones, threads=1)
    return solution.x if solution.converged else other.x


def run(mu: float, seed: int) -> Mapping[str, float]:
    simulation = Simulation(amontons.scenes.arch(mu=mu), tolerance=1e-4)
    return {"energy": simulation.run(0.1).energy, "seed": float(seed)}


def study() -> list[float]:
    table = amontons.sweep(run, {"mu": np.linspace(0.2, 0.4, 3)}, out=Path("study.parquet"), seeds=2)
    amontons.sweep("arch", [{"mu": 0.2}, {"mu": 0.3}], executor=0)
    return [row["energy"] for row in table.to_pylist()]


def roll(model: amontons.Model) -> NDArray[np.float64]:
    states = np.zeros((4, model.nq + model.nv))
    return amontons.rollout(model, states, steps=10, dt=1e-3).q
