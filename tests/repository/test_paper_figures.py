"""benchmarks/paper_figures.py: every figure and table, on small scenes."""

import csv
import re
import subprocess
import sys

import amontons
import pytest


def rows(path):
    with open(path) as file:
        return list(csv.DictReader(file))


@pytest.fixture(scope="module")
def folder(root, tmp_path_factory):
    folder = tmp_path_factory.mktemp("paper") / "deep" / "out"
    program = [sys.executable, str(root / "benchmarks" / "paper_figures.py")]
    words = ["--quick", "--deadline", "0.03", "--out", str(folder)]
    result = subprocess.run([*program, *words], capture_output=True, text=True)
    assert result.returncode == 0, result.stderr
    assert str(folder / "README.md") in result.stdout
    return folder


# Breaks when a figure is missing, or the page links to one that is not there.
def test_page_and_figures(folder):
    page = (folder / "README.md").read_text()
    for name in ("objective", "convergence", "size", "ratio", "snapshots"):
        assert (folder / f"{name}.png").read_bytes().startswith(b"\x89PNG")
        assert f"({name}.png)" in page
    for link in re.findall(r"\]\(([^)]+)\)", page):
        assert (folder / link).exists()
    for word in (
        "`python benchmarks/paper_figures.py --quick --deadline 0.03`",
        "B1",
        "B2",
        "B3",
        "B4",
        "p-spg-fb-literal",
        "nonmonotone",
    ):
        assert word in page


# Breaks when a method or a benchmark is left out: all methods on B1 to B4, CG and MINRES on B1 alone.
def test_every_method_on_every_benchmark(folder):
    summary = rows(folder / "summary.csv")
    methods = {m for m in amontons.vi.methods() if m != "auto"}
    for name in ("B1", "B2", "B3", "B4"):
        mine = {row["method"]: row["status"] for row in summary if row["problem"].startswith(name)}
        assert set(mine) == methods
        refused = {method for method, status in mine.items() if status == "not applicable"}
        assert refused == (set() if name == "B1" else {"cg", "minres"})
    assert {row["method"] for row in rows(folder / "curves.csv")} == methods


# Breaks when the sweeps lose a size, a ratio or a method, or the bodies are not those of the scenes.
def test_sweeps(folder):
    size, ratio = rows(folder / "size.csv"), rows(folder / "ratio.csv")
    found = {name: {int(r["bodies"]) for r in size if r["problem"] == name} for name in ("B1", "B2", "B3")}
    assert found == {"B1": {8, 27}, "B2": {8, 27}, "B3": {4, 8}}
    assert {float(r["value"]) for r in ratio} == {1, 1e2, 1e4}
    for table in (size, ratio):
        assert {"p-spg-fb", "p-spg-fb-literal", "gauss-seidel", "apgd", "jacobi"} <= {
            r["method"] for r in table
        }
        assert all(float(r["residual"]) >= 0 and int(r["products"]) >= 0 for r in table)


# Breaks when the objective is that of other vectors: the fallback at the last stop is an iterate, and no
# objective lies below that of an accurate solution by more than rounding.
def test_objective(folder):
    found = rows(folder / "objective.csv")
    objectives = [float(r["objective"]) for r in found]
    fallback = [float(r["fallback_objective"]) for r in found if r["fallback_objective"]]
    assert len(fallback) > 5
    assert min(objectives) < objectives[0]
    scale = max(objectives) - min(objectives)
    assert min(fallback) >= min(objectives) - 1e-9 * scale
