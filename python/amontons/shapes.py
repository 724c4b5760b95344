"""The shapes of collision geometry under their public name; model/shapes.py holds them."""

from .model.decomposing import Decomposition as Decomposition
from .model.decomposing import decompose as decompose
from .model.shapes import *  # noqa: F403
from .model.shapes import KINDS as _KINDS


def __getattr__(name: str) -> object:
    raise AttributeError(f"there is no shape {name!r}; known are {', '.join(_KINDS)}")
