"""Rigid bodies with joints and frictional contacts, and the variational inequalities of their time steps.

import amontons
builder = amontons.ModelBuilder()
builder.add_geom(None, amontons.shapes.Plane())
builder.add_body("ball", shape=amontons.shapes.Sphere(0.1), density=1000, position=(0, 0, 1))
simulation = amontons.Simulation(builder.build(), dt=5e-3)
simulation.run(2.0)

problem = amontons.read_problem("wall.hdf5")
solution = problem.solve(tolerance=1e-8)
"""

from importlib import import_module
from importlib.metadata import PackageNotFoundError, version
from typing import TYPE_CHECKING, Any

from . import shapes
from ._core import IterationRecord
from .builder import ModelBuilder
from .cones import Free, Friction, Interval, NonNegative
from .errors import (
    FileError,
    InputError,
    SimulationError,
    StepWarning,
    SymmetrisedWarning,
    UnsupportedWarning,
)
from .io import read_problem, read_recording, record
from .io.models import load_model
from .model import Body, Coupling, Dof, Geom, Joint, Material, Model, Motor, PairMaterial, Transform
from .operators import Contacts, Factored
from .options import methods
from .presets import Actuator, Keyframe
from .problem import Problem, Violations, residual, solve, violations
from .simulation import Report, Simulation
from .solution import Solution

if TYPE_CHECKING:
    from . import scenes

try:
    __version__ = version("amontons")
except PackageNotFoundError:  # a build folder on the path, not installed
    __version__ = "unknown"

__all__ = [
    "Actuator",
    "Body",
    "Contacts",
    "Coupling",
    "Dof",
    "Factored",
    "FileError",
    "Free",
    "Friction",
    "Geom",
    "InputError",
    "Interval",
    "IterationRecord",
    "Joint",
    "Keyframe",
    "Material",
    "Model",
    "ModelBuilder",
    "Motor",
    "NonNegative",
    "PairMaterial",
    "Problem",
    "Report",
    "Simulation",
    "SimulationError",
    "Solution",
    "StepWarning",
    "SymmetrisedWarning",
    "Transform",
    "UnsupportedWarning",
    "Violations",
    "__version__",
    "load_model",
    "methods",
    "read_problem",
    "read_recording",
    "record",
    "residual",
    "scenes",
    "shapes",
    "solve",
    "violations",
]


def __getattr__(name: str) -> Any:
    if name == "scenes":  # most programs do without, and it takes long to import
        return import_module(".scenes", __name__)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
