"""The colours of shapes that have none of their own."""

from __future__ import annotations

import numpy as np

from ..checks import Array

FIXED = np.array([0.74, 0.72, 0.68])
FLOOR = np.array([0.92, 0.91, 0.885])
PALETTE = {
    "Box": "#cf7a56",
    "Sphere": "#6f93b5",
    "Capsule": "#8b8b92",
    "Cylinder": "#a3967c",
    "Ellipsoid": "#8fac86",
    "Hull": "#c4ab68",
}
OTHER = "#b0aca4"
STATES = {"stick": (40, 130, 70), "slip": (215, 80, 40), "open": (120, 140, 200)}
"""Colours of contacts, red, green and blue of 8 bits."""
VARIATION = 0.10
"""Bodies of a kind differ in brightness by up to this fraction, so that they can be distinguished."""


def colour_of(kind: str, index: int) -> Array:
    """Red, green and blue from 0 to 1 of the geom `index`, whose shape is of this kind."""
    text = PALETTE.get(kind, OTHER)
    base = np.array([int(text[k : k + 2], 16) / 255 for k in (1, 3, 5)])
    # Multiples of the golden ratio spread evenly, whatever the number of bodies.
    return np.clip(base * (1 + VARIATION * (2 * ((index * 0.6180339887) % 1) - 1)), 0, 1)
