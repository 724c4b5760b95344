"""Checks the documentation; prints every fault.

- Every relative link of a Markdown file leads to a file, every #fragment to a heading of it.
- The text of a link names what it leads to: no "here", no name of a file.
- Every public name has a docstring or a mention in backquotes in docs/, and every public method
  and property of its classes has a docstring or is named in that of the class.
- Every make target that a document names in code exists.
- Every command `amontons ...` exists, with the options that are given to it.
- Every source file that a document names in code, or a comment of a C++ source, exists (X is any name).
- Every public name is in the reference of the site.
- Equations are numbered in order, and every one that a source cites, as docs/algorithm.md (3), is there.
"""

import contextlib
import inspect
import re
import shlex
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
LINK = re.compile(r"!?\[[^\]]*\]\(\s*<?([^)\s>]+)>?[^)]*\)|^\[[^\]]+\]:\s*(\S+)", re.MULTILINE)
NAMELESS = re.compile(
    r"(?<!!)\[((?:this |that |the )?(?:page|table|guide|above|below|details|here|how|more|steps)"
    r"|[\w/-]+\.md)\]\(",
    re.IGNORECASE,
)
FENCE = re.compile(r"^(```+|~~~+).*?^\1\s*$", re.MULTILINE | re.DOTALL)
CODE = re.compile(r"`[^`\n]*`")
SOURCE = re.compile(r"(?<![\w./*-])(?:[\w-]+/)*[\w-]+(?:\.isa)?\.(?:cpp|hpp|py)\b")
CITATION = re.compile(r"docs/(\w+\.md)(?:\s|//)+\((\d+(?:,\s*\d+)*)\)")
BLOCK = re.compile(r"^```python[^\S\n]*\n(.*?)^```\s*$", re.MULTILINE | re.DOTALL)


def files(root: Path, *endings: str) -> list[Path]:
    """The files of the repository with these endings: those that git does not ignore."""
    command = ["git", "-C", str(root), "ls-files", "--cached", "--others", "--exclude-standard"]
    run = subprocess.run(command, capture_output=True, text=True)
    if run.returncode == 0:
        found = {root / name for name in run.stdout.splitlines()}
    else:
        ignored = {".venv", "build", "out"}
        found = {p for p in root.rglob("*") if not ignored & set(p.relative_to(root).parts)}
    return sorted(p for p in found if p.suffix in endings and p.is_file())


def documents(root: Path) -> list[Path]:
    return files(root, ".md")


def anchors(text: str) -> set[str]:
    """The fragments of the headings, made the way code hosting sites make them."""
    headings = re.findall(r"^#{1,6}\s+(.+?)\s*#*$", FENCE.sub("", text), re.MULTILINE)
    slugs = {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}
    return slugs | {f"eq-{number}" for number in numbers(text)}


def leads(fragment: str, text: str) -> bool:
    """Whether a page has a heading of this fragment, or an entry of the reference that it is a member of."""
    shown = re.findall(r"^::: (\S+)$", text, re.MULTILINE)
    return fragment in anchors(text) or fragment.rpartition(".")[0] in shown


def numbers(text: str) -> list[str]:
    """The numbers of the equations of a page, in order."""
    return [n for block in FENCE.finditer(text) for n in re.findall(r"\\tag\{(\w+)\}", block.group())]


def check_links(root: Path) -> Iterator[str]:
    for file in documents(root):
        text = file.read_text()
        for match in LINK.finditer(CODE.sub("", FENCE.sub("", text))):
            link = match.group(1) or match.group(2)
            if re.match(r"[a-z][a-z0-9+.-]*:", link):
                continue
            path, _, fragment = link.partition("#")
            target = (file.parent / path) if path else file
            if not target.exists():
                yield f"{file.relative_to(root)}: dead link {link}"
            elif fragment and target.suffix == ".md" and not leads(fragment, target.read_text()):
                yield f"{file.relative_to(root)}: no heading for {link}"


def check_link_texts(root: Path) -> Iterator[str]:
    for file in documents(root):
        for text in NAMELESS.findall(FENCE.sub("", file.read_text())):
            yield f"{file.relative_to(root)}: a link says '{text}'; name the page or heading that it leads to"


def has_docstring(thing: object) -> bool:
    # A dataclass or a bound function without a docstring is given its signature as one.
    doc = (inspect.getdoc(thing) or "").strip()
    return bool(doc) and not ("\n" not in doc and doc.startswith(f"{getattr(thing, '__name__', '')}("))


def public_names() -> dict[str, object]:
    """Every public name with what it names, those of the modules that hold the less common ones too."""
    import amontons
    import amontons.studies

    modules = (
        amontons, amontons.vi, amontons.parts, amontons.results, amontons.examples, amontons.studies
    )  # fmt: skip
    named = {f"{door.__name__}.{name}": getattr(door, name) for door in modules for name in door.__all__}
    return {name: thing for name, thing in named.items() if thing not in modules and "__" not in name}


