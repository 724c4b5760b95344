"""The tutorials as notebooks: what they hold, and that they run from a clean kernel."""

import json
import re

import notebooks
import pytest

PAGES = notebooks.pages()


# Breaks when a cell is lost or changed on the way from a page to its notebook.
def test_notebook_holds_the_page():
    text = "# Title\nSee [this](../that.md) and [there](https://x.org).\n```python\na = 1\n```\n"
    text += "\nEnd\n```sh\nls\n```\n"
    cells = notebooks.notebook(text)["cells"]
    assert [c["cell_type"] for c in cells] == ["markdown", "code", "code", "markdown"]
    assert "".join(cells[0]["source"]) == "# Title\nSee this and [there](https://x.org)."
    assert "".join(cells[2]["source"]) == "a = 1"
    assert "```sh\nls\n```" in "".join(cells[3]["source"])


# Breaks when a notebook is no valid one, or does not run from a clean kernel outside the repository.
@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_notebook_runs(tmp_path, page):
    nbformat = pytest.importorskip("nbformat", reason="pip install amontons[docs]")
    nbclient = pytest.importorskip("nbclient", reason="pip install amontons[docs]")
    pytest.importorskip("ipykernel", reason="pip install amontons[docs]")
    if "load_model" in page.read_text():
        pytest.importorskip("mujoco")
    if page.stem == "studies":
        pytest.importorskip("loky")
        pytest.importorskip("pyarrow")
    book = nbformat.reads(json.dumps(notebooks.notebook(page.read_text())), as_version=4)
    nbformat.validate(book)
    nbclient.NotebookClient(book, timeout=300, resources={"metadata": {"path": str(tmp_path)}}).execute()
    assert all(cell.execution_count for cell in book.cells if cell.cell_type == "code")


# Breaks when a notebook that lacks a package says something else than the command that installs it.
def test_notebook_says_what_is_missing(monkeypatch):
    check = notebooks.check("```python\nmodel = amontons.load_model(a)\nimport matplotlib\n```\n")
    exec(check, {})
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None if name == "mujoco" else name)
    with pytest.raises(ImportError, match=re.escape('pip install "amontons[models,cli]"')):
        exec(check, {})


# Breaks when the pages that should become notebooks are no longer found.
def test_tutorials_are_found():
    assert {"five-minutes", "robots", "first_scene", "own_solver"} <= {page.stem for page in PAGES}
