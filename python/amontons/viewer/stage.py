"""A model in the scene of the page: batches of meshes whose poses follow the bodies."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..checks import Array
from ..model.model import Model
from ..model.parts import WORLD, Geom
from ..model.shapes import Plane
from ..model.turns import rotate
from ..report.batches import Batch, shapes_of, visuals_of

if TYPE_CHECKING:
    import viser

ROOT = "/scene"
CHOSEN = np.array([250, 210, 60], dtype=np.uint8)
"""The colour of the body that was picked."""
DARKEST = np.uint8(52)
VISUAL, COLLISION = "visual", "collision"
GLASS = 0.25
"""Opacity of what is fixed where one sees through it."""
FIELD = 40.0
"""Degrees that are seen from below to above: at 75, which viser has by default, balls beside the middle look
like eggs."""
NEARER = 1.15
"""The eye is at first so many times as far away as what moves needs to fit in."""
AROUND = (-57.0, -33.0, -90.0, 33.0, 90.0, 147.0, -147.0, 0.0, 180.0)
"""Where the eye is tried at first, one after the other: degrees about z from the x axis."""
ABOVE = 20.7
"""Degrees above the horizon."""

Grab = Callable[[str, int, Array, Array], None]
"""phase (start, update, end), body, point that was grabbed, point under the pointer (m)"""


class Stage:
    """The scene of all pages that are open."""

    def __init__(
        self,
        server: viser.ViserServer,
        model: Model,
        *,
        pick: Callable[[int], None] | None = None,
        grab: Grab | None = None,
    ) -> None:
        """pick: called with a body that was clicked, grab: while one is dragged; both in the server's
        thread."""
        self._server, self._model = server, model
        self._pick, self._grab = pick, grab
        self._offset = np.zeros(3)
        self._chosen: int | None = None
        self._batches: list[tuple[Batch, Any]] = []
        self.see_through = False
        """whether what is fixed is as of glass: walls around what moves"""
        self.faded = False
        """whether all bodies are"""
        self._root = server.scene.add_frame(ROOT, show_axes=False)
        self._light()
        self.show_shapes(VISUAL)

    @property
    def root(self) -> str:
        """The path below which all lies that goes along when the eye follows a body."""
        return ROOT

    @property
    def offset(self) -> Array:
        """By how much the world is moved back (m)."""
        return self._offset

    def frame(self, positions: Array) -> None:
        """Ground, and where the eye is first, from where the bodies are, (n, 3) or in k frames (k, n, 3)."""
        centre, size = extent(self._model, positions)
        self._ground(centre, size)
        camera = self._server.initial_camera
        camera.fov = math.radians(FIELD)
        camera.look_at = tuple(centre)
        eye = self._eye(centre, size)
        camera.position = tuple(eye)
        camera.up = (0.0, 0.0, 1.0)
        camera.near = 1e-3 * size
        self.show_through(self._hidden(positions.reshape(-1, *positions.shape[-2:])[0], eye) > 0.4)

    def _eye(self, centre: Array, size: float) -> Array:
        """The first place AROUND the centre that is not between fixed things, as in a funnel. In a hall there
        is none: then the first that is not inside of one, or is above."""
        far = NEARER * size / (2 * math.tan(math.radians(FIELD) / 2))
        flat, up = math.cos(math.radians(ABOVE)), math.sin(math.radians(ABOVE))
        turns = np.radians(AROUND)
        ways = np.column_stack((flat * np.cos(turns), flat * np.sin(turns), np.full(len(turns), up)))
        fixed = [batch for batch, _ in self._batches if not batch.moves and batch.surface.closed]
        low, high = _bounds(fixed)
        for distance in (far, 1.6 * far):
            for eye in centre + distance * ways:
                if (eye < low).any() or (eye > high).any():
                    return np.array(eye)
        for distance in (far, 0.6 * far):
            for eye in centre + distance * ways:
                if not any(inside(batch, eye) for batch in fixed):
                    return np.array(eye)
        return centre + far * np.array([0.0, 0.0, 1.0])

    def show_through(self, wanted: bool) -> None:
        """Draw what is fixed as of glass, or as it is."""
        self.see_through = wanted
        for batch, handle in self._batches:
            if not batch.moves:
                handle.opacity = self._opacity(batch)

    def fade(self, wanted: bool) -> None:
        """Draw all bodies as of glass, so that what is drawn between them is seen."""
        if wanted != self.faded:
            self.faded = wanted
            for batch, handle in self._batches:
                handle.opacity = self._opacity(batch)

    def _opacity(self, batch: Batch) -> float | None:
        glass = self.faded or (self.see_through and not batch.moves)
        opacity = min(batch.opacity, GLASS) if glass else batch.opacity
        return opacity if opacity < 1 else None

    def _hidden(self, positions: Array, eye: Array) -> float:
        """The share of the moving bodies that stand behind something fixed."""
        moving = [k for k, body in enumerate(self._model.bodies) if body.motion != "static"][:200]
        hidden = np.zeros(len(moving), dtype=bool)
        for batch, _ in self._batches:
            if not batch.moves:
                hidden |= behind(batch, eye, positions[moving])
        return float(hidden.mean()) if moving else 0.0

    @property
    def clickable(self) -> dict[str, NDArray[np.int32]]:
        """By the name of each batch that moves, the bodies of its instances."""
        return {handle.name: batch.bodies for batch, handle in self._batches if batch.moves}

    def show_shapes(self, which: str) -> None:
        """Draw the visuals or the collision shapes."""
        for _, handle in self._batches:
            handle.remove()
        drawn = visuals_of(self._model) if which == VISUAL else shapes_of(self._model)
        self._batches = [(batch, self._add(f"{ROOT}/{which} {k}", batch)) for k, batch in enumerate(drawn)]
        self.choose(self._chosen)

    def move(self, positions: Array, orientations: Array) -> None:
        """Show the bodies at these poses, (n, 3) and (n, 4)."""
        for batch, handle in self._batches:
            if batch.moves:
                at, q = batch.placed(positions, orientations)
                handle.batched_positions = at.astype(np.float32)
                handle.batched_wxyzs = q.astype(np.float32)

    def follow(self, offset: Array) -> None:
        """Move the world back by `offset` (m), so that what has moved by it stays before the eye."""
        if not np.array_equal(offset, self._offset):
            self._offset = offset
            self._root.position = tuple(-offset)

    def choose(self, body: int | None) -> None:
        """Colour a body as picked, and no other."""
        self._chosen = body
        for batch, handle in self._batches:
            colours = batch.colours
            if body is not None and (batch.bodies == body).any():
                colours = np.where((batch.bodies == body)[:, None], CHOSEN, colours)
            if not np.array_equal(handle.batched_colors, sent := linear(colours)):
                handle.batched_colors = sent

    def _light(self) -> None:
        """From above, with shadows, and the rest from all sides; nothing is fetched for it."""
        scene = self._server.scene
        scene.configure_environment_map(None)
        scene.configure_default_lights(cast_shadow=True)
        scene.add_light_hemisphere(
            "/sky", sky_color=(255, 255, 255), ground_color=(170, 160, 150), intensity=1.8
        )

    def _add(self, name: str, batch: Batch) -> Any:
        handle = self._server.scene.add_batched_meshes_simple(
            name,
            batch.surface.vertices,
            batch.surface.triangles,
            batch.rotations.astype(np.float32),
            batch.positions.astype(np.float32),
            batched_scales=batch.scales.astype(np.float32),
            batched_colors=linear(batch.colours),
            opacity=self._opacity(batch),
            flat_shading=batch.surface.flat,
            side="double" if batch.surface.flat else "front",  # visual meshes may be open
            lod="off",
        )
        if batch.moves and self._pick is not None and self._grab is not None:
            self._listen(batch, handle, self._pick, self._grab)
        return handle

    def _listen(self, batch: Batch, handle: Any, pick: Callable[[int], None], grab: Grab) -> None:
        """Callbacks are coroutines: the server runs them in order, and all they do is to post."""

        @handle.on_click
        async def _(event: Any) -> None:
            if event.instance_index is not None and event.instance_index < len(batch.bodies):
                pick(int(batch.bodies[event.instance_index]))

        @handle.on_drag
        async def _(event: Any) -> None:
            if event.instance_index is not None and event.instance_index < len(batch.bodies):
                body = int(batch.bodies[event.instance_index])
                grabbed, pointer = np.array(event.start_position), np.array(event.end_position)
                grab(event.phase, body, grabbed + self._offset, pointer + self._offset)

    def _ground(self, centre: Array, size: float) -> None:
        for k, geom in enumerate(self._model.geoms):
            if isinstance(geom.shape, Plane) and geom.body == WORLD:
                self._plane(f"{ROOT}/plane {k}", geom, centre, size)

    def _plane(self, name: str, geom: Geom, centre: Array, size: float) -> None:
        cell = 10.0 ** np.floor(np.log10(size / 3))
        width = 20 * cell * np.ceil(size / cell)
        at = np.array(geom.frame.position)
        if geom.frame.rotation[0] ** 2 > 0.999:  # a floor: put below what stands on it
            at[:2] = np.round(centre[:2] / cell) * cell
        self._server.scene.add_grid(
            name,
            width=width,
            height=width,
            cell_size=cell,
            section_size=5 * cell,
            cell_color=(205, 205, 200),
            section_color=(175, 175, 170),
            plane_color=(236, 234, 228),
            plane_opacity=1.0,
            shadow_opacity=0.35,
            fade_distance=8 * size,
            wxyz=geom.frame.rotation,
            position=tuple(at),
        )


def extent(model: Model, positions: Array) -> tuple[Array, float]:
    """The middle of what moves, at positions (n, 3) or (k, n, 3), and its largest diameter (m), but for the
    few that are far off."""
    moving = [k for k, body in enumerate(model.bodies) if body.motion != "static"]
    points = (positions[..., moving, :] if moving else positions).reshape(-1, 3)
    if not len(points):
        return np.zeros(3), 1.0
    low, high = np.percentile(points, 1, axis=0), np.percentile(points, 99, axis=0)
    reach = float(np.linalg.norm(high - low))
    return (low + high) / 2, max(reach, 4 * model.length)


def behind(batch: Batch, eye: Array, points: Array) -> NDArray[np.bool_]:
    """(n,) whether the way from the eye to each point leads through the box around an instance that does not
    move."""
    low, high = batch.surface.vertices.min(axis=0), batch.surface.vertices.max(axis=0)
    found = np.zeros(len(points), dtype=bool)
    for at, q, scale in zip(batch.positions, batch.rotations, batch.scales, strict=True):
        back = np.broadcast_to(q * (1, -1, -1, -1), (len(points), 4))
        start = rotate(back[:1], (eye - at)[None])[0] if len(points) else eye
        way = rotate(back, points - at) - start
        with np.errstate(divide="ignore", invalid="ignore"):  # along a face: 0 / 0 is outside
            one, other = (low * scale - start) / way, (high * scale - start) / way
        enter, leave = np.minimum(one, other).max(axis=1), np.maximum(one, other).min(axis=1)
        found |= (enter < leave) & (enter > 0) & (leave < 1)
    return found


def _bounds(batches: list[Batch]) -> tuple[Array, Array]:
    """The lowest and the highest coordinates (3,) of all instances of these, which do not move."""
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    for batch in batches:
        for at, q, scale in zip(batch.positions, batch.rotations, batch.scales, strict=True):
            corners = batch.surface.vertices * scale
            there = at + rotate(np.broadcast_to(q, (len(corners), 4)), corners)
            low, high = np.minimum(low, there.min(axis=0)), np.maximum(high, there.max(axis=0))
    return low, high


def inside(batch: Batch, eye: Array) -> bool:
    """Whether the eye is in the box around an instance of a closed surface that does not move."""
    if not batch.surface.closed:
        return False
    back = batch.rotations * (1, -1, -1, -1)
    local = rotate(back, eye - batch.positions) / batch.scales
    low, high = batch.surface.vertices.min(axis=0), batch.surface.vertices.max(axis=0)
    return bool(((local >= low) & (local <= high)).all(axis=1).any())


def linear(colours: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Colours (n, 3) as the page takes them, linear in the light; none is black, where no shade is seen."""
    return np.round(255 * (np.maximum(colours, DARKEST) / 255) ** 2.2).astype(np.uint8)
