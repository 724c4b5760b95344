"""The figures of the documents are views of the committed tables."""

import numpy as np
import pytest
from PIL import Image

pytest.importorskip("matplotlib", reason="the benchmarks need more packages than the tests")


@pytest.fixture
def figures(root, monkeypatch):
    monkeypatch.syspath_prepend(root / "benchmarks")
    import figures

    return figures


# Breaks when a figure needs more than its table, or its ground is not white.
def test_figures_are_drawn_from_tables(root, figures, tmp_path):
    figures.draw(root / "benchmarks" / "results" / "processor", tmp_path)
    drawn = {path.stem for path in tmp_path.glob("*.png")}
    assert drawn == {"growth", "profile", "beside_profile"}
    for path in tmp_path.glob("*.png"):
        corners = np.asarray(Image.open(path).convert("RGB"))[:: 10**4, :: 10**4]
        assert (corners == 255).all(), path.name


# Breaks when a family of sizes is measured and not drawn: it would not have a panel.
def test_every_family_has_a_panel(root, figures):
    rows = figures.Results(root / "benchmarks" / "results" / "processor")["growth"]
    assert {row["task"] for row in rows} == set(figures.SIZES)
    assert {row["method"] for row in rows} == set(figures.LINES)
