"""The scenes, each defined once and used by tests, benchmarks, demonstrations and documents.

Every scene is a function that returns a built `Model`; its parameters set sizes, its documentation says what
it shows. `names()`, `get(name)` and `make(name, **parameters)` serve the command line. SI units, z up.
"""

from .arch import arch
from .blocks import incline, rolling_balls, rolling_sphere, sliding_cube, stack, tipping_box
from .card_house import card_house
from .chain import capstan, chain
from .domino_run import domino_run
from .free_body import free_body, pendulum
from .grains import avalanche, drum, pile
from .hopper import hopper
from .linkages import four_bar, slider_crank
from .network import network
from .newtons_cradle import newtons_cradle
from .plates import plates
from .registry import Scene, get, make, names
from .spheres_in_box import spheres_in_box
from .tracked_vehicle import tracked_vehicle
from .wall import wall, wall_at_rest

__all__ = [
    "Scene",
    "arch",
    "avalanche",
    "capstan",
    "card_house",
    "chain",
    "domino_run",
    "drum",
    "four_bar",
    "free_body",
    "get",
    "hopper",
    "incline",
    "make",
    "names",
    "network",
    "newtons_cradle",
    "pendulum",
    "pile",
    "plates",
    "rolling_balls",
    "rolling_sphere",
    "slider_crank",
    "sliding_cube",
    "spheres_in_box",
    "stack",
    "tipping_box",
    "tracked_vehicle",
    "wall",
    "wall_at_rest",
]


def __getattr__(name: str) -> object:
    raise AttributeError(f"there is no scene {name!r}; known are {', '.join(names())}")
