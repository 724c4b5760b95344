"""A verdict on blocks on a page."""

import amontons
import pytest
from amontons import scenes
from amontons.studies import stability


# Breaks when the page of a verdict cannot be made, loses its joints, or lets the blocks fall.
def test_a_verdict_has_a_page():
    pytest.importorskip("viser")
    verdict = stability(scenes.make("arch"))
    viewer = amontons.view(verdict, port=18231)
    try:
        assert len(viewer.run.model.bodies) == len(verdict.assembly.blocks)
        assert viewer.run.model.gravity == (0, 0, 0)
        names = [name for name in viewer.marks._scene._handle_from_node_name if name.endswith("marks/joints")]
        assert len(names) == 1
    finally:
        viewer.close()
    with pytest.raises(amontons.InputError, match="a verdict on blocks"):
        amontons.view(verdict.assembly)
