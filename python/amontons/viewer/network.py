"""The network of contact forces on a page: a bar for each line, as thick as the force is large."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..checks import Array
from ..model.shapes import Cylinder
from ..report.force_lines import Lines
from ..report.surfaces import surface_of

if TYPE_CHECKING:
    import viser


class Network:
    """Bars of one batch. It only grows: those that are not needed have no size."""

    def __init__(self, server: viser.ViserServer, name: str, *, room: int = 0) -> None:
        """room: how many bars are expected."""
        self._scene, self._name, self._room = server.scene, name, room
        self._handle: Any = None

    def show(self, lines: Lines) -> None:
        """Draw these lines in place of those before."""
        count = len(lines[0])
        if self._handle is None or count > self._room:
            self._room = max(self._room, count + count // 2)
            self._add(lines)
            return
        at, q, scale, colours = self._bars(lines)
        handle = self._handle
        handle.batched_positions, handle.batched_wxyzs, handle.batched_scales = at, q, scale
        handle.batched_colors, handle.visible = colours, True

    def hide(self) -> None:
        """Draw nothing."""
        if self._handle is not None and self._handle.visible:
            self._handle.visible = False

    def _add(self, lines: Lines) -> None:
        if self._room == 0:
            return
        bar = surface_of(Cylinder(1.0, 1.0))
        at, q, scale, colours = self._bars(lines)
        self._handle = self._scene.add_batched_meshes_simple(
            self._name,
            bar.vertices,
            bar.triangles,
            q,
            at,
            batched_scales=scale,
            batched_colors=colours,
            cast_shadow=False,
            receive_shadow=False,
            lod="off",
        )

    def _bars(self, lines: Lines) -> tuple[Array, Array, Array, Array]:
        """Positions, rotations, scales and colours, of `room` bars."""
        start, end, width, colours = lines
        along = end - start
        length = np.linalg.norm(along, axis=1)
        way = along / np.where(length > 0, length, 1.0)[:, None]
        # Half-way between no turn and twice the turn from z to the way; from z to -z it is one about x.
        q = np.column_stack((1 + way[:, 2], -way[:, 1], way[:, 0], np.zeros(len(way))))
        q[way[:, 2] < -0.9999] = (0, 1, 0, 0)
        q /= np.linalg.norm(q, axis=1, keepdims=True)
        scale = np.column_stack((width / 2, width / 2, length / 2))
        left = self._room - len(start)

        def padded(rows: Array, fill: tuple[float, ...], kind: Any) -> Array:
            return np.concatenate((rows, np.tile(fill, (left, 1)))).astype(kind)

        return (
            padded((start + end) / 2, (0, 0, 0), np.float32),
            padded(q, (1, 0, 0, 0), np.float32),
            padded(scale, (0, 0, 0), np.float32),
            padded(colours, (0, 0, 0), np.uint8),
        )
