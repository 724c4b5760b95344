"""Many runs side by side (`sweep`, `identify`), and verdicts on assemblies of blocks (`stability`)."""

from importlib import import_module as _import_module
from typing import TYPE_CHECKING
from typing import Any as _Any

if TYPE_CHECKING:
    from ..io.assemblies import read_assembly as read_assembly
    from ..model.assembly import Assembly as Assembly
    from ..model.assembly import Block as Block
    from .masonry.loads import Load as Load
    from .masonry.loads import horizontal as horizontal
    from .masonry.loads import point_load as point_load
    from .masonry.loads import tilt as tilt
    from .masonry.search import Factor as Factor
    from .masonry.shaking import GroundMotion as GroundMotion
    from .masonry.shaking import Shaking as Shaking
    from .masonry.shaking import pulse as pulse
    from .masonry.shaking import read_ground_motion as read_ground_motion
    from .masonry.shaking import shake as shake
    from .masonry.stability import Stability as Stability
    from .masonry.stability import stability as stability
    from .masonry.statics import Equilibrium as Equilibrium

_HOMES = {
    "Assembly": "..model.assembly",
    "Block": "..model.assembly",
    "Equilibrium": ".masonry.statics",
    "Factor": ".masonry.search",
    "GroundMotion": ".masonry.shaking",
    "Load": ".masonry.loads",
    "Shaking": ".masonry.shaking",
    "Stability": ".masonry.stability",
    "horizontal": ".masonry.loads",
    "point_load": ".masonry.loads",
    "pulse": ".masonry.shaking",
    "read_ground_motion": ".masonry.shaking",
    "shake": ".masonry.shaking",
    "read_assembly": "..io.assemblies",
    "stability": ".masonry.stability",
    "tilt": ".masonry.loads",
}
__all__ = sorted(_HOMES)

if not TYPE_CHECKING:

    def __getattr__(name: str) -> _Any:
        if name in _HOMES:  # loaded at first use: importing amontons stays light
            return getattr(_import_module(_HOMES[name], __name__), name)
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
