"""Sentences of the documents that say what a table shows agree with its committed rows."""

import csv

import pytest


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
