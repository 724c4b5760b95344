"""Random resets and a rollout: which controls of the arm push the box furthest, out of many tried at once?"""

from pathlib import Path
from time import perf_counter
from typing import Any

import amontons
import numpy as np

model = amontons.load_model(Path(__file__).parent / "models" / "arm.xml")  # pip install amontons[models]
options: dict[str, Any] = {"dt": 4e-3, "tolerance": 1e-4}
random = np.random.default_rng(seed=7)
worlds, rows, repeat = 48, 30, 10  # 30 controls, each held for 40 ms

# Every world begins in another posture, with the box somewhere within reach.
start = amontons.Simulation(model, **options)
states = []
for _ in range(worlds):
    place = random.uniform(0.45, 0.55)
    posture = {"shoulder": random.uniform(0.2, 0.6), "elbow": random.uniform(-1.6, -1.0)}
    start.reset("bent", q={**posture, "box": (place, 0, 0.05, 1, 0, 0, 0)})
    states.append(np.concatenate([start.q, start.qd]))

# Each world moves from one random posture to another; controls have the units of the file.
ends = random.uniform((0.0, -2.2), (1.8, -0.4), (worlds, 3, 2))
knots, times = np.linspace(0, 1, 3), np.linspace(0, 1, rows)
controls = np.array([[np.interp(times, knots, way[:, k]) for k in range(2)] for way in ends]).transpose(
    0, 2, 1
)

clock = perf_counter()
result = amontons.rollout(model, states, controls, repeat=repeat, **options)
seconds = perf_counter() - clock
print(f"{worlds} worlds, {rows * repeat} steps each: {worlds * rows * repeat / seconds:.0f} steps per second")

x = model.coordinates["box"].q.start
pushed = result.q[:, -1, x] - np.array(states)[:, x]
best = int(pushed.argmax())
print(f"the box went {np.median(pushed):.3f} m (median), at best {pushed[best]:.3f} m, in world {best}")

# The same world by itself, step by step: the same to the last bit.
alone = amontons.Simulation(model, **options)
alone.reset(q=states[best][: model.nq], qd=states[best][model.nq :])
for control in controls[best]:
    alone.controls = control
    alone.run(repeat * alone.dt)
print("alone it ends at the same place:", bool((alone.q == result.q[best, -1]).all()))
