"""amontons stability: the verdict as a table, as JSON, as pictures and a page."""

import json

import pytest
from amontons import examples
from amontons.cli import app
from typer.testing import CliRunner

ARCH = str(examples.path("arch.obj"))


def run(*words):
    return CliRunner().invoke(app, ["stability", *words])


# Exit code 0 and the factor of the arch in JSON. Breaks if options do not reach the verdict.
def test_an_arch_stands_up_to_a_factor(tmp_path):
    shot, page = tmp_path / "arch.png", tmp_path / "arch.html"
    found = run(
        ARCH,
        "--horizontal",
        "x",
        "--tilt",
        "1,0",
        "--margin",
        "--json",
        "--picture",
        str(shot),
        "--report",
        str(page),
    )
    assert found.exit_code == 0, found.output
    facts = json.loads(found.stdout)
    assert facts["verdict"] == "stands"
    push, turn, friction = facts["factors"]
    assert push["lower"] == pytest.approx(0.2863, abs=2e-3)
    assert turn["lower"] == pytest.approx(15.97, abs=0.1)
    assert friction["upper"] < 0.55
    assert shot.read_bytes().startswith(b"\x89PNG")
    assert "stone" in page.read_text()
    assert "Assumptions" in page.read_text()


# Exit code 1, and a film, for blocks that fall. Breaks if the mechanism is lost.
def test_without_friction_it_falls(tmp_path):
    film = tmp_path / "arch.gif"
    found = run(ARCH, "--friction", "0.2", "--film", str(film))
    assert found.exit_code == 1
    assert "falls" in found.stdout
    assert film.read_bytes().startswith(b"GIF")


# Exit code 2 and one line for input that cannot be used.
@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["nothing.obj"], "nothing.obj"),
        ([ARCH, "--supports", "stone 99"], "there is no block 'stone 99'"),
        ([ARCH, "--horizontal", "up"], "write X,Y"),
        ([ARCH, "--point", "stone 1,0"], "BLOCK,FX,FY,FZ"),
        (["arch", "--unit", "mm"], "--unit is for drawings"),
    ],
)
def test_bad_input_ends_in_one_line(words, message):
    found = run(*words)
    assert found.exit_code == 2
    assert message in found.stderr


# A scene by its name. Breaks if models are taken for drawings.
def test_a_scene():
    assert run("arch").exit_code == 0
