"""Robots that fall, and what else has many contacts for its size; for robot/falls.py.

Shared robots as they are, the same with boxes or hulls in place of round geoms (more contacts, redundant
ones), and small models as text: wheels, a puzzle cube, a gripper over parts, a house of cards, a pad that
holds a box. Others have large islands with trees: a robot against a pile, a heap of humanoids.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

FLOOR = -1.2
"""m: of the floor under robots whose file has none, about their height below the origin."""
AS_THEY_ARE = {
    "humanoid": "mujoco/humanoid/humanoid.xml", "humanoid of dm_suite": "dm_suite/humanoid.xml",
    "humanoid of Gymnasium": "gymnasium/humanoid.xml", "quadruped": "dm_suite/quadruped.xml",
    "ant": "gymnasium/ant.xml", "Go1": "unitree_go1/scene.xml", "car": "mujoco/car/car.xml",
    "hand": "shadow_hand/scene_right.xml", "arm over boxes": "dm_suite/stacker.xml",
    "carousel": "mujoco/surfacevel/carousel.xml",
}  # fmt: skip
ROUND = {
    "humanoid": ("mujoco/humanoid/humanoid.xml", None),
    "humanoid of Gymnasium": ("gymnasium/humanoid.xml", None),
    "humanoid of CMU": ("dm_walkers/humanoid_CMU_V2020.xml", FLOOR),
    "ant": ("gymnasium/ant.xml", None),
}
"""Files whose geoms become boxes and hulls, and the floor that they get."""


def large_cases(robots: Path, folder: Path) -> Iterator[tuple[str, Path]]:
    """Names and MJCF files of scenes whose islands have trees and many contacts."""
    heap = robots / "mujoco/humanoid/22_humanoids.xml"
    if heap.is_file():
        yield "22 humanoids in a heap", heap
    for name, text in LARGE.items():
        path = folder / f"{name}.xml"
        path.write_text(text())
        yield name, path


def cases(robots: Path, folder: Path) -> Iterator[tuple[str, Path]]:
    """Names and MJCF files; those that are made go to `folder`."""
    for name, file in AS_THEY_ARE.items():
        if (robots / file).is_file():
            yield name, robots / file
    for name, (file, floor) in ROUND.items():
        for form, change in (("boxes", to_box), ("hulls", to_hull)):
            if (robots / file).is_file():
                path = folder / f"{name} of {form}.xml"
                path.write_text(with_geoms(robots / file, change, floor))
                yield f"{name}, {form}", path
    for name, text in TEXTS.items():
        path = folder / f"{name}.xml"
        path.write_text(text())
        yield name, path


# Other geoms


def with_geoms(file: Path, change: Callable[..., None], floor: float | None) -> str:
    """The text of a model whose round geoms are changed; joints and actuators stay."""
    kinds = mujoco.mjtGeom
    rounds = (kinds.mjGEOM_CAPSULE, kinds.mjGEOM_CYLINDER, kinds.mjGEOM_SPHERE, kinds.mjGEOM_ELLIPSOID)
    spec = mujoco.MjSpec.from_file(str(file))
    compiled = spec.compile()
    for geom in spec.geoms:
        if geom.type not in rounds:
            continue
        radius, half = compiled.geom_size[geom.id][:2]
        if geom.type == kinds.mjGEOM_CAPSULE:
            half += radius
        elif geom.type != kinds.mjGEOM_CYLINDER:
            half = radius
        geom.fromto = [math.nan] * 6  # the file may have given two ends
        geom.pos, geom.quat = compiled.geom_pos[geom.id].copy(), compiled.geom_quat[geom.id].copy()
        change(spec, geom, float(radius), float(half))
    if floor is not None:
        spec.worldbody.add_geom(type=kinds.mjGEOM_PLANE, size=(0, 0, 1), pos=(0, 0, floor))
    spec.compile()
    return spec.to_xml()


def to_box(_: Any, geom: Any, radius: float, half: float) -> None:
    geom.type = mujoco.mjtGeom.mjGEOM_BOX
    geom.size = [0.85 * radius, 0.85 * radius, half]


def to_hull(spec: Any, geom: Any, radius: float, half: float) -> None:
    """A prism of eight sides with narrower ends."""
    name = f"hull {radius:.5f} {half:.5f}"
    if name not in [mesh.name for mesh in spec.meshes]:
        turns = 2 * np.pi * np.arange(8) / 8
        rings = ((-half, 0.6), (0.3 * radius - half, 1.0), (half - 0.3 * radius, 1.0), (half, 0.6))
        corners = [(s * radius * math.cos(a), s * radius * math.sin(a), z) for z, s in rings for a in turns]
        mesh = spec.add_mesh()
        mesh.name, mesh.uservert = name, np.ravel(corners)
    geom.type, geom.meshname = mujoco.mjtGeom.mjGEOM_MESH, name


# Models as text


def model(bodies: str, actuators: str = "") -> str:
    plane = '<geom type="plane" size="5 5 .1"/>'
    return (
        f'<mujoco><option timestep=".002"/><worldbody>{plane}{bodies}</worldbody>'
        f"<actuator>{actuators}</actuator></mujoco>"
    )


def box(half: tuple[float, float, float], mass: float, more: str = "") -> str:
    return f'<geom type="box" size="{half[0]} {half[1]} {half[2]}" mass="{mass}" {more}/>'


def free(at: tuple[float, float, float], geom: str, more: str = "") -> str:
    return f'<body pos="{at[0]} {at[1]} {at[2]}" {more}><freejoint/>{geom}</body>'


def wheels(beside: str = "") -> str:
    """A quadruped with a driven wheel at the end of each leg."""
    legs, drives, below = "", "", 'pos="0 0 -.1"'
    for i, (x, y) in enumerate(((0.22, 0.15), (0.22, -0.15), (-0.22, 0.15), (-0.22, -0.15))):
        joint = 'damping="1" armature=".01"/>'
        legs += (
            f'<body pos="{x} {y} 0"><joint name="roll{i}" axis="1 0 0" range="-50 50" {joint}'
            f'<geom type="cylinder" size=".04 .03" zaxis="0 1 0" mass=".6"/>'
            f'<body><joint name="hip{i}" axis="0 1 0" range="-60 100" {joint}'
            f"{box((0.02, 0.02, 0.1), 0.8, below)}"
            f'<body pos="0 0 -.2"><joint name="knee{i}" axis="0 1 0" range="-150 -10" {joint}'
            f"{box((0.015, 0.015, 0.1), 0.3, below)}"
            f'<body pos="0 {math.copysign(0.03, y)} -.2"><joint name="wheel{i}" axis="0 1 0" damping=".05"/>'
            f'<geom type="cylinder" size=".07 .02" zaxis="0 1 0" mass=".5" friction=".8"/>'
            f"</body></body></body></body>"
        )
        drives += "".join(
            f'<position joint="{name}{i}" kp="60" ctrlrange="{low} {high}"/>'
            for name, low, high in (("roll", -0.6, 0.6), ("hip", -0.6, 1.4), ("knee", -2.4, -0.3))
        )
        drives += f'<velocity joint="wheel{i}" kv="1" ctrlrange="-10 10"/>'
    return model(free((0, 0, 0.5), box((0.25, 0.12, 0.06), 10) + legs) + beside, drives)


def pyramid(levels: int, half: float, at: tuple[float, float], mass: float) -> str:
    """Boxes in squares, each on the corners of four."""
    return "".join(
        free((at[0] + (2 * x - n + 1) * half, at[1] + (2 * y - n + 1) * half, (2 * (levels - n) + 1) * half),
             box((0.98 * half, 0.98 * half, half), mass))
        for n in range(levels, 0, -1) for x, y in np.ndindex(n, n)
    )  # fmt: skip


def puzzle_cube() -> str:
    """3 x 3 x 3 parts that touch: six on hinges, twenty on ball joints about the centre."""
    parts = '<geom type="sphere" size=".01" contype="0" conaffinity="0" mass=".02"/>'
    dry = 'damping=".0005" frictionloss=".001"'
    for k in range(27):
        at = (k % 3 - 1, k // 3 % 3 - 1, k // 9 - 1)
        ends = sum(map(abs, at))
        if ends == 0:
            continue
        place = 'pos="{} {} {}"'.format(*(0.019 * c for c in at))
        kind = f'type="hinge" axis="{at[0]} {at[1]} {at[2]}"' if ends == 1 else 'type="ball"'
        half = (0.0094, 0.0094, 0.0094)
        parts += f"<body><joint {kind} {dry}/>{box(half, 0.004, place)}</body>"
    return model(free((0, 0, 0.15), parts, 'euler="20 15 0"'))


def gripper() -> str:
    rough = 'friction="1.5"'
    fingers = "".join(
        f'<body pos="{0.04 * s} 0 -.06"><joint name="finger{s}" type="slide" axis="{s} 0 0" '
        f'range="-.03 .02" damping="2"/>{box((0.006, 0.012, 0.05), 0.05, rough)}</body>'
        for s in (1, -1)
    )
    hand = (
        '<geom type="box" size=".3 .3 .02" pos="0 0 .2"/><body pos="0 0 .45">'
        '<joint name="lift" type="slide" axis="0 0 1" damping="5"/>'
        f'<joint name="turn" axis="0 0 1" damping=".5"/>{box((0.05, 0.03, 0.02), 0.5)}{fingers}</body>'
    )
    stack = "".join(
        free((0.001 * i, 0.002 * i, 0.241 + 0.0405 * i), box((0.02, 0.02, 0.02), 0.1)) for i in range(2)
    )
    shapes = ('box" size=".02 .015 .02', 'cylinder" size=".015 .03', 'box" size=".01 .04 .01')
    loose = "".join(
        free((0.1 + 0.03 * i, 0.05 * (i % 2), 0.25), f'<geom type="{s}" mass=".05"/>')
        for i, s in enumerate(shapes)
    )
    ranges = (("lift", 300, "-.2 0"), ("turn", 5, "-1 1"), ("finger1", 200, "-.03 .02"))
    drives = "".join(
        f'<position joint="{name}" kp="{gain}" ctrlrange="{limits}"/>'
        for name, gain, limits in (*ranges, ("finger-1", 200, "-.03 .02"))
    )
    return model(hand + stack + loose, drives)


def pad_over(what: str, height: str, lift: str) -> str:
    """A pad on two slides, so high (m) and moved so far (m), that holds by adhesion what is below."""
    arm = (
        f'<body pos="0 0 {height}"><joint name="z" type="slide" axis="0 0 1" damping="2"/>'
        '<joint name="x" type="slide" axis="1 0 0" damping="2"/>'
        f'<body name="pad">{box((0.04, 0.04, 0.01), 0.2)}</body></body>'
    )
    drives = (
        f'<adhesion body="pad" ctrlrange="0 1" gain="20"/><position joint="z" kp="200" ctrlrange="{lift}"/>'
        '<position joint="x" kp="50" ctrlrange="-.1 .1"/>'
    )
    return model(arm + what, drives)


def cards(levels: int = 4) -> str:
    text, z = "", 0.0
    length, thick, lean = 0.09, 0.0015, math.radians(15)
    width = 2 * length * math.sin(lean) + 0.012
    height = length * math.cos(lean) + 2 * thick * math.sin(lean)
    card = box((thick / 2, 0.03, length / 2), 0.002, 'friction=".8"')
    roof = box((width / 2 - 0.001, 0.03, thick / 2), 0.002, 'friction=".8"')
    for level in range(levels):
        count = levels - level
        for i in range(count):
            for side in (-1, 1):
                x = (i - (count - 1) / 2) * width + side * (length / 2 * math.sin(lean) + thick)
                text += free((x, 0, z + height / 2), card, f'euler="0 {-side * math.degrees(lean)} 0"')
        for i in range(count - 1):
            text += free(((i - (count - 2) / 2) * width, 0, z + height + thick), roof)
        z += height + 2 * thick
    return model(text)


TEXTS = {
    "quadruped on wheels": wheels, "puzzle cube": puzzle_cube, "gripper over parts": gripper,
    "box held by adhesion": lambda: pad_over(
        free((0.005, 0.003, 0.0501), box((0.05, 0.05, 0.05), 0.3)), ".3", "-.25 0"),
    "house of cards": cards,
}  # fmt: skip
LARGE = {
    "puzzle cube": puzzle_cube, "quadruped on wheels": wheels,
    # A pyramid of 30 boxes touches the wheels of one side.
    "quadruped against a pile": lambda: wheels(pyramid(4, 0.06, (0.0, 0.53), 0.5)),
    "pile under an adhesive pad": lambda: pad_over(pyramid(4, 0.025, (0.0, 0.0), 0.05), ".21", "-.05 .1"),
}  # fmt: skip
