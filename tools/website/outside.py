"""Files outside docs/ as pages of the site: those that a page links to, and those that these link to.

A Markdown file is shown as it is, a source as a block of code, a folder by its README or as a list of files.
The page of the file at PATH is source/PATH, with `.md` behind it where it is not Markdown.
"""

import ast
import posixpath
import re
from collections.abc import Callable
from pathlib import Path

LANGUAGES = {".py": "python", ".cpp": "cpp", ".hpp": "cpp", ".xml": "xml", ".urdf": "xml", ".toml": "toml"}
LINK = re.compile(r"(?P<before>!?\[[^\]]*\]\(\s*<?)(?P<target>[^)\s>#]+)(?P<after>[^)]*\))")
# At the head of a source, which would hide pages in the results of a search.
UNSEARCHED = "---\nsearch:\n  exclude: true\n---\n\n"
# Fenced blocks and code in a line, where what looks like a link is none.
CODE = re.compile(r"^(```+|~~~+).*?^\1\s*$|`[^`\n]*`", re.MULTILINE | re.DOTALL)
URL = re.compile(r"[a-z][a-z0-9+.-]*:|/")


def change_links(text: str, change: Callable[[str], str]) -> str:
    """The text with the target of every link (without its fragment) changed, code left alone."""

    def replace(match: re.Match[str]) -> str:
        target = match["target"]
        return match["before"] + (target if URL.match(target) else change(target)) + match["after"]

    parts, end = [], 0
    for code in CODE.finditer(text):
        parts += [LINK.sub(replace, text[end : code.start()]), code.group()]
        end = code.end()
    return "".join([*parts, LINK.sub(replace, text[end:])])


def uri_of(root: Path, file: Path) -> str:
    """Where the site has a file of the repository."""
    if file.is_relative_to(root / "docs") or file.suffix in {".png", ".svg", ".webp", ".gif"}:
        return posixpath.relpath(file, root / "docs")
    if file.is_dir():
        readme = file / "README.md"
        return uri_of(root, readme) if readme.exists() else f"source/{file.relative_to(root)}/index.md"
    name = f"source/{file.relative_to(root)}"
    return name if file.suffix == ".md" else name + ".md"


def file_of(root: Path, uri: str) -> Path:
    """The file of the repository that a page shows; the inverse of `uri_of`."""
    if not uri.startswith("source/"):
        return root / "docs" / uri
    path = root / uri.removeprefix("source/")
    if path.exists():
        return path
    return path.parent if path.name == "index.md" else path.with_suffix("")


def links_of_the_site(root: Path, uri: str, text: str) -> str:
    """The text of a page with its links between files made links between pages."""
    file = file_of(root, uri)
    folder = file if file.is_dir() else file.parent

    def change(target: str) -> str:
        there = Path(posixpath.normpath(folder / target))
        if not there.exists() or not there.is_relative_to(root):
            return target  # MkDocs says that it is dead
        return posixpath.relpath(uri_of(root, there), posixpath.dirname(uri) or ".")

    return change_links(text, change)


def first_sentence(file: Path) -> str:
    if file.suffix != ".py":
        return ""
    return (ast.get_docstring(ast.parse(file.read_text())) or "").split("\n")[0]


def text_of(file: Path, name: str) -> str:
    if file.is_dir():
        rows = [f"- [{p.name}]({p.name}) {first_sentence(p)}" for p in sorted(file.iterdir()) if p.is_file()]
        return f"# {name.capitalize()}\n\n" + "\n".join(rows) + "\n"
    if file.suffix == ".md":
        return file.read_text()
    language = LANGUAGES.get(file.suffix, "text")
    return f"{UNSEARCHED}# {name}\n\n````{language}\n{file.read_text()}````\n"


def pages(root: Path) -> dict[str, str]:
    """Page by page what the site needs from outside docs/."""
    found: dict[str, str] = {}
    wanted = [
        root / name
        for name in ("ARCHITECTURE.md", "CONTRIBUTING.md", "SECURITY.md", "CHANGELOG.md", "examples")
    ]
    texts = [(file.parent, file.read_text()) for file in (root / "docs").rglob("*.md")]

    def want(folder: Path, text: str) -> None:
        def note(target: str) -> str:
            there = Path(posixpath.normpath(folder / target))
            if there.exists() and uri_of(root, there).startswith("source/"):
                wanted.append(there)
            return target

        change_links(text, note)

    for folder, text in texts:
        want(folder, text)
    while wanted:
        file = wanted.pop()
        uri = uri_of(root, file)
        file = file_of(root, uri)
        if uri in found:
            continue
        found[uri] = text_of(file, str(file.relative_to(root)))
        if file.suffix == ".md" or file.is_dir():
            want(file if file.is_dir() else file.parent, found[uri])
    return found
