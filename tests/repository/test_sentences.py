"""Numbers and sentences of the documents agree with the committed tables, which are of this version."""

import csv
import re

import amontons
import pytest

pytest.importorskip("matplotlib", reason="the benchmarks need more packages than the tests")
UNIT = r"(?:mm/s|mm|ms|µs|us|s|%|N|J|times)"
QUANTITY = re.compile(rf"(?<![\w.])\d[\d.]* {UNIT}(?!\w)|\b1:\d+|(?<![\w.-])\d[\d.]* of \d+")
SETTINGS = {
    "steps of 2 ms", "within four seconds", "mass ratios of 1:10000", "steps of 5 to 10 ms", "steps of 5 ms",
}  # fmt: skip
"""What a reader chooses, and no run measures."""


@pytest.fixture
def report(root, monkeypatch):
    monkeypatch.syspath_prepend(root / "benchmarks")
    import report

    return report


@pytest.fixture
def results(root, report):
    return report.Results(root / "benchmarks" / "results" / "processor")


# Breaks when a table between markers, or a number that names its table, is not what the table gives: a run
# has renewed the table, and `report.py FOLDER --docs` did not follow.
def test_documents_are_made_of_the_tables(root, report, results):
    for document, mark, make in report.documents(results):
        text = (root / document).read_text()
        link = "benchmarks" if document == "README.md" else "../benchmarks"
        made = make(f"{link}/results/processor")
        assert f"<!-- {mark}: begin -->\n\n{made}\n\n<!-- {mark}: end -->" in text, (document, mark)
    for page in report.pages():
        text = page.read_text()
        assert report.with_figures(text, results) == text, page.name
        assert not re.search(r"<!--[^>]*\|[^>]*-->", text), "a bar ends a cell of a table"


# Breaks when a number of the first pages is of an older version.
def test_first_pages_are_of_this_version(results):
    versions = {row["version"] for row in results["beside"] if row["family"] == "amontons"}
    assert versions == {amontons.__version__} == {results.environment["amontons"]}


# Breaks when a measured number comes onto the first pages without its table.
@pytest.mark.parametrize("page", ["README.md", "docs/index.md"])
def test_numbers_of_the_first_pages_have_a_table(root, report, page):
    text = (root / page).read_text()
    text = re.sub(r"<!-- (\w+): begin -->.*?<!-- \1: end -->|```.*?```", "", text, flags=re.DOTALL)
    text = " ".join(report.CELL.sub("", report.FIGURE.sub("", text)).split())
    for setting in SETTINGS:
        text = text.replace(setting, "")
    assert not QUANTITY.findall(text)


# Breaks when a comment takes the value of another row, or a sentence keeps the number of an older table.
def test_comments_choose_rows(report):
    rows = [{"call": "a", "model": m, "time": t} for m, t in (("x", "0.002"), ("y", "0.003"), ("z", ""))]
    rows.append({"call": "b", "model": "x", "time": "0.001"})
    found = {"calls": rows, "beside": []}
    text = "7 <!-- calls.csv: call=a; least time ms --> to 8 <!-- calls.csv: call=a; most time ms --> ms"
    assert report.with_figures(text, found).startswith("2 <!--")
    assert "to 3 <!--" in report.with_figures(text, found)
    assert report.with_figures("9 <!-- calls.csv: model=x; count -->", found).startswith("2 <!--")


@pytest.fixture
def rows(root):
    def read(name):
        with (root / "benchmarks/results/processor" / name).open() as file:
            return list(csv.DictReader(file))

    return read


def text(root, name):
    return " ".join((root / "docs" / name).read_text().split())


def reaching(rows, scene, law, tolerance):
    """The methods that passed a tolerance on a step."""
    mine = [row for row in rows if (row["scene"], row["law"]) == (scene, law)]
    assert mine
    return {f"`{row['method']}`" for row in mine if row[f"products_{tolerance}"]}


# Breaks when a run changes which methods reach a tolerance, and docs/choosing.md keeps the old ones.
def test_methods_that_reach_a_tolerance(root, rows):
    table, page = rows("methods.csv"), text(root, "choosing.md")
    for law in ("associated", "coulomb"):
        assert reaching(table, "B3_s10", law, "1e-06") == {"`interior-point`"}
    assert "in both laws only the interior point reaches 1e-6" in page
    for scene in ("B4_s60", "B4_impact+5"):
        assert reaching(table, scene, "associated", "1e-06") == {"`interior-point`"}
        assert reaching(table, scene, "coulomb", "1e-06") == set()
    assert "the only one at 1e-6" in page
    assert "No method reaches 1e-6." in page
    names = " and ".join(sorted(reaching(table, "B4_impact+5", "coulomb", "1e-03")))
    assert reaching(table, "B4_s60", "coulomb", "1e-03") == set()
    assert f"Under `coulomb` {names} reach 1e-3 on the impact, and no method reaches it at rest." in page


# Breaks when the products on the network change, and docs/benchmarks.md keeps the old ratio.
def test_products_on_the_network(root, rows):
    found = {row["method"]: row for row in rows("methods.csv") if row["scene"] == "B1_s30"}
    ratios = sorted(
        int(found["p-spg-fb"][f"products_{at}"]) / int(found["cg"][f"products_{at}"])
        for at in ("1e-03", "1e-06")
    )
    said = f"**P-SPG-FB needs {ratios[0]:.1f} to {ratios[1]:.1f} times the products of CG on B1**"
    assert said in text(root, "benchmarks.md")


# Breaks when another engine grows faster, and docs/engine-curves.md keeps the old order.
def test_growth_of_a_step(root, rows):
    sizes = {}
    for row in rows("growth.csv"):
        if row["step"]:
            sizes.setdefault((row["family"], row["engine"]), {})[float(row["size"])] = float(row["step"])

    def faster(family):
        shared = sorted(sizes[family, "MuJoCo"].keys() & sizes[family, "amontons, 1e-6"].keys())
        ratio = [
            sizes[family, "MuJoCo"][s] / sizes[family, "amontons, 1e-6"][s] for s in (shared[0], shared[-1])
        ]
        return "MuJoCo" if ratio[1] > ratio[0] else "amontons"

    page = text(root, "engine-curves.md")
    said = (
        f"{faster('chain, links')} with the links of a chain, {faster('wall, rows')} with the rows of a wall."
    )
    assert said in page
    plates = [sizes["plates 1:100", f"amontons, {tolerance}"] for tolerance in ("1e-3", "1e-6")]
    assert plates[0][80] > plates[1][80]
    assert "stacks of plates take longer at 1e-3 than at 1e-6" in page
