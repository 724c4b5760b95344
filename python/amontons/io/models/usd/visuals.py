"""Gprims of a scene of USD that are rendered, with their colours.

The simulation knows nothing of it, so that nothing here is an error: what cannot be read is left out.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from ....errors import InputError
from ....model.parts import WORLD, Geom
from ....model.shapes import Hull, Mesh, Plane, Shape
from ....model.transforms import Transform
from ....model.visuals import TriangleMesh, Visual
from ..issues import Issues
from .building import Building
from .shapes import Colliders
from .stage import Scene

SHOWN = ("default", "render")
"""Purposes of what is rendered; a proxy or a guide stands in for it elsewhere"""
INPUTS = ("diffuseColor", "diffuse_color_constant", "diffuse_reflection_color")
"""Inputs of UsdPreviewSurface, OmniPBR and OmniSurface"""
OPACITIES = ("opacity", "opacity_constant")


def read_visuals(building: Building, prims: list[Any]) -> tuple[Visual, ...]:
    """Empty where the geoms say all that there is to see."""
    reader = _Reader(building)
    found = [(visual, geom) for prim in prims for visual, geom in reader.read(prim)]
    if len(found) == len(building.geoms) and all(_is_seen(visual, geom) for visual, geom in found):
        return ()
    return tuple(visual for visual, _ in found)


def _is_seen(visual: Visual, geom: Geom | None) -> bool:
    """Whether a geom looks like its visual."""
    if geom is None or visual.colour is not None:
        return False
    if not isinstance(visual.shape, TriangleMesh) or isinstance(geom.shape, Mesh):
        return True
    # A hull that has all points of its mesh is the mesh.
    return isinstance(geom.shape, Hull) and len(geom.shape.vertices) == len(visual.shape.vertices)


@dataclass
class _Reader:
    building: Building

    def __post_init__(self) -> None:
        scene = self.building.scene
        quiet = Scene(**{**vars(scene), "issues": Issues(scene.path), "read": set()})
        self.shapes = Colliders(quiet)
        self.scene = quiet

    def read(self, prim: Any) -> Iterator[tuple[Visual, Geom | None]]:
        """The visual of a prim that is rendered, and its geom if it collides too."""
        from pxr import UsdGeom

        if not prim.IsA(UsdGeom.Gprim):
            return
        seen = UsdGeom.Imageable(prim)
        if str(seen.ComputePurpose()) not in SHOWN or seen.ComputeVisibility() == UsdGeom.Tokens.invisible:
            return
        path = self.building._body_of(prim)
        body = self.building.index.get(path, WORLD)
        try:
            shape, at = self._shape(prim, self.building.builder.pose(body))
        except (InputError, ValueError, TypeError):
            return
        visual = Visual(prim.GetName(), body, at, shape=shape, colour=self._colour(prim))
        geom, _ = self.building.geoms.get(str(prim.GetPath()), (None, ""))
        yield visual, None if geom is None else self.building.builder.part("geom", geom)

    def _shape(self, prim: Any, frame: Transform) -> tuple[Shape | TriangleMesh, Transform]:
        if prim.GetTypeName() == "Mesh":
            mesh, at = self.shapes.surface(prim, frame)
            return TriangleMesh(mesh.vertices.astype(np.float32), mesh.triangles), at
        found = self.shapes.read(prim, frame, moves=False)
        if found is None or isinstance(found[0], Plane):
            raise InputError("not shown")
        return found

    def _colour(self, prim: Any) -> tuple[float, ...] | None:
        """That of the bound material, else displayColor of the prim; textures are not read."""
        from pxr import UsdGeom, UsdShade

        bound, _ = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial()
        colour, opacity = _of_material(bound) if bound else (None, None)
        if colour is None:
            seen = UsdGeom.Gprim(prim)
            colour = _first(seen.GetDisplayColorPrimvar().ComputeFlattened())
            opacity = _first(seen.GetDisplayOpacityPrimvar().ComputeFlattened())
        if colour is None:
            return None
        values = [*np.ravel(colour), 1.0 if opacity is None else opacity]
        if len(values) != 4 or not np.isfinite(values).all():
            return None
        return tuple(np.round(np.clip(np.array(values, dtype=np.float64), 0, 1), 6).tolist())


def _first(values: Any) -> Any:
    """One colour or opacity for all; of one per point the first."""
    return values[0] if values is not None and len(values) else None


def _of_material(material: Any) -> tuple[Any, Any]:
    """Colour and opacity of the first shader of a material that has one."""
    from pxr import Usd, UsdShade

    for prim in Usd.PrimRange(material.GetPrim()):
        shader = UsdShade.Shader(prim)
        if not shader:
            continue
        for name in INPUTS:
            if (colour := _input(shader, name)) is not None:
                opacity = next((o for n in OPACITIES if (o := _input(shader, n)) is not None), None)
                return colour, opacity
    return None, None


def _input(shader: Any, name: str) -> Any:
    found = shader.GetInput(name)
    return found.Get() if found else None
