"""The documents: links, public names, code blocks; the examples; and that the checker sees faults."""

import operator
import os
import re
import runpy
import sys
from importlib.util import find_spec
from pathlib import Path

import amontons
import check_docs
import gallery
import notebooks
import pytest
import recipes
from amontons import scenes

ROOT = Path(__file__).resolve().parents[2]
EXAMPLES = sorted([*(ROOT / "examples").glob("*.py"), *(ROOT / "examples" / "first_hour").glob("*.py")])
# All that have Python blocks.
DOCUMENTS = [
    page.relative_to(ROOT)
    for page in [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
    if check_docs.python_blocks(page)
]
# The pages of notebooks run as such (test_notebooks.py), where there is a kernel.
NOTEBOOKS = {page.relative_to(ROOT) for page in notebooks.pages()}
HERE = [
    page
    for page in DOCUMENTS
    if page not in NOTEBOOKS or not (find_spec("nbclient") and find_spec("ipykernel"))
]
# Those that must, so that a slip of the pattern does not go unseen.
ESSENTIAL = {
    "README.md",
    "docs/simulation.md",
    "docs/contacts.md",
    "docs/joints.md",
    "docs/state.md",
    "docs/physics.md",
    "docs/python.md",
    "docs/tutorials/robots.md",
}


# Breaks when a link dies, a public name loses its documentation, or a named make target is gone.
def test_documentation_holds(root):
    assert check_docs.faults(root) == []


# Breaks when the blocks of a document are no longer found, and so no longer run.
def test_documents_have_blocks():
    assert {str(page) for page in DOCUMENTS} >= ESSENTIAL


# Breaks when an example of a document no longer runs. Its blocks share one namespace, in order.
@pytest.mark.parametrize("document", HERE, ids=str)
def test_blocks_run(root, tmp_path, monkeypatch, document):
    monkeypatch.setenv("MPLBACKEND", "Agg")
    # Examples name files relative to the repository and write beside them: run them in a copy of its outline.
    for name in ("examples", "docs", "benchmarks"):
        if (root / name).exists():
            (tmp_path / name).symlink_to(root / name)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", list(sys.path))
    if "AMONTONS_DATA" not in os.environ:
        monkeypatch.setenv("AMONTONS_DATA", str(root.parent / "shared" / "data"))
    namespace = {"__name__": "document"}
    blocks = check_docs.python_blocks(root / document)
    assert blocks
    for line, source in blocks:
        # Blank lines in front give a failure the line numbers of the document.
        exec(compile("\n" * (line - 1) + source, str(root / document), "exec"), namespace)


# Breaks when an example no longer runs, or grows beyond what one reads at a glance.
@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.stem)
@pytest.mark.filterwarnings("error::amontons.StepWarning")
def test_example_runs(tmp_path, monkeypatch, capsys, example):
    if "load_model" in example.read_text():
        pytest.importorskip("mujoco")
    if "sweep(" in example.read_text():
        pytest.importorskip("pyarrow")
        monkeypatch.setenv("MPLBACKEND", "Agg")
    monkeypatch.chdir(tmp_path)
    runpy.run_path(str(example), run_name="__main__")
    assert capsys.readouterr().out
    assert len(example.read_text().splitlines()) < 60


# Breaks when a recipe misses its closed form, no longer runs, or has no picture.
@pytest.mark.parametrize("name", recipes.EYES)
def test_recipe_runs(monkeypatch, capsys, name):
    program = recipes.FOLDER / f"{name}.py"
    if name in recipes.DECOMPOSED:
        pytest.importorskip("coacd")
    monkeypatch.syspath_prepend(str(recipes.FOLDER))
    runpy.run_path(str(program), run_name="__main__")
    assert capsys.readouterr().out
    assert len(program.read_text().splitlines()) < 60
    assert (recipes.PICTURES / f"{name}.png").exists()


# Breaks when a program is added to the recipes and not to the gallery.
def test_recipes_are_all_listed():
    assert {p.stem for p in recipes.FOLDER.glob("*.py")} - {"solids"} == set(recipes.EYES)


def faults_of(root):
    checks = (
        check_docs.check_links,
        check_docs.check_link_texts,
        check_docs.check_targets,
        check_docs.check_commands,
        check_docs.check_files,
        check_docs.check_equations,
    )
    return [fault for check in checks for fault in check(root)]


