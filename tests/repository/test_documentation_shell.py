"""What the documents type into a shell runs, and prints what they show."""

import shutil
from pathlib import Path

import amontons
import pytest
import shell_blocks
from amontons import cli, scenes
from typer.testing import CliRunner

ROOT = Path(__file__).resolve().parents[2]
DOCUMENTS = [
    page.relative_to(ROOT)
    for page in [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
    if shell_blocks.commands(page)
]
NEEDS = {"--usd": "pxr", "sweep": "pyarrow", ".xml": "mujoco"}


def without(listed, option):
    """The words without an option and its value."""
    at = listed.index(option)
    return listed[:at] + listed[at + 2 :]


# Breaks when the pattern no longer finds the commands, and so none is run.
def test_documents_have_commands():
    names = {page.stem for page in DOCUMENTS}
    assert names >= {"README", "cli", "five-minutes", "scenes", "studies", "viewer"}
    assert sum(command.shown is not None for command in shell_blocks.commands(ROOT / "docs/cli.md")) > 8


# Breaks when a command of a document fails, or prints something else than is shown below it.
@pytest.mark.parametrize("document", DOCUMENTS, ids=str)
def test_commands_run(tmp_path, monkeypatch, document):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MPLBACKEND", "Agg")
    shell_blocks.outline(tmp_path)
    simulation = amontons.Simulation(scenes.make("stack", boxes=2))
    with amontons.record("run.h5", simulation) as recorder:
        recorder.add(simulation.step())
    for command in shell_blocks.commands(ROOT / document):
        if command.elsewhere:
            continue
        listed = shell_blocks.words(command)
        for word, module in NEEDS.items():
            if word in command.text:
                pytest.importorskip(module)
        if "--mp4" in listed and shutil.which("ffmpeg") is None:
            listed = without(listed, "--mp4")
        assert listed[0] == "amontons", f"{document}: {command.text}: run it, or tell who does in ELSEWHERE"
        result = CliRunner().invoke(cli.app, listed[1:])
        assert command.shown is not None or result.exit_code in (0, 1), f"{command.text}: {result.output}"
        if command.shown is not None:
            faults = list(shell_blocks.faults(command, result.output.splitlines()))
            assert not faults, "\n".join([*faults, "renew: python tools/shell_blocks.py --write"])


# Breaks when what is printed may differ from what is shown in more than numbers.
def test_difference_is_found(tmp_path):
    page = tmp_path / "a.md"
    shown = "```\n$ amontons solve a.npz\na    1.0e-03\nb    2 ms\n```\n"
    page.write_text(f"{shown}```sh\namontons run wall # c\n```\n")
    typed, line = shell_blocks.commands(page)
    assert (typed.text, typed.shown) == ("amontons solve a.npz", ("a    1.0e-03", "b    2 ms"))
    assert (line.text, line.shown) == ("amontons run wall # c", None)
    assert list(shell_blocks.faults(typed, ["a 7", "", "b   3.5 ms"])) == []
    for printed in (["a 7"], ["a 7", "b 3 s"], ["a 7", "b 2 ms", "c"]):
        assert len(list(shell_blocks.faults(typed, printed))) == 1
    short = ["--duration", "1", *shell_blocks.SMALL["wall"]]
    assert shell_blocks.words(line) == ["amontons", "run", "wall", *short]
