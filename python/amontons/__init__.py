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

from importlib import import_module as _import_module
from importlib.metadata import PackageNotFoundError as _PackageNotFoundError
from importlib.metadata import version as _version
from types import ModuleType as _ModuleType
from typing import TYPE_CHECKING
from typing import Any as _Any

# The public names: `as` says that they are meant to be used from here.
from . import shapes as shapes
from ._core import IterationRecord as IterationRecord
from .device import Device as Device
from .device import devices as devices
from .errors import FileError as FileError
from .errors import InputError as InputError
from .errors import ModelWarning as ModelWarning
from .errors import SimulationError as SimulationError
from .errors import StepWarning as StepWarning
from .errors import SymmetrisedWarning as SymmetrisedWarning
from .errors import UnsupportedWarning as UnsupportedWarning
from .io import Lost as Lost
from .io import load_model as load_model
from .io import read_problem as read_problem
from .io import read_recording as read_recording
from .io import record as record
from .io import write_fmu as write_fmu
from .io import write_model as write_model
from .limits import Limits as Limits
from .model.builder import ModelBuilder as ModelBuilder
from .model.builder import on_floor as on_floor
from .model.drives import Actuator as Actuator
from .model.drives import PathElement as PathElement
from .model.drives import Tendon as Tendon
from .model.drives import TendonTerm as TendonTerm
from .model.drives import Transmission as Transmission
from .model.links import Link as Link
from .model.model import Model as Model
from .model.orientations import from_euler as from_euler
from .model.orientations import from_matrix as from_matrix
from .model.orientations import look_at as look_at
from .model.parts import Body as Body
from .model.parts import Coupling as Coupling
from .model.parts import Dof as Dof
from .model.parts import Fluid as Fluid
from .model.parts import FluidBox as FluidBox
from .model.parts import Geom as Geom
from .model.parts import Joint as Joint
from .model.parts import Material as Material
from .model.parts import Motor as Motor
from .model.parts import PairMaterial as PairMaterial
from .model.presets import Keyframe as Keyframe
from .model.presets import Unread as Unread
from .model.sensing import Sensor as Sensor
from .model.sensing import Site as Site
from .model.transforms import Transform as Transform
from .model.transforms import axis_angle as axis_angle
from .model.visuals import TriangleMesh as TriangleMesh
from .model.visuals import Visual as Visual
from .problem.cones import Bilateral as Bilateral
from .problem.cones import EllipticFriction as EllipticFriction
from .problem.cones import Friction as Friction
from .problem.cones import Interval as Interval
from .problem.cones import NonNegative as NonNegative
from .problem.cones import PlanarFriction as PlanarFriction
from .problem.cones import RollingFriction as RollingFriction
from .problem.iterate import Iterate as Iterate
from .problem.operators import Contacts as Contacts
from .problem.operators import Factored as Factored
from .problem.options import methods as methods
from .problem.problem import Problem as Problem
from .problem.problem import Violations as Violations
from .problem.problem import residual as residual
from .problem.problem import solve as solve
from .problem.problem import violations as violations
from .problem.solution import Solution as Solution
from .report.render import render as render
from .report.render import render_view as render_view
from .simulation.acting import Effort as Effort
from .simulation.acting import Instant as Instant
from .simulation.acting import Reaction as Reaction
from .simulation.derivative import Derivative as Derivative
from .simulation.derivative import Pullback as Pullback
from .simulation.events import ContactEvents as ContactEvents
from .simulation.inverse_kinematics import IkSolution as IkSolution
from .simulation.linearise import Linearisation as Linearisation
from .simulation.loads import Loads as Loads
from .simulation.outcome import Report as Report
from .simulation.own_method import SolveOptions as SolveOptions
from .simulation.queries import RayHit as RayHit
from .simulation.rollout import Rollout as Rollout
from .simulation.rollout import rollout as rollout
from .simulation.simulation import Simulation as Simulation
from .simulation.tape import Gradient as Gradient
from .simulation.world_batch import WorldBatch as WorldBatch
from .studies.identify import Fit as Fit
from .studies.identify import Motion as Motion
from .studies.identify import identify as identify
from .studies.sweep import sweep as sweep
from .viewer import view as view

if TYPE_CHECKING:
    from . import scenes as scenes

try:
    __version__ = _version("amontons")
except _PackageNotFoundError:  # a build folder on the path, not installed
    __version__ = "unknown"

__all__ = sorted(
    name
    for name, value in {**globals(), "scenes": None}.items()
    if not name.startswith("_") and name != "TYPE_CHECKING" and not isinstance(value, _ModuleType)
)
__all__ += ["__version__", "shapes"]


def __getattr__(name: str) -> _Any:
    if name == "scenes":  # most programs do without, and it takes long to import
        return _import_module(".scenes", __name__)
    if name == "Free":
        raise AttributeError(f"module {__name__!r} has no attribute 'Free': the cone is called Bilateral")
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
