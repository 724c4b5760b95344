"""A study: the friction at which an arch falls, as a figure; and what Coulomb said of it in 1773."""

import amontons
import matplotlib.pyplot as plt
import numpy as np
from amontons import Simulation, scenes
from scipy.optimize import brentq


def run(mu: float, stones: int) -> dict[str, float]:
    """Half a second of an arch of 4 m; how far its stones went."""
    simulation = Simulation(scenes.arch(mu=mu, stones=stones), dt=5e-3, tolerance=1e-5)
    start = simulation.state.positions.copy()
    simulation.run(0.5)
    return {"moved": float(np.linalg.norm(simulation.state.positions - start, axis=1).max())}


def coulomb(stones: int) -> float:
    """The least friction with which no stone slides.

    Take the part of an arch between the crown and the joint at the angle t from it, of weight W. It slides
    inwards unless the thrust H at the crown is at least W cot(t + phi). It slides outwards unless H is at
    most W cot(t - phi). Here mu = tan(phi).
    """
    t = np.pi / stones * np.arange(stones / 2, 0, -1)  # weights are as the angles

    def surplus(mu: float) -> float:
        phi = np.arctan(mu)
        outwards = np.where(t > phi, t / np.tan(np.maximum(t - phi, 1e-9)), np.inf)
        return float(outwards.min() - (t / np.tan(t + phi)).max())

    return float(brentq(surplus, 0.01, 1))


grid = {"stones": [7, 11, 15], "mu": np.linspace(0.26, 0.35, 10).round(3)}
table = amontons.sweep(run, grid, out="arch.parquet")

for stones in (7, 11, 15):
    rows = [row for row in table.to_pylist() if row["stones"] == stones]
    stands = min(row["mu"] for row in rows if row["moved"] < 1e-3)
    print(f"{stones} stones stand from mu = {stands:.2f} on; by Coulomb's theory from {coulomb(stones):.4f}")
    (line,) = plt.semilogy(
        [row["mu"] for row in rows], [row["moved"] for row in rows], "o-", label=f"{stones} stones"
    )
    plt.axvline(coulomb(stones), color=line.get_color(), linestyle=":")
plt.xlabel("coefficient of friction")
plt.ylim(bottom=1e-5)  # what stands moves by less: its lines leave the picture
plt.ylabel("largest displacement of a stone in half a second (m)")
plt.legend()
plt.savefig("arch.png", dpi=110)
