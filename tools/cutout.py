"""Pictures with a transparent ground, which suit pages of any colour: what floors show is their shadows."""

import io
from pathlib import Path

import numpy as np
from amontons.report.picture import NO_LINES, Frame, Framing, Picture
from numpy.typing import NDArray
from PIL import Image

ALIKE = 10
"""Levels of 255 by which a pixel of the floor may be off a grey of the floor's own tint."""
COLOURS, SHADES = 64, 32
FADED = 0.25
"""Share of the shadow's darkness that is kept: pages are lighter, or darker, than our floor."""


def cutout(
    picture: Picture,
    frame: Frame,
    framing: Framing,
    size: tuple[int, int],
    lines: NDArray[np.float64] = NO_LINES,
) -> Image.Image:
    """The picture, red, green, blue and opacity. A shadow becomes black that lets its ground through.

    lines: more of them, as `report.force_lines.line_rows` gives them.
    """
    # Twice as large and made smaller at the end: there borders become half transparent, without a rim.
    width, height = 2 * size[0], 2 * size[1]
    shown = picture.draw(frame, framing, width, height, lines).astype(float)
    behind = picture.probe(frame, framing, width, height)[0][::-1] < 0
    brightness = shown.max(axis=2)
    tint = shown / np.maximum(brightness, 1)[..., None]
    bare = shown[behind].reshape(-1, 3)
    clear = np.ones(shown.shape[:2])
    if len(bare):
        # The floor is the brightest of what no thing hides; what has another tint there is a line, or glass.
        light = np.percentile(bare.max(axis=1), 95)
        floor = bare[bare.max(axis=1) >= light - 1].mean(axis=0)
        alike = np.abs(tint - floor / floor.max()).max(axis=2) * brightness < ALIKE
        ground = behind & alike & (brightness > 0.35 * light)
        shade = np.clip(1 - brightness / light, 0, 1)
        shade[shade < 0.03] = 0
        shown[ground] = 0
        clear[ground] = 2 * FADED * shade[ground]
    straight = np.dstack((shown, 255 * clear)).round().clip(0, 255).astype(np.uint8)
    return Image.fromarray(straight, "RGBA").resize(size, Image.Resampling.BOX)


def saved(image: Image.Image, path: Path) -> None:
    """Writes a picture in 64 colours and 32 shades of the ground, which takes a third of the bytes."""
    pixels = np.asarray(image)
    few = image.quantize(COLOURS, method=Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE)
    index, opacity = np.array(few), pixels[..., 3]
    # The octree has one colour for all faint shades, in which the tiles of a floor would be lost.
    ground = (pixels[..., :3] == 0).all(axis=2) & (opacity < 4 * SHADES)
    index[ground] = COLOURS + opacity[ground] // 4
    palette = np.zeros((COLOURS + SHADES, 4), dtype=np.uint8)
    palette[:COLOURS] = np.array(few.getpalette("RGBA"), dtype=np.uint8).reshape(-1, 4)[:COLOURS]
    palette[COLOURS:, 3] = 4 * np.arange(SHADES)
    small = Image.fromarray(index, "P")
    small.putpalette(palette.ravel().tolist(), "RGBA")
    path.parent.mkdir(parents=True, exist_ok=True)
    buffer = io.BytesIO()
    small.save(buffer, "PNG", optimize=True)
    path.write_bytes(buffer.getvalue())
    print(f"{path.stem}: {len(buffer.getvalue()) // 1024} KB")
