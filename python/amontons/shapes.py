"""The shapes of collision geometry under their public name; model/shapes.py holds them."""

from .model.shapes import *  # noqa: F403
