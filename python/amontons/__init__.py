"""Rigid bodies with joints and frictional contacts, and the variational inequalities of their time steps.

import amontons
builder = amontons.ModelBuilder()
builder.add_geom(None, amontons.shapes.Plane())
builder.add_body("ball", shape=amontons.shapes.Sphere(0.1), density=1000, position=(0, 0, 1))
simulation = amontons.Simulation(builder.build(), dt=5e-3)
simulation.run(2.0)

problem = amontons.vi.read_problem("wall.hdf5")
solution = problem.solve(tolerance=1e-8)
"""

from importlib import import_module as _import_module
from types import ModuleType as _ModuleType
from typing import TYPE_CHECKING
from typing import Any as _Any

# The public names: `as` says that they are meant to be used from here.
from . import examples as examples
from . import parts as parts
from . import results as results
from . import shapes as shapes
from . import vi as vi
from .errors import FileError as FileError
from .errors import InputError as InputError
from .errors import ModelWarning as ModelWarning
from .errors import SimulationError as SimulationError
from .errors import StepWarning as StepWarning
from .errors import UnsupportedWarning as UnsupportedWarning
from .field_help import describe_fields as _describe_fields
from .lazy import later as _later
from .limits import Limits as Limits
from .model.builder import ModelBuilder as ModelBuilder
from .model.builder import on_floor as on_floor
from .model.model import Model as Model
from .model.orientations import from_euler as from_euler
from .model.orientations import from_matrix as from_matrix
from .model.orientations import look_at as look_at
from .model.parts import Dof as Dof
from .model.parts import Joint as Joint
from .model.parts import Material as Material
from .model.parts import Motor as Motor
from .model.transforms import Transform as Transform
from .model.transforms import axis_angle as axis_angle
from .simulation.rollout import rollout as rollout
from .simulation.simulation import Simulation as Simulation
from .simulation.step_report import Report as Report
from .simulation.world_batch import WorldBatch as WorldBatch

if TYPE_CHECKING:
    from . import scenes as scenes
    from .device import Device as Device
    from .device import devices as devices
    from .io import load_model as load_model
    from .io import read_recording as read_recording
    from .io import record as record
    from .io import write_fmu as write_fmu
    from .io import write_model as write_model
    from .report.render import render as render
    from .report.render import render_view as render_view
    from .studies.identify import Motion as Motion
    from .studies.identify import identify as identify
    from .studies.sweep import sweep as sweep
    from .viewer import view as view

    __version__: str

# Extras, by the module of each name: they load with their first use.
_EXTRAS = {
    **dict.fromkeys(("Device", "devices"), "device"),
    **dict.fromkeys(("load_model", "read_recording", "record", "write_fmu", "write_model"), "io"),
    **dict.fromkeys(("render", "render_view"), "report.render"),
    **dict.fromkeys(("Motion", "identify"), "studies.identify"),
    "sweep": "studies.sweep",
    "view": "viewer",
}

__all__ = sorted(
    name
    for name, value in {**globals(), **_EXTRAS, "scenes": None}.items()
    if not name.startswith("_") and name != "TYPE_CHECKING" and not isinstance(value, _ModuleType)
)
__all__ += ["__version__", "examples", "parts", "results", "shapes", "vi"]

for _module in (parts, results, vi):
    _describe_fields(vars(_module).get(name) for name in _module.__all__)
_describe_fields(globals().get(name) for name in __all__)


def __dir__() -> list[str]:
    return __all__  # without the modules that are internal


if not TYPE_CHECKING:  # checkers of types know which names there are

    def __getattr__(name: str) -> _Any:
        if name == "scenes":  # most programs do without, and it takes long to import
            return _import_module(".scenes", __name__)
        if name in _EXTRAS:
            return _later(__name__, _EXTRAS)(name)
        if name == "__version__":
            from importlib.metadata import PackageNotFoundError, version

            try:
                return version("amontons")
            except PackageNotFoundError:  # a build folder on the path, not installed
                return "unknown"
        now = {"Free": "Bilateral"}.get(name, name)
        for module in (vi, parts, results):
            if now in module.__all__:
                # An ImportError, because `from amontons import X` hides the text of an AttributeError.
                raise ImportError(f"amontons.{name} is now {module.__name__}.{now}", name=__name__)
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
