"""A block pushed over the ground: the associated law lifts a sliding contact, Coulomb's law does not."""

import amontons
import numpy as np

mass, half, speed, step, mu = 2.0, 0.1, 1.0, 0.01, 0.5
corners = np.array([[x, y, -half] for x in (-half, half) for y in (-half, half)])
block = amontons.vi.Contacts(
    inverse_mass=[1 / mass],
    inverse_inertia=[np.full(3, 6 / (mass * (2 * half) ** 2))],
    body_a=[0] * 4,
    body_b=[-1] * 4,
    r_a=corners,
    r_b=np.zeros((4, 3)),
    normal=[[0, 0, 1]] * 4,
)
v_free = np.array([speed, 0, -9.81 * step, 0, 0, 0])
b = block.stored().jacobian() @ v_free  # closed gaps: no other term

for law in ("associated", "coulomb"):
    solution = amontons.vi.solve(block, b, "friction", mu=mu, law=law, tolerance=1e-10)
    lift = solution.u[::3].mean()
    print(f"{law:10}: status {solution.status}, the block rises with {1e3 * lift:.2f} mm/s")
