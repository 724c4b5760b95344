"""The tutorials as Jupyter notebooks: python tools/website/notebooks.py [FOLDER], by default out/notebooks.

Each page of docs/tutorials (and docs/five-minutes.md, docs/studies.md) becomes a notebook: its text in cells
of Markdown, its Python blocks in cells of code, nothing else; the page is the one source.
"""

import json
import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
BLOCK = re.compile(r"^```python[^\S\n]*\n(.*?)^```[^\S\n]*\n?", re.MULTILINE | re.DOTALL)
# Links between pages lead nowhere from a notebook; their words stay.
RELATIVE = re.compile(r"(?<!!)\[([^\]]*)\]\((?![a-z]+:)[^)]*\)")
# What a page calls -> the module that it needs, the extra that installs it.
NEEDS = {
    "load_model(": ("mujoco", "models"),
    "sweep(": ("loky", "studies"),
    "matplotlib": ("matplotlib", "cli"),
}
CHECK = """\
from importlib.util import find_spec

needed = {needed}
if not all(map(find_spec, needed)):
    raise ImportError('{remedy}')
"""


def check(text: str) -> str:
    """The first cell of a notebook: it says what is missing."""
    code = "".join(BLOCK.findall(text))
    needs = dict(need for call, need in NEEDS.items() if call in code)
    extras = f"[{','.join(needs.values())}]" if needs else ""
    return CHECK.format(needed=["amontons", *needs], remedy=f'pip install "amontons{extras}"')


def pages(root: Path = ROOT) -> list[Path]:
    tutorials = sorted((root / "docs" / "tutorials").glob("*.md"))
    found = [root / "docs" / "five-minutes.md", *tutorials, root / "docs" / "studies.md"]
    return [page for page in found if BLOCK.search(page.read_text())]


def cell(kind: str, text: str, number: int) -> dict[str, object]:
    body: dict[str, object] = {"cell_type": kind, "id": f"cell-{number}", "metadata": {}}
    body["source"] = text.strip("\n").splitlines(keepends=True)
    return body | ({"execution_count": None, "outputs": []} if kind == "code" else {})


def notebook(text: str) -> dict[str, object]:
    """The notebook of a page, in format 4.5."""
    parts: list[tuple[str, str]] = []
    end = 0
    for block in BLOCK.finditer(text):
        parts += [("markdown", RELATIVE.sub(r"\1", text[end : block.start()])), ("code", block.group(1))]
        end = block.end()
    parts.append(("markdown", RELATIVE.sub(r"\1", text[end:])))
    parts.insert(1, ("code", check(text)))
    cells = [cell(kind, body, k) for k, (kind, body) in enumerate(parts) if body.strip()]
    kernel = {"display_name": "Python 3", "language": "python", "name": "python3"}
    return {"cells": cells, "metadata": {"kernelspec": kernel}, "nbformat": 4, "nbformat_minor": 5}


def as_text(page: Path) -> str:
    return json.dumps(notebook(page.read_text()), indent=1, ensure_ascii=False) + "\n"


def main(folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    for page in pages():
        path = folder / f"{page.stem}.ipynb"
        path.write_text(as_text(page))
        print(path)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "out" / "notebooks")
