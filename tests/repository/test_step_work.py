"""benchmarks/step_work.py: instructions of a step by stage."""

import shutil
import sys
from pathlib import Path

import pytest

FUNCTION = (
    "amontons::(anonymous namespace)::Search<amontons::Box<3> >::find(amontons::Vec3 const&, int) const"
)
PROFILE = """# callgrind format
version: 1
creator: callgrind-3.19.0
positions: line
events: Ir

fl=(1) step.cpp
fn=(1) counted_steps
1 100
cfn=(2) amontons::ContactFinder::find(amontons::Reach const&)
calls=1 1
1 700
cfn=(3) amontons::integrate(double)
calls=1 1
1 200

fn=(2)
1 700

fn=(3)
1 200

totals: 1000
"""


@pytest.fixture
def step_work(root, monkeypatch):
    monkeypatch.syspath_prepend(str(root / "benchmarks"))
    import step_work

    yield step_work
    for name in ("step_work", "common"):
        sys.modules.pop(name, None)


def run(step_work, monkeypatch, *arguments: object) -> None:
    monkeypatch.setattr(sys, "argv", ["step_work.py", *map(str, arguments)])
    step_work.main()


def test_functions_have_plain_names(step_work):
    """Fails if functions of one name are not added, as their templates and arguments differ."""
    assert step_work.plain(FUNCTION) == "Search::find"


def test_without_the_program_it_says_so(step_work, monkeypatch, tmp_path, capsys):
    """Fails if a machine without valgrind or the program gets an error in place of the remedy."""
    run(step_work, monkeypatch, "--program", tmp_path / "none", "--out", tmp_path)
    assert "skipped" in capsys.readouterr().out


@pytest.mark.skipif(not shutil.which("callgrind_annotate"), reason="there is no valgrind")
def test_costs_of_a_profile_are_inclusive(step_work, tmp_path):
    """Fails if the profile is read wrongly, so that a stage has no cost or only that of its own lines."""
    file = tmp_path / "profile"
    file.write_text(PROFILE)
    costs = step_work.inclusive_costs(file)
    assert costs == {"counted_steps": 1000, "ContactFinder::find": 700, "integrate": 200}


@pytest.mark.skipif(not shutil.which("valgrind"), reason="there is no valgrind")
def test_stages_of_a_robot_on_wheels(step_work, monkeypatch, tmp_path):
    """Fails if a stage has lost its function: collision and solve are most of such a step."""
    if not Path(step_work.PROGRAM).exists():
        pytest.skip("the program that valgrind runs is not built")
    run(step_work, monkeypatch, "--quick", "--only", "wheels", "--out", tmp_path)
    rows = {row["part"]: float(row["thousands"]) for row in step_work.read_csv(tmp_path / "step_work.csv")}
    assert all(rows[stage] > 0 for stage in step_work.STAGES), rows
    assert 0.5 * rows["step"] < rows["collision"] + rows["solve"] < rows["step"]