# Breaks when a scene is missing in the gallery, or the page is not what the tool makes of scenes and recipes.
def test_gallery_shows_every_scene(root):
    assert set(gallery.MOMENTS) == set(scenes.names())
    assert gallery.PAGE.read_text() == gallery.page()
    assert all((gallery.PICTURES / f"{name}.png").exists() for name in [*scenes.names(), gallery.MASONRY])


# Breaks when a checker misses a fault: then the first test proves nothing.
@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("[a](gone.md)", "dead link gone.md"),
        ("![figure](docs/gone.png)", "dead link docs/gone.png"),
        ("[a](#nowhere)\n# Here", "no heading for #nowhere"),
        ("[a]: gone.md", "dead link gone.md"),
        ("[A.md](A.md)", "a link says 'A.md'"),
        ("[This page](A.md)", "a link says 'This page'"),
        ("run `make nothing`", "make has no target nothing"),
        ("```sh\nmake nothing\n```", "make has no target nothing"),
        ("```sh\namontons nothing x\n```", "there is no command amontons nothing"),
        ("run `amontons run wall --nothing 3`", "amontons run has no option --nothing"),
        ("```\n$ amontons compare --nothing\n```", "amontons compare has no option --nothing"),
        ("see `src/gone.cpp`", "there is no file src/gone.cpp"),
        ("```math\nx \\tag{2}\n```", "equations are numbered 2"),
        ("as in docs/algorithm.md (7)", "no equation (7) in docs/algorithm.md"),
    ],
)
def test_fault_is_found(tmp_path, text, fault):
    (tmp_path / "Makefile").write_text("demo: install\n")
    (tmp_path / "A.md").write_text(text)
    found = faults_of(tmp_path)
    assert any(fault in line for line in found), found


# Breaks when the checker refuses good documents.
def test_good_document_passes(tmp_path):
    (tmp_path / "Makefile").write_text("demo: install\n")
    (tmp_path / "A.md").write_text(
        "# What it is, in short\n[a](#what-it-is-in-short) [b](https://example.org/x) [c](A.md) `[d](gone)`\n"
        "```\n[e](gone)\nmake demo\n```\n"
    )
    (tmp_path / "lib").mkdir()
    (tmp_path / "lib" / "a.cpp").write_text("// As lib/a.cpp; a/b.cppx\n")
    assert faults_of(tmp_path) == []


# Breaks when comments may go on naming a file that was moved.
def test_comment_names_a_file_that_exists(tmp_path):
    (tmp_path / "Makefile").write_text("demo: install\n")
    (tmp_path / "a.cpp").write_text('#include "b.hpp"\nint x;  // see lib/gone.isa.cpp and X.hpp\n')
    assert faults_of(tmp_path) == ["a.cpp: there is no file lib/gone.isa.cpp"]


# Breaks when equations that exist may not be cited.
def test_equation_is_cited(tmp_path):
    (tmp_path / "Makefile").write_text("")
    (tmp_path / "docs").mkdir()
    (tmp_path / "docs" / "a.md").write_text("```math\nx \\tag{1}\n```\n[(1)](#eq-1)\n")
    (tmp_path / "a.cpp").write_text("// docs/a.md (1)\n")
    assert faults_of(tmp_path) == []


# Breaks when the page on security forgets a kind of file that is read, or a page where it matters does not
# lead to it: which files of strangers are data and which are programs.
def test_security_page_names_all_files(root):
    page = (root / "SECURITY.md").read_text()
    for kind in (
        "FCLIB",
        ".npz",
        ".mtx",
        "MJCF",
        "URDF",
        ".parquet",
        ".toml",
        "pickle",
        "recordings",
        "Callbacks",
    ):
        assert kind in page, kind
    for name in ("README.md", "docs/studies.md", "docs/state.md", "docs/models.md"):
        assert "SECURITY.md" in (root / name).read_text(), name
    assert "## Report a problem" in page


# Breaks when a member of a simulation is missing in the tables by topic, or a row names what is gone.
@pytest.mark.parametrize("name", ["Simulation", "results.Kinematics", "results.Forces"])
def test_members_are_listed_by_topic(root, name):
    page = (root / "docs" / "reference" / "simulation.md").read_text()
    listed = re.findall(rf"\(#amontons\.{re.escape(name)}\.(\w+)\)", page)
    owner = operator.attrgetter(name)(amontons)
    made = {"before_step", "after_step"} if name == "Simulation" else set()  # in its constructor
    assert sorted(listed) == sorted(made | {n for n in dir(owner) if not n.startswith("_")})
