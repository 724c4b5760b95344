"""Pictures of a verdict: joints coloured by what they use, forces as lines, the mechanism as a film."""

from __future__ import annotations

from dataclasses import replace
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...checks import Array, integer
from ...errors import FileError, InputError
from ...io.files import writable, write_whole
from ...model.builder import ModelBuilder
from ...model.model import Model
from ...model.visuals import TriangleMesh
from ...report.force_lines import Lines, line_rows
from ...report.picture import Frame, Picture, View
from ...simulation.simulation import Simulation
from .stability import Stability, velocities

STONE, SUPPORT = (0.82, 0.78, 0.70, 1.0), (0.55, 0.57, 0.60, 1.0)
FREE, USED = np.array([46.0, 125.0, 50.0]), np.array([200.0, 30.0, 30.0])
"""Colours of a joint that uses nothing, and all"""
FORCE = np.array([20, 60, 150], dtype=np.uint8)
OUTLINE, FORCE_WIDTH, FORCE_LENGTH = 0.02, 0.06, 0.6
"""Widths of lines and lengths of forces over the median size of a block"""
FILM_FRAMES, FILM_SIZE = 36, 0.5
"""Frames of a film, and the distance of its fastest corner over the median size of a block"""


def model_for_pictures(verdict: Stability) -> Model:
    """Blocks as bodies that look like them, in their order; nothing of it is for simulations."""
    builder = ModelBuilder()
    for block in verdict.assembly.blocks:
        middle = block.vertices.mean(axis=0)
        body = builder.add_body(block.name, position=tuple(middle), mass=1.0, inertia=(1, 1, 1))
        mesh = TriangleMesh((block.vertices - middle).astype(np.float32), block.triangles.astype(np.int32))
        if not (block.fixed and len(block.triangles) == 2):  # a sheet of ground hides the rest
            builder.add_visual(body, mesh, colour=SUPPORT if block.fixed else STONE)
    return builder.build()


def used(verdict: Stability) -> Array:
    """(j,) the larger of the friction that a joint uses and the eccentricity of its force, from 0 to 1."""
    rows = verdict.joint_forces
    return np.clip(np.maximum(rows["friction_used"], rows["eccentricity"]), 0.0, 1.0)


def joint_lines(verdict: Stability) -> Array:
    """(k, 10) rows of lines: the outlines of the joints and, if forces balance the weight, these forces."""
    size = _size(verdict)
    share = used(verdict) if verdict.equilibrium.status == "stands" else np.zeros(len(verdict.statics.joints))
    starts, ends, widths, colours = [], [], [], []
    for joint, part in zip(verdict.statics.joints, share, strict=True):
        loop = joint.polygon
        starts.append(loop)
        ends.append(np.roll(loop, -1, axis=0))
        widths.append(np.full(len(loop), OUTLINE * size))
        colours.append(np.tile((1 - part) * FREE + part * USED, (len(loop), 1)))
    if verdict.equilibrium.status == "stands" and len(share):
        rows = verdict.joint_forces
        strength = np.linalg.norm(rows["force"], axis=1)
        acting = strength > 1e-3 * strength.max()
        along = rows["force"][acting] / strength[acting, None]
        starts.append(rows["point"][acting] - FORCE_LENGTH / 2 * size * along)
        ends.append(rows["point"][acting] + FORCE_LENGTH / 2 * size * along)
        widths.append(FORCE_WIDTH * size * np.sqrt(strength[acting] / strength.max()))
        colours.append(np.tile(FORCE.astype(float), (int(acting.sum()), 1)))
    if not starts:
        return np.zeros((0, 10))
    return line_rows(tuple(np.concatenate(part) for part in (starts, ends, widths, colours)))  # type: ignore[arg-type]


def drawn(verdict: Stability) -> tuple[Simulation, Lines]:
    """For viewers: a simulation in which the blocks float where they are, and the lines of `joint_lines`."""
    model = replace(model_for_pictures(verdict), gravity=(0.0, 0.0, 0.0))
    rows = joint_lines(verdict)
    return Simulation(model), (rows[:, :3], rows[:, 3:6], rows[:, 6], 255 * rows[:, 7:10])


def picture(
    verdict: Stability,
    size: tuple[int, int] = (960, 720),
    *,
    azimuth: float = -60.0,
    elevation: float = 20.0,
) -> NDArray[np.uint8]:
    """(height, width, 3) the blocks with their joints, from green (unused) to red (all used), and forces.

    Lines show the force of each joint where it acts; their width grows with its root. azimuth, elevation: of
    the camera (degrees about z from x, above the horizon). Raises InputError for wrong sizes.
    """
    columns, rows = _pixels(size)
    model = model_for_pictures(verdict)
    drawer = Picture(model, View(azimuth=azimuth, elevation=elevation, forces=True))
    frame = _frame(verdict, 0.0)
    return drawer.draw(frame, drawer.framing([frame], columns / rows), columns, rows, joint_lines(verdict))


