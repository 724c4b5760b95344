"""A recording as a scene of USD: a transform per body with a sample per frame, meshes that share surfaces."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ...io.models.usd.names import identifiers
from ...io.models.usd.stage import new_stage
from ...model.parts import WORLD
from ..batches import Batch, visuals_of

if TYPE_CHECKING:
    from ...io.recordings.recording import Recording

TICKS = 1000.0
"""Time codes per second: a frame is at its time in ms, whatever the step."""


def write_usd(recording: Recording, path: Path) -> None:
    """A .usd, .usda (text) or .usdc (binary) file, z up, in metres, one time code per millisecond."""
    model = recording.model
    with new_stage(path) as stage:
        from pxr import Gf, UsdGeom

        stage.SetTimeCodesPerSecond(TICKS)
        times = TICKS * np.asarray(recording.times)
        stage.SetStartTimeCode(float(times[0]))
        stage.SetEndTimeCode(float(times[-1]))
        root = UsdGeom.Xform.Define(stage, "/scene")
        stage.SetDefaultPrim(root.GetPrim())
        names = identifiers(body.name for body in model.bodies)
        bodies = {k: UsdGeom.Xform.Define(stage, f"/scene/{name}") for k, name in enumerate(names)}
        moves = {k: (x.AddTranslateOp(), x.AddOrientOp()) for k, x in bodies.items()}
        for frame, time in enumerate(times.tolist()):
            positions, orientations = recording.positions[frame], recording.orientations[frame]
            for k, (translate, orient) in moves.items():
                translate.Set(Gf.Vec3d(*positions[k].tolist()), time)
                orient.Set(Gf.Quatf(*orientations[k].tolist()), time)
        for b, batch in enumerate(visuals_of(model)):
            _add_batch(stage, b, batch, names)


def _add_batch(stage: Any, number: int, batch: Batch, names: list[str]) -> None:
    """The surface once, and an instance of it for each item, below its body or the scene."""
    from pxr import Gf, UsdGeom

    stage.CreateClassPrim("/surfaces")
    path = f"/surfaces/surface_{number}"
    mesh = UsdGeom.Mesh.Define(stage, path)
    mesh.CreatePointsAttr(batch.surface.vertices)
    mesh.CreateFaceVertexCountsAttr(np.full(len(batch.surface.triangles), 3, dtype=np.int32))
    mesh.CreateFaceVertexIndicesAttr(batch.surface.triangles.astype(np.int32).ravel())
    mesh.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    mesh.CreateDoubleSidedAttr(batch.surface.flat)
    for k, body in enumerate(batch.bodies.tolist()):
        parent = "/scene" if body == WORLD or not batch.moves else f"/scene/{names[body]}"
        prim = stage.DefinePrim(f"{parent}/shape_{number}_{k}", "Mesh")
        prim.GetReferences().AddInternalReference(path)
        item = UsdGeom.Mesh(prim)
        item.AddTranslateOp().Set(Gf.Vec3d(*batch.positions[k].tolist()))
        item.AddOrientOp().Set(Gf.Quatf(*batch.rotations[k].tolist()))
        item.AddScaleOp().Set(Gf.Vec3f(*batch.scales[k].tolist()))
        item.CreateDisplayColorAttr([Gf.Vec3f(*(batch.colours[k] / 255).tolist())])
        if batch.opacity < 1:
            item.CreateDisplayOpacityAttr([batch.opacity])
