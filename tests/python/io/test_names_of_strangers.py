"""Names that strangers gave to bodies, files and models: they are shown, and do nothing."""

import csv
import os
import pty
import shutil
import subprocess
import sys
import warnings

import amontons
import pytest
from amontons import ModelBuilder, Simulation, cli, shapes
from amontons.escapes import visible
from amontons.viewer.events import literal
from typer.testing import CliRunner
from waiting import LONGEST

ESCAPE = "\x1b[31m"
AMONTONS = [sys.executable, "-m", "amontons"]


def run(*arguments):
    return CliRunner().invoke(cli.app, [*map(str, arguments)])


# Breaks when a character that a terminal obeys passes, one that it shows does not, or what was escaped is
# escaped again.
def test_visible():
    assert visible("Räder 車輪 \U0001f6de, x'\"\\[b]") == "Räder 車輪 \U0001f6de, x'\"\\[b]"
    assert visible("a\x1b[31m\r\n\t\x07\x9b\x7f") == r"a\x1b[31m\x0d\x0a\x09\x07\x9b\x7f"
    assert visible("a\u202eb\u2066\u2028") == r"a\u202eb\u2066\u2028"
    assert visible(os.fsdecode(b"a\xff")) == r"a\xff"
    assert visible("a\nb\x1b", "\n") == "a\nb\\x1b"
    assert visible(visible("\x1b")) == visible("\x1b")


# Breaks when the message of an error, or a warning, hands the name of a body or a file to the terminal as it
# is: those of Python, of the core in C++, and of a model's list of what is not read.
def test_messages_and_warnings(tmp_path):
    builder = ModelBuilder()
    builder.add_body(f"a{ESCAPE}\u202e", shape=shapes.Sphere(1), density=1)
    messages = []
    for act in (
        lambda: builder.add_body(f"b{ESCAPE}\n", mass=-1),
        lambda: builder.build().body_index(f"c{ESCAPE}"),
        lambda: amontons.vi.read_problem(tmp_path / f"d{ESCAPE}.hdf5"),
        lambda: amontons.read_recording(tmp_path / f"e{ESCAPE}.h5"),
        lambda: amontons.load_model(tmp_path / f"f{ESCAPE}.xml"),
        lambda: Simulation(builder.build(), method=f"g{ESCAPE}"),
    ):
        with pytest.raises((amontons.InputError, OSError)) as caught:
            act()
        messages.append(str(caught.value))
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        amontons.errors.ModelWarning(ESCAPE)
        warnings.warn(f"model {ESCAPE}", amontons.ModelWarning, stacklevel=1)
    messages.append(str(told[0].message))
    assert all("\x1b" not in message and "\\x1b[31m" in message for message in messages), messages


# Breaks when brackets in the name of a file are read as markup, or escapes and bytes that are no UTF-8 in it
# reach the terminal, or end a command with a traceback: in tables, notes, errors and JSON.
def test_names_of_files(tmp_path, root):
    names = ["data[v2].hdf5", "[red]x.hdf5", f"e{ESCAPE}.hdf5", os.fsdecode(b"b\xff.hdf5")]
    for name in names:
        shutil.copy(root / "examples/problems/wall_impact.hdf5", tmp_path / name)
    for command in (
        ["solve", *names, "--max-iterations", "2"],
        ["solve", *names, "--json", "--max-iterations", "2"],
        ["info", names[3]],
        ["compare", names[2], names[3], "--methods", "apgd", "--deadline", "1"],
        ["solve", f"none{ESCAPE}[x].hdf5", os.fsdecode(b"none\xff.hdf5")],
        ["run", os.fsdecode(b"none\xff.xml")],
        ["run", "stack", "--duration", "0.01", "--record", os.fsdecode(b"r\xff\x1b.h5")],
        ["export", os.fsdecode(b"r\xff\x1b.h5"), "--csv", os.fsdecode(b"r\xff.csv")],
    ):
        result = subprocess.run([*AMONTONS, *command], cwd=tmp_path, capture_output=True, timeout=LONGEST)
        said = result.stdout + result.stderr
        assert b"Traceback" not in said, said
        assert b"\x1b" not in said
        assert b"\xff" not in said
        if command == ["solve", *names, "--max-iterations", "2"]:
            for shown in (b"data[v2].hdf5", b"[red]x.hdf5", rb"e\x1b[31m.hdf5", rb"b\xff.hdf5"):
                assert shown in said


