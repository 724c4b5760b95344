"""Numbers and sentences of the documents agree with the committed tables, which are of this version."""

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
