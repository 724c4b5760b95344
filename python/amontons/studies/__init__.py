"""Many runs side by side (`sweep`, `identify`), and verdicts on assemblies of blocks (`stability`)."""

from typing import TYPE_CHECKING

from ..lazy import later as _later

if TYPE_CHECKING:
    from ..io.assemblies import read_assembly as read_assembly
    from ..model.assembly import Assembly as Assembly
    from ..model.assembly import Block as Block
    from .masonry.loads import Load as Load
    from .masonry.loads import horizontal as horizontal
    from .masonry.loads import point_load as point_load
    from .masonry.loads import tilt as tilt
    from .masonry.search import Factor as Factor
    from .masonry.settling import Settlement as Settlement
    from .masonry.settling import settlement as settlement
    from .masonry.shaking import GroundMotion as GroundMotion
    from .masonry.shaking import Shaking as Shaking
    from .masonry.shaking import pulse as pulse
    from .masonry.shaking import read_ground_motion as read_ground_motion
    from .masonry.shaking import shake as shake
    from .masonry.stability import Stability as Stability
    from .masonry.stability import stability as stability
    from .masonry.statics import Equilibrium as Equilibrium

_HOMES = {
    "Assembly": "model.assembly",
    "Block": "model.assembly",
    "Equilibrium": "studies.masonry.statics",
    "Factor": "studies.masonry.search",
    "GroundMotion": "studies.masonry.shaking",
    "Load": "studies.masonry.loads",
    "Settlement": "studies.masonry.settling",
    "Shaking": "studies.masonry.shaking",
    "Stability": "studies.masonry.stability",
    "horizontal": "studies.masonry.loads",
    "point_load": "studies.masonry.loads",
    "pulse": "studies.masonry.shaking",
    "read_ground_motion": "studies.masonry.shaking",
    "settlement": "studies.masonry.settling",
    "shake": "studies.masonry.shaking",
    "read_assembly": "io.assemblies",
    "stability": "studies.masonry.stability",
    "tilt": "studies.masonry.loads",
}
__all__ = sorted(_HOMES)

if not TYPE_CHECKING:
    __getattr__ = _later(__name__, _HOMES)
