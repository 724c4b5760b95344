"""benchmarks/before_after.py: what became slower is told, and the exit code says so."""

import shutil
import sys

import pytest

STEPS = "task,law,tolerance,fastest,iterations\n"
ROBOTS = "model,step_median\n"


@pytest.fixture
def main(root, monkeypatch):
    monkeypatch.syspath_prepend(str(root / "benchmarks"))
    import before_after

    yield before_after.main
    sys.modules.pop("before_after", None)


@pytest.fixture
def folders(tmp_path):
    """Two folders with the same two tables."""
    before, after = tmp_path / "before", tmp_path / "after"
    before.mkdir()
    (before / "steps.csv").write_text(STEPS + "wall,coulomb,1e-4,2.0,100\nheap,coulomb,1e-4,1.0,50\n")
    (before / "robots.csv").write_text(ROBOTS + "a1,1e-5\ngo1,3e-5\nbroken,\n")
    shutil.copytree(before, after)
    return before, after


def change(folder, file, old, new):
    path = folder / file
    assert old in path.read_text()
    path.write_text(path.read_text().replace(old, new))


def lines_of(capsys):
    rows = [line.split("|")[1:-1] for line in capsys.readouterr().out.splitlines() if line.startswith("| ")]
    return {(row[0].strip(), row[1].strip()): [cell.strip() for cell in row[2:]] for row in rows}


# Breaks when equal results are refused, a table or a total is missing.
def test_same_results_pass(main, folders, capsys):
    assert main([*map(str, folders)]) == 0
    shown = lines_of(capsys)
    assert shown["steps", "wall coulomb 1e-4"] == ["2 s", "2 s", "1.00", "1.00"]
    assert shown["steps", "total"] == ["3 s", "3 s", "1.00", ""]
    assert shown["robots", "total"] == ["4e-05 s", "4e-05 s", "1.00", ""]
    assert shown["all", "total"] == ["", "", "1.000", ""]
    assert ("robots", "broken") not in shown


# Breaks when one entry of one table may become more than 1.1 times slower, or a slow one excuses itself with
# more iterations.
@pytest.mark.parametrize(
    ("file", "old", "new", "entry"),
    [
        ("steps.csv", "1.0,50", "1.12,50", ("steps", "heap coulomb 1e-4")),
        ("steps.csv", "1.0,50", "1.5,75", ("steps", "heap coulomb 1e-4")),
        ("robots.csv", "go1,3e-5", "go1,3.4e-5", ("robots", "go1")),
    ],
)
def test_slower_entry_is_told(main, folders, capsys, file, old, new, entry):
    change(folders[1], file, old, new)
    assert main([*map(str, folders), "--total", "10"]) == 1
    slow = [name for name, cells in lines_of(capsys).items() if "slower" in cells[2] and name[1] != "total"]
    assert slow == [entry]


# Breaks when the default limit is not 1.1, or `--limit` is not heard.
def test_limit(main, folders):
    change(folders[1], "steps.csv", "1.0,50", "1.09,50")
    change(folders[1], "robots.csv", "go1,3e-5", "go1,2e-5")
    assert main([*map(str, folders)]) == 0
    assert main([*map(str, folders), "--limit", "1.05"]) == 1


# Breaks when many entries may become a little slower.
def test_slower_total_is_told(main, folders, capsys):
    for old, new in (("2.0", "2.1"), ("1.0,50", "1.05,50")):
        change(folders[1], "steps.csv", old, new)
    assert main([*map(str, folders)]) == 1
    shown = lines_of(capsys)
    assert shown["all", "total"][2] == "1.025 slower"  # 1.05 ** (1 / 2)
    assert "slower" not in shown["steps", "total"][2]
    assert main([*map(str, folders), "--total", "1.03"]) == 0


# Breaks when an entry that does not end any more passes.
def test_entry_that_is_gone_is_told(main, folders, capsys):
    change(folders[1], "robots.csv", "a1,1e-5", "a1,")
    assert main([*map(str, folders)]) == 1
    shown = lines_of(capsys)
    assert shown["robots", "a1"] == ["1e-05 s", "gone", "", ""]
    assert shown["robots", "total"] == ["3e-05 s", "3e-05 s", "1.00", ""]


# Breaks when a table that one folder lacks is left out without a word, or two empty folders are equal.
def test_missing_tables(main, folders):
    (folders[1] / "robots.csv").unlink()
    with pytest.raises(FileNotFoundError, match=r"robots\.csv"):
        main([*map(str, folders)])
    for folder in folders:
        for file in folder.glob("*.csv"):
            file.unlink()
    with pytest.raises(SystemExit):
        main([*map(str, folders)])


# Breaks when a column of a committed table has another name than the comparison expects.
def test_committed_tables_are_read(main, root, capsys):
    results = str(root / "benchmarks" / "results" / "processor")
    assert main([results, results]) == 0
    parts = {part for part, name in lines_of(capsys) if name == "total"}
    tables = {"kernel", "files", "steps", "simulation", "robots", "robots_2ms"}
    assert parts == tables | {"all"}
