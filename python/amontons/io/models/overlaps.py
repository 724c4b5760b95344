"""Links of one tree that overlap from the start, or hang on a fixed base: they do not touch each other."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

from ...checks import listed
from ...model.model import Model
from .compiled import Compiled

ALLOWED = 1e-4
"""lengths of the model: smaller overlaps count as zero, as in the correction of positions"""

Pairs = set[tuple[int, int]]


class Trees:
    """Which geoms belong to which tree of links. In MJCF the geoms of the world are scenery and belong to no
    model, except those of a body that is fixed there. URDF has no scenery."""

    def __init__(self, compiled: Compiled, sources: list[int]) -> None:
        m = compiled.model
        self.urdf = compiled.root.tag == "robot"
        self.weld, self.root = m.body_weldid, m.body_rootid
        self.body = {ours: int(m.geom_bodyid[g]) for ours, g in enumerate(sources)}
        self.links: dict[int, list[int]] = {}
        for geom, body in self.body.items():
            self.links.setdefault(int(self.weld[body]), []).append(geom)
        self.bases: dict[int, list[int]] = {}
        for geom in self.links.get(0, []):
            self.bases.setdefault(int(self.root[self.body[geom]]), []).append(geom)

    def tree(self, geom: int) -> int:
        body = self.body[geom]
        return 0 if self.urdf else int(self.root[body]) or -1 - geom

    def link(self, geom: int) -> list[int]:
        """The geoms that are rigidly joined to this one; of what is fixed to the world those of its tree."""
        return [g for g in self.links[int(self.weld[self.body[geom]])] if self.tree(g) == self.tree(geom)]

    def base(self, body: int) -> list[int]:
        """The geoms of the fixed base that a joint of this MuJoCo body joins it to, if any."""
        return self.links.get(0, []) if self.urdf else self.bases.get(int(self.root[body]), [])


def without_overlaps(compiled: Compiled, sources: list[int], model: Model, *, all_too: bool) -> Model:
    """The model without contacts between what a joint joins to a fixed base and that base, and, with
    `all_too`, between links of one tree that overlap in the pose of the file; those are listed.

    sources: the geom of MuJoCo of each geom of the model."""
    trees = Trees(compiled, sources)
    excluded: Pairs = set()
    if compiled.enabled("filterparent"):
        m = compiled.model
        for body in range(1, m.nbody):
            # The link hangs on the world: its parent is welded to it. One that floats only starts there.
            joint = int(m.body_jntadr[body])
            if joint >= 0 and m.jnt_type[joint] == compiled.mujoco.mjtJoint.mjJNT_FREE:
                continue
            if int(m.body_weldid[body]) == body and int(m.body_weldid[m.body_parentid[body]]) == 0:
                excluded |= set(product(trees.links.get(body, []), trees.base(body)))
    model = _excluding(model, excluded)
    if not all_too:
        return model
    overlapping: Pairs = set()
    names: list[str] = []
    for a, b in model.core.overlaps(ALLOWED * model.core.length):
        if trees.tree(a) != trees.tree(b) or (a, b) in overlapping:
            continue
        links = trees.link(a), trees.link(b)
        overlapping |= {(min(p), max(p)) for p in product(*links)}
        names.append(" and ".join(_link_name(compiled, trees, links_[0]) for links_ in links))
    if names:
        compiled.issues.notes.append(
            f"links that overlap in the pose of the file do not touch each other: {listed(names)} "
            "(self_overlaps=True lets them)"
        )
    return _excluding(model, overlapping)


def _excluding(model: Model, pairs: Pairs) -> Model:
    pairs = {(min(p), max(p)) for p in pairs}
    return replace(model, excluded_geoms=(*model.excluded_geoms, *sorted(pairs))) if pairs else model


def _link_name(compiled: Compiled, trees: Trees, geom: int) -> str:
    weld = int(trees.weld[trees.body[geom]])
    body = weld or trees.body[geom]
    return f'"{compiled.name("body", body) or "the base"}"'
