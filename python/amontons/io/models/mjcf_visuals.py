"""Visuals of a model as geoms of MJCF that touch nothing, as robots in MuJoCo's format have them."""

from __future__ import annotations

from xml.etree import ElementTree as ET

import numpy as np

from ...model.parts import Geom
from ...model.visuals import TriangleMesh, Visual
from .mjcf_draft import Draft, placed, sized, within, words

SEEN, HIDDEN = "2", "3"
"""Groups of geoms: MuJoCo's viewer shows those up to 2 from the start"""
LEAST = 1e-12
"""m^2: a surface that MuJoCo takes at least"""


def write_visuals(draft: Draft, made: dict[int, ET.Element]) -> None:
    """made: the elements of the geoms of the model. Those that are not seen go to a hidden group."""
    if not draft.model.visuals:
        return
    writer = _Visuals(draft)
    for visual in draft.model.visuals:
        writer.write(visual, made)
    parts = {(visual.body, visual.link) for visual in draft.model.visuals}
    for k, geom in enumerate(draft.model.geoms):
        if (geom.body, geom.link) in parts and k not in writer.seen and made[k].get("type") != "plane":
            made[k].set("group", HIDDEN)


class _Visuals:
    def __init__(self, draft: Draft) -> None:
        self.draft = draft
        self.seen: set[int] = set()
        """geoms that look like a visual"""
        self.meshes: dict[int, str] = {}
        self.taken = {geom.name for geom in draft.model.geoms}
        self.on: dict[tuple[int, int], list[int]] = {}
        for k, geom in enumerate(draft.model.geoms):
            self.on.setdefault((geom.body, geom.link), []).append(k)

    def write(self, visual: Visual, made: dict[int, ET.Element]) -> None:
        geoms = self.draft.model.geoms
        alike = (k for k in self.on.get((visual.body, visual.link), []) if _alike(geoms[k], visual))
        k = next((k for k in alike if k not in self.seen), -1)
        if k >= 0:
            self.seen.add(k)
            element = made[k]
        else:
            element = self._new(visual)
        if visual.colour is not None:
            element.set("rgba", words(*visual.colour))

    def _new(self, visual: Visual) -> ET.Element:
        above, own = self.draft.at(visual.body, visual.link)
        element = ET.Element("geom", contype="0", conaffinity="0", group=SEEN, mass="0")
        placed(element, within(own, visual.frame))
        if isinstance(visual.shape, TriangleMesh):
            if _area(visual.shape) < LEAST:
                self.draft.lose(f'visual "{visual.name}"', "a mesh without a surface", "none")
                return element
            element.set("type", "mesh")
            element.set("mesh", self._mesh(visual.shape))
        elif not sized(element, visual.shape):
            self.draft.lose(f'visual "{visual.name}"', f"its {type(visual.shape).__name__}", "none")
            return element
        if visual.name and visual.name not in self.taken:
            element.set("name", visual.name)
            self.taken.add(visual.name)
        above.append(element)
        return element

    def _mesh(self, mesh: TriangleMesh) -> str:
        if id(mesh) not in self.meshes:
            name = self.meshes[id(mesh)] = f"visual_{len(self.meshes)}"
            made = ET.SubElement(self.draft.sections["asset"], "mesh", name=name, inertia="shell")
            points = np.array(mesh.vertices)
            if len(points) < 4:  # MuJoCo asks for four
                points = np.concatenate([points, points[-1:]])
            made.set("vertex", " ".join(map(str, points.ravel().tolist())))
            made.set("face", " ".join(map(str, np.ravel(mesh.triangles).tolist())))
        return self.meshes[id(mesh)]


def _alike(geom: Geom, visual: Visual) -> bool:
    """Whether MuJoCo draws a geom as the visual."""
    if geom.frame != visual.frame or geom.shape is visual.shape:
        return geom.frame == visual.frame
    same = type(geom.shape) is type(visual.shape)
    return same and sized(ET.Element("geom"), geom.shape) and repr(geom.shape) == repr(visual.shape)


def _area(mesh: TriangleMesh) -> float:
    a, b, c = (np.array(mesh.vertices, dtype=np.float64)[mesh.triangles[:, k]] for k in range(3))
    return 0.5 * float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum())