def check_names(root: Path) -> Iterator[str]:
    mentioned = " ".join(" ".join(CODE.findall(p.read_text())) for p in sorted((root / "docs").rglob("*.md")))
    for name, thing in public_names().items():
        documented = re.search(rf"\b{re.escape(name.rpartition('.')[2])}\b", mentioned)
        if not documented and not (callable(thing) and has_docstring(thing)):
            yield f"{name}: neither a docstring nor mentioned in docs/"
        if not inspect.isclass(thing) or issubclass(thing, tuple):
            continue
        words = re.findall(r"\w+", thing.__doc__ or "")
        for attribute, value in vars(thing).items():
            public = not attribute.startswith("_") and (callable(value) or isinstance(value, property))
            if public and not has_docstring(value) and attribute not in words:
                yield f"{name}.{attribute}: no docstring"


def check_targets(root: Path) -> Iterator[str]:
    targets = set(re.findall(r"^([a-z_]+):", (root / "Makefile").read_text(), re.MULTILINE))
    for file in documents(root):
        text = file.read_text()
        fences = [match.group() for match in FENCE.finditer(text)]
        for code in CODE.findall(FENCE.sub("", text)) + fences:
            for target in re.findall(r"^`?make ([a-z_]+)", code, re.MULTILINE):
                if target not in targets:
                    yield f"{file.relative_to(root)}: make has no target {target}"


def commands(text: str) -> Iterator[list[str]]:
    """The words of what a document has typed behind `amontons`, in blocks and in code within a line."""
    lines = [line for match in FENCE.finditer(text) for line in match.group().splitlines()]
    lines += [code.strip("`") for code in CODE.findall(FENCE.sub("", text))]
    for line in lines:
        match = re.match(r"\s*(?:\$ )?(?:\.venv/bin/)?amontons (.+)", line)
        if match:
            with contextlib.suppress(ValueError):  # an apostrophe: a sentence, not a command
                yield shlex.split(match.group(1), comments=True)


def check_commands(root: Path) -> Iterator[str]:
    import typer
    from amontons.cli import app

    top = typer.main.get_command(app)
    for file in documents(root):
        for words in commands(file.read_text()):
            name, command = "", top
            while words and hasattr(command, "commands") and re.fullmatch(r"[a-z]+", words[0]):
                name, *words = words
                command = command.commands.get(name)
            if command is None:
                yield f"{file.relative_to(root)}: there is no command amontons {name}"
                continue
            try:
                command.make_parser(command.context_class(command)).parse_args(list(words))
            except typer.BadParameter.__base__ as error:  # Click's, of any kind
                option = getattr(error, "option_name", None)
                if type(error).__name__ == "NoSuchOption":
                    yield f"{file.relative_to(root)}: amontons {name} has no option {option}"


def check_files(root: Path) -> Iterator[str]:
    sources = ["/" + str(p.relative_to(root)) for p in files(root, ".cpp", ".hpp", ".py")]
    texts = [(p, CODE.findall(FENCE.sub("", p.read_text()))) for p in documents(root)]
    texts += [(p, re.findall(r"//.*", p.read_text())) for p in files(root, ".cpp", ".hpp")]
    for file, parts in texts:
        for name in {name for part in parts for name in SOURCE.findall(part)}:
            if not re.match(r"(.*/)?(test_)?X\.", name) and not any(s.endswith("/" + name) for s in sources):
                yield f"{file.relative_to(root)}: there is no file {name}"


def check_reference(root: Path) -> Iterator[str]:
    texts = [page.read_text() for page in (root / "docs" / "reference").glob("*.md")]
    shown = {name for text in texts for name in re.findall(r"^::: (amontons\S*)", text, re.MULTILINE)}
    public = {*public_names(), "amontons.gym"}
    for name in sorted(public - shown):
        yield f"{name}: not in the reference; add '::: {name}' to a page of docs/reference"
    for name in sorted(shown - public):
        yield f"docs/reference shows {name}, which is not public"


def check_equations(root: Path) -> Iterator[str]:
    for page in documents(root):
        found = numbers(page.read_text())
        if found != [str(k + 1) for k in range(len(found))]:
            yield f"{page.relative_to(root)}: equations are numbered {', '.join(found)}"
    for file in files(root, ".cpp", ".hpp", ".py", ".md"):
        if file.relative_to(root).parts[0] in {"tests", "tools"}:  # they speak of citations
            continue
        for name, cited in CITATION.findall(file.read_text()):
            page = root / "docs" / name
            known = numbers(page.read_text()) if page.exists() else []
            for number in re.split(r",\s*", cited):
                if number not in known:
                    yield f"{file.relative_to(root)}: there is no equation ({number}) in docs/{name}"


def python_blocks(file: Path) -> list[tuple[int, str]]:
    """(line, source) of the fenced Python blocks of a Markdown file."""
    text = file.read_text()
    return [(text.count("\n", 0, m.start(1)) + 1, m.group(1)) for m in BLOCK.finditer(text)]


def faults(root: Path) -> list[str]:
    checks = (
        check_links,
        check_link_texts,
        check_targets,
        check_commands,
        check_files,
        check_names,
        check_reference,
        check_equations,
    )
    return [fault for check in checks for fault in check(root)]


if __name__ == "__main__":
    found = faults(ROOT)
    print("\n".join(found) if found else "documentation holds")
    sys.exit(bool(found))
