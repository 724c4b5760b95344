"""Marks beside the bodies: contacts, forces, joint frames, centres of mass, the spring."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..checks import Array
from ..model.parts import WORLD
from ..model.turns import product, rotate
from ..report.batches import visuals_of
from ..report.colours import STATES
from ..report.extents import Balls
from ..report.force_lines import Lines, force_lines, width_per_newton
from .network import Network
from .runs import LiveRun, ReplayRun
from .spring import connected_mass

if TYPE_CHECKING:
    import viser

NORMAL, CENTRE, SPRING = (90, 90, 90), (30, 30, 30), (250, 180, 20)
MOST = 4000
"""Contacts drawn; of more, every second, third, ..."""
KINDS = ("contact points", "normals", "forces", "force network", "joint frames", "centres of mass")


class Marks:
    """Each kind is drawn while it is switched on."""

    def __init__(self, server: viser.ViserServer, root: str, run: LiveRun | ReplayRun) -> None:
        self._server = server
        self._scene, self._root, self._run = server.scene, f"{root}/marks", run
        self._size = run.model.length
        self._handles: dict[str, Any] = {}
        self.wanted = dict.fromkeys(KINDS, False)
        self.force_scale = self._default_scale()
        """m of arrow per N"""
        self._network = Network(server, f"{self._root}/force network")
        self._per_newton = 0.0
        """m of a line's width per N, from the forces when it is first drawn"""

    def want(self, kind: str, wanted: bool) -> None:
        """Switch one of KINDS on or off."""
        self.wanted[kind] = wanted

    def scale_forces(self, factor: float) -> None:
        """Draw the arrows of forces this many times as long as they are by default."""
        self.force_scale = factor * self._default_scale()

    def _show_network(self, positions: Array, orientations: Array) -> None:
        model, contacts = self._run.model, self._run.contacts
        if not self._per_newton:
            balls = Balls.of(visuals_of(model))
            self._per_newton = width_per_newton([contacts], balls.median(balls.thickness))
        self._network.show(force_lines(model, positions, orientations, contacts, self._per_newton))

    def show_joints(self, lines: Lines) -> None:
        """Draw these lines in the world, beside what is switched on."""
        Network(self._server, f"{self._root}/joints", room=len(lines[0])).show(lines)

    def show(self, positions: Array, orientations: Array) -> None:
        """Draw what is wanted, with the bodies at these poses."""
        wanted = self.wanted
        table = None
        if wanted["contact points"] or wanted["normals"] or wanted["forces"]:
            table = self._run.contacts
            table = table[:: max(1, -(-len(table) // MOST))]
        colours = np.array([STATES[state] for state in table["state"]]) if table is not None else None
        for kind in KINDS:
            draw = wanted[kind]
            if kind == "force network":
                if draw:
                    self._show_network(positions, orientations)
                else:
                    self._network.hide()
            elif not draw:
                self._hide(kind)
            elif kind == "contact points":
                self._points(kind, table["point"], colours)
            elif kind == "normals":
                self._arrows(kind, table["point"], 0.5 * self._size * table["normal"], NORMAL)
            elif kind == "forces":
                self._arrows(kind, table["point"], self.force_scale * table["force"], colours)
            elif kind == "joint frames":
                self._joint_frames(kind, positions, orientations)
            else:
                local = np.array([body.centre_of_mass for body in self._run.model.bodies]).reshape(-1, 3)
                self._points(kind, positions + rotate(orientations, local), CENTRE)
        ends = self._run.spring.ends() if isinstance(self._run, LiveRun) else None
        if ends is None:
            self._hide("spring")
        else:
            self._arrows("spring", ends[0][None], (ends[1] - ends[0])[None], SPRING)

    def _default_scale(self) -> float:
        """A quarter of the weight of the median body, with all that joints connect with it, is drawn three
        times as long as a body is large."""
        masses = connected_mass(self._run.model)
        weight = 9.81 / 4 * float(np.median(masses[masses > 0])) if (masses > 0).any() else 1.0
        return 3 * self._size / max(weight, 1e-12)

    def _points(self, kind: str, points: Array, colours: Any) -> None:
        points = points.astype(np.float32)
        rgb = np.broadcast_to(np.array(colours, dtype=np.uint8), points.shape)
        if not len(points):
            self._hide(kind)
        elif (handle := self._handles.get(kind)) is None:
            self._handles[kind] = self._scene.add_point_cloud(
                f"{self._root}/{kind}",
                points,
                rgb,
                point_size=0.12 * self._size,
                point_shape="circle",
                precision="float32",
            )
        else:
            handle.points, handle.colors, handle.visible = points, rgb, True

    def _arrows(self, kind: str, points: Array, along: Array, colours: Any) -> None:
        seen = np.linalg.norm(along, axis=1) > 1e-3 * self._size
        ends = np.stack((points[seen], (points + along)[seen]), axis=1).astype(np.float32)
        rgb = np.broadcast_to(np.array(colours, dtype=np.uint8), points.shape)[seen]
        if not len(ends):
            self._hide(kind)
        elif (handle := self._handles.get(kind)) is None:
            thick = 0.05 * self._size
            self._handles[kind] = self._scene.add_arrows(
                f"{self._root}/{kind}",
                ends,
                rgb,
                shaft_radius=thick,
                head_radius=2.5 * thick,
                head_length=5 * thick,
            )
        else:
            handle.points, handle.colors, handle.visible = ends, rgb, True

    def _joint_frames(self, kind: str, positions: Array, orientations: Array) -> None:
        joints = self._run.model.joints
        if not joints:
            return
        bodies = np.array([joint.body_a for joint in joints])
        q = np.where((bodies == WORLD)[:, None], (1.0, 0.0, 0.0, 0.0), orientations[bodies])
        x = np.where((bodies == WORLD)[:, None], 0.0, positions[bodies])
        at = x + rotate(q, np.array([joint.frame_a.position for joint in joints]))
        axes = product(q, np.array([joint.frame_a.rotation for joint in joints]))
        if (handle := self._handles.get(kind)) is None:
            self._handles[kind] = self._scene.add_batched_axes(
                f"{self._root}/{kind}",
                axes.astype(np.float32),
                at.astype(np.float32),
                axes_length=1.5 * self._size,
                axes_radius=0.05 * self._size,
            )
        else:
            handle.batched_positions, handle.batched_wxyzs = at.astype(np.float32), axes.astype(np.float32)
            handle.visible = True

    def _hide(self, kind: str) -> None:
        if (handle := self._handles.get(kind)) is not None and handle.visible:
            handle.visible = False