# Breaks when the description of a progress bar is the name of a file as it is: on a terminal, whose own
# escapes are allowed and this one is not.
def test_progress_bars(tmp_path, root):
    path = tmp_path / f"p{ESCAPE}7m[b]q.hdf5"
    shutil.copy(root / "examples/problems/wall_impact.hdf5", path)
    ours, theirs = pty.openpty()
    command = [*AMONTONS, "solve", str(path), str(path), "--max-iterations", "20"]
    process = subprocess.Popen(command, stdout=theirs, stderr=theirs, stdin=theirs)
    os.close(theirs)
    said = b""
    while True:
        try:
            part = os.read(ours, 65536)
        except OSError:  # the other end was closed
            break
        if not part:
            break
        said += part
    process.wait()
    os.close(ours)
    assert b"p\x1b[31m" not in said
    assert rb"p\x1b[31m7m[b]q" in said


# Breaks when a cell of a table begins what a program of tables would compute, or a negative number becomes a
# text.
def test_cells_are_no_formulas(tmp_path):
    builder = ModelBuilder()
    for k, name in enumerate(("=1+1", "+x", "-x", "@x", f"={ESCAPE}", "plain", "-5")):
        position = (-1.5 * k, 0, 0)
        builder.add_body(name, shape=shapes.Sphere(0.1), density=1, position=position)
    sim = Simulation(builder.build())
    with amontons.record(tmp_path / "a.h5", sim) as recorder:
        recorder.add(sim.step())
    result = run("export", tmp_path / "a.h5", "--csv", tmp_path / "a.csv")
    assert result.exit_code == 0, result.output
    data = (tmp_path / "a.csv").read_bytes()
    assert b"\x1b" not in data
    header, *rows = csv.reader(data.decode().splitlines())
    names = [column.removesuffix(".x") for column in header if column.endswith(".x")]
    assert names == ["'=1+1", "'+x", "'-x", "'@x", r"'=\x1b[31m", "plain", "'-5"]
    assert float(rows[0][header.index("'+x.x")]) == -1.5
    assert rows[0][header.index("'+x.x")].startswith("-")

    from amontons.report.complete_files import csv_bytes

    table = csv_bytes(["=a", "b"], [["=HYPERLINK()", -1.0], ["-1e-3", "@x"], ["-inf", "+"]]).decode()
    assert table == "'=a,b\n'=HYPERLINK(),-1.0\n-1e-3,'@x\n'-inf,'+\n"


# Breaks when dollars in the name of a file are a formula of a figure, which may be none.
def test_names_in_figures(tmp_path, root):
    path = tmp_path / r"$\bad{$ [x].hdf5"
    shutil.copy(root / "examples/problems/wall_impact.hdf5", path)
    result = run("compare", path, "--methods", "apgd", "--deadline", 1, "--out", tmp_path / "out")
    assert result.exit_code in (0, 1), result.output
    assert (tmp_path / "out" / "convergence.png").exists()


# Breaks when a command ends with a traceback because standard output is closed, full, or read by nobody.
@pytest.mark.parametrize(
    ("end", "code"), [(">&-", 0), ("> /dev/full", 1), (">&- 2>&-", 0), ("2> /dev/full", 0), ("| true", 0)]
)
@pytest.mark.parametrize("command", ["scenes", "scenes --json", "run stack --duration 0.01"])
def test_no_output(tmp_path, command, end, code):
    line = f"{sys.executable} -m amontons {command} {end}"
    result = subprocess.run(["bash", "-c", line], cwd=tmp_path, capture_output=True, text=True)
    assert "Traceback" not in result.stderr
    assert "Exception" not in result.stderr
    assert result.returncode == code
    if code:
        assert "nothing more can be printed" in result.stderr


# Breaks when the name of a body leaves the code of Markdown that it is put into: its fence is longer than any
# run of backticks within.
@pytest.mark.parametrize("name", ["plain", "a`b", "`", "``x```", " x", "<b>", "x\n\n# y", "", "\ud800"])
def test_names_in_markdown(name):
    text = literal(name)
    fence = text[: len(text) - len(text.lstrip("`"))]
    inside = text[len(fence) : -len(fence)]
    assert text.endswith(fence)
    assert fence not in inside
    assert inside.strip(" ") == visible(name).strip(" ")
    assert "\n" not in text
    text.encode()
