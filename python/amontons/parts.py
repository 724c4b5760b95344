"""Parts of a `Model` beside those that every program needs: what its lists hold and its builder takes."""

from .model.drives import Actuator as Actuator
from .model.drives import PathElement as PathElement
from .model.drives import Tendon as Tendon
from .model.drives import TendonTerm as TendonTerm
from .model.drives import Transmission as Transmission
from .model.links import Link as Link
from .model.parts import Body as Body
from .model.parts import Bond as Bond
from .model.parts import Coupling as Coupling
from .model.parts import Fluid as Fluid
from .model.parts import FluidBox as FluidBox
from .model.parts import Geom as Geom
from .model.parts import PairMaterial as PairMaterial
from .model.presets import Keyframe as Keyframe
from .model.sensing import Sensor as Sensor
from .model.sensing import Site as Site
from .model.visuals import TriangleMesh as TriangleMesh
from .model.visuals import Visual as Visual

__all__ = [
    "Actuator",
    "Body",
    "Bond",
    "Coupling",
    "Fluid",
    "FluidBox",
    "Geom",
    "Keyframe",
    "Link",
    "PairMaterial",
    "PathElement",
    "Sensor",
    "Site",
    "Tendon",
    "TendonTerm",
    "Transmission",
    "TriangleMesh",
    "Visual",
]
