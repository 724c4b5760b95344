"""Tables of benchmarks carry the revision, the date, the command and the processor of their run."""

import csv
import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
TABLES = ROOT / "benchmarks" / "results" / "processor" / "tables.csv"


def rows(path):
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def run(code, *words):
    paths = [str(ROOT / "benchmarks"), str(ROOT / "tools")]
    program = f"import sys; sys.path[:0] = {paths!r}\n{code}"
    return subprocess.run([sys.executable, "-c", program, *words], capture_output=True, text=True)


# Breaks when a benchmark writes a table past write_csv, when a second table drops the first one from
# tables.csv, or when a folder of the machine gets into the committed command.
def test_a_table_is_written_with_its_origin(tmp_path):
    code = (
        "from pathlib import Path; from common import write_csv; sys.argv[0] = 'x/growth.py'\n"
        f"for name in 'ba': write_csv(Path({str(tmp_path)!r}) / f'{{name}}.csv', [dict(x=1.5)])"
    )
    done = run(code, "--quick", "--out", str(tmp_path))
    assert done.returncode == 0, done.stderr
    found = rows(tmp_path / "tables.csv")
    assert [row["table"] for row in found] == ["a.csv", "b.csv"]
    assert {row["command"] for row in found} == {"python benchmarks/growth.py --quick"}
    assert all(row["revision"] and row["date"] and row["processor"] for row in found)


# Breaks when a committed table loses its line, or the line outlives the table.
def test_committed_tables_are_listed():
    named = {path.name for path in TABLES.parent.glob("*.csv")} - {"tables.csv", "soak.csv"}
    assert {row["table"] for row in rows(TABLES)} == named


# Breaks when a table that compares methods or engines begins with other columns than the views read.
def test_tables_of_methods_begin_alike():
    of_one_form = ("steps", "methods", "files", "clarabel", "profile", "growth", "simulation")
    beside = TABLES.parents[1] / "beside"
    for path in [TABLES.with_name(f"{name}.csv") for name in of_one_form] + [*beside.glob("[!t]*.csv")]:
        assert list(rows(path)[0])[:4] == ["task", "method", "time", "error"], path.name


# Breaks when a table is kept that no part of `make bench` renews, or its line names another program.
def test_every_table_has_its_part():
    done = run("import run_all; sys.argv[1:] = ['--list']; run_all.main()")
    assert done.returncode == 0, done.stderr
    renewed = {name for line in done.stdout.splitlines() for name in re.findall(r"(\w+\.csv)", line)}
    for folder in (TABLES.parent, TABLES.parents[1] / "beside"):
        for row in rows(folder / "tables.csv"):
            assert row["table"] in renewed | {"environment.csv"}
            program = re.search(r"benchmarks/(\w+\.py)|-m (\w+)", row["command"])
            assert program
            assert (ROOT / "benchmarks" / (program[1] or program[2])).exists()


# Breaks when a part that fails, or takes too long, ends the run, or is not named.
def test_a_part_that_fails_does_not_end_the_run(tmp_path):
    code = (
        "import run_all\n"
        "part = lambda name, *words, limit=1.0: run_all.Part(name, words, (), limit)\n"
        "run_all.PARTS = (part('late', '-c', 'import time; time.sleep(60)', limit=0.01),\n"
        "    part('bad', '-c', 'raise SystemExit(3)'), part('good', '-c', 'print(1)'))\n"
        "sys.exit(run_all.main())"
    )
    done = run(code, "--quick", "--out", str(tmp_path), "--skip", "none")
    assert "invalid choice" in done.stderr
    done = run(code, "--quick", "--out", str(tmp_path))
    assert done.returncode == 1, done.stderr
    failed = [line for line in done.stdout.splitlines() if line.startswith("FAILED")]
    assert [line.split()[1] for line in failed] == ["late", "bad"]


# Breaks when the check passes a table that was measured before the last change of the step or by another
# processor, or refuses one that was measured after it, or before a comment came.
def test_older_tables_are_found(tmp_path):
    def git(*words):
        who = ["-c", "user.name=x", "-c", "user.email=x@example.org"]
        done = subprocess.run(["git", "-C", str(tmp_path), *who, *words], capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        return done.stdout.strip()

    def commit(file, text="int a;"):
        (tmp_path / file).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / file).write_text(text)
        git("add", "."), git("commit", "-m", file)
        return git("rev-parse", "--short", "HEAD")

    git("init")
    before, after = commit("src/solvers/a.cpp"), commit("src/multibody/b.cpp")
    later = commit("docs/c.md")
    commit("src/solvers/a.cpp", "int  a;  // one")
    lines = [f"{name}.csv,{name},2026-01-01,python x.py,one" for name in (before, f"{after}+", later)]
    lines += [f"{name}.csv,{later},2026-01-01,python x.py,{name}" for name in ("one", "other")]
    lines += [f"environment.csv,{later},2026-01-01,python x.py,one"]
    (tmp_path / "tables.csv").write_text("\n".join(["table,revision,date,command,processor", *lines, ""]))
    folder = repr(str(tmp_path))
    done = run(f"import check_tables; check_tables.ROOT = {folder}; sys.exit(check_tables.main([{folder}]))")
    assert done.returncode == 1, done.stderr
    found = [line.split(":")[0].split("/")[1] for line in done.stdout.splitlines() if "/" in line]
    assert found == [f"{before}.csv", "other.csv"]
