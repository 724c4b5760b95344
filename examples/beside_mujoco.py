"""A box on a slope, and one that slides, in MuJoCo and here: soft contacts creep and lift, rigid ones not."""

import math
from pathlib import Path

import amontons
import mujoco

MODEL = """
<mujoco>
  <option gravity="{x} 0 {z}" timestep="0.002" cone="elliptic" impratio="{impratio}"/>
  <worldbody>
    <geom type="plane" size="5 5 1" friction="0.5"/>
    <body name="box" pos="0 0 0.1">
      <freejoint/> <geom type="box" size="0.1 0.1 0.1" mass="1" friction="0.5"/>
    </body>
  </worldbody>
</mujoco>"""


def both(slope: float, impratio: float = 1) -> tuple[mujoco.MjModel, mujoco.MjData, amontons.Simulation]:
    tilt = math.radians(slope)
    file = Path("slope.xml")
    gravity = {"x": 9.81 * math.sin(tilt), "z": -9.81 * math.cos(tilt)}
    file.write_text(MODEL.format(impratio=impratio, **gravity))
    theirs = mujoco.MjModel.from_xml_path(str(file))
    return theirs, mujoco.MjData(theirs), amontons.Simulation(amontons.load_model(file), dt=2e-3)


for impratio, noslip, creeps in ((1, 0, 1e-4), (100, 0, 1e-6), (1, 20, 1e-10)):
    model, data, ours = both(10, impratio)
    model.opt.noslip_iterations = noslip
    mujoco.mj_step(model, data, 500)
    ours.run(1.0)
    start = data.qpos[0], ours.q[0]
    mujoco.mj_step(model, data, 500)
    ours.run(1.0)
    creep = data.qpos[0] - start[0], ours.q[0] - start[1]  # m in a second
    print(
        f"creep, impratio {impratio}, noslip {noslip}: MuJoCo {creep[0]:.1e} m/s, amontons {creep[1]:.0e} m/s"
    )
    assert creep[0] > creeps
    assert abs(creep[1]) < 1e-9

model, data, ours = both(slope=0)
data.qvel[0] = 6.0
ours.set_qd({"box": (6, 0, 0, 0, 0, 0)})
lifts = [0.0], [0.0]
for _ in range(600):
    mujoco.mj_step(model, data)
    ours.step()
    lifts[0].append(data.qpos[2] - 0.1)
    lifts[1].append(ours.q[2] - 0.1)
lift = max(lifts[0]), max(lifts[1])
print(f"lift: MuJoCo {1e3 * lift[0]:.1f} mm, amontons {1e3 * lift[1]:.0e} mm")
assert lift[0] > 1e-3
assert lift[1] < 1e-8