def film(
    verdict: Stability,
    size: tuple[int, int] = (640, 480),
    *,
    azimuth: float = -60.0,
    elevation: float = 20.0,
) -> list[NDArray[np.uint8]]:
    """Pictures of the mechanism as it starts: blocks move by their velocities, magnified.

    The mechanism is that of blocks that fall, or of blocks that stand under the first load that makes them
    fall. The fastest corner goes half the median size of a block. Raises InputError if there is neither.
    """
    columns, rows = _pixels(size)
    moves = mechanism_of(verdict)
    if moves is None:
        raise InputError(
            "film: the blocks stand; ask for a load under which they fall, as loads=[horizontal(1)]"
        )
    drawer = Picture(model_for_pictures(verdict), View(azimuth=azimuth, elevation=elevation))
    far = FILM_SIZE * _size(verdict)
    frames = [_frame(verdict, far * (k / (FILM_FRAMES - 1)) ** 2, moves) for k in range(FILM_FRAMES)]
    framing = drawer.framing([frames[0], frames[-1]], columns / rows)
    return [drawer.draw(frame, framing, columns, rows) for frame in frames]


def mechanism_of(verdict: Stability) -> Array | None:
    """(b, 6) of the mechanism that a film shows; None if no load was found that makes the blocks fall."""
    if verdict.mechanism is not None:
        return verdict.mechanism
    for factor in verdict.factors:
        if factor.mechanism is not None:
            return velocities(verdict.statics, factor.mechanism)
    return None


def _pixels(size: Any) -> tuple[int, int]:
    if np.shape(size) != (2,):
        raise InputError(f"size = {size!r}; give (width, height) in pixels")
    columns, rows = (integer("size", value, 1, 8192) for value in size)
    return columns, rows


def _size(verdict: Stability) -> float:
    sizes = [block.size for block in verdict.assembly.blocks if not block.fixed]
    return float(np.median(sizes))


def _frame(verdict: Stability, distance: float, moves: Array | None = None) -> Frame:
    """The blocks after a mechanism, (b, 6), has moved its fastest corner by `distance` (m)."""
    blocks = verdict.assembly.blocks
    moves = np.zeros((len(blocks), 6)) if moves is None else moves
    middles = np.array([block.vertices.mean(axis=0) for block in blocks])
    centres = np.array(
        [m if b.fixed else b.mass.centre_of_mass for b, m in zip(blocks, middles, strict=True)]
    )
    turn = distance * moves[:, 3:]
    angle = np.linalg.norm(turn, axis=1)
    axis = turn / np.maximum(angle, 1e-300)[:, None]
    quaternions = np.column_stack((np.cos(angle / 2), np.sin(angle / 2)[:, None] * axis))
    arms = middles - centres
    cosine, sine = np.cos(angle)[:, None], np.sin(angle)[:, None]
    along = np.sum(axis * arms, axis=1, keepdims=True) * axis
    arms = cosine * arms + sine * np.cross(axis, arms) + (1 - cosine) * along
    return Frame(0.0, centres + distance * moves[:, :3] + arms, quaternions)


def write_picture(verdict: Stability, path: str | Path, **options: Any) -> Path:
    """`picture` as a .png file; needs pillow. Options as of `picture`."""
    target = writable(path)
    write_whole({target: png_bytes(picture(verdict, **options))})
    return target


def write_film(verdict: Stability, path: str | Path, **options: Any) -> Path:
    """`film` as a .gif or .webp file; needs pillow. Options as of `film`."""
    target = writable(path)
    if target.suffix.lower() not in (".gif", ".webp"):
        raise FileError(f"{target}: a film is a .gif or .webp file")
    images = [_image(pixels) for pixels in film(verdict, **options)]
    data = BytesIO()
    kind = target.suffix.lower()[1:].upper()
    images[0].save(
        data, kind, save_all=True, append_images=[*images[1:], *[images[-1]] * 12], duration=60, loop=0
    )
    write_whole({target: data.getbuffer()})
    return target


def png_bytes(pixels: NDArray[np.uint8]) -> bytes:
    """A picture as the bytes of a PNG file."""
    data = BytesIO()
    _image(pixels).save(data, "PNG", optimize=True)
    return data.getvalue()


def _image(pixels: NDArray[np.uint8]) -> Any:
    try:
        from PIL import Image
    except ImportError:
        raise InputError("pictures as files need pillow: pip install pillow") from None
    return Image.fromarray(pixels)
