"""The reference of the C++ library, made from its public headers: a page per layer, a section per header.

The headers are parsed by cxxheaderparser; the comment above a declaration, or behind it, is its text. What is
private or in a namespace `detail` is left out.
"""

import re
import textwrap
from collections.abc import Iterator
from itertools import groupby
from pathlib import Path
from typing import Any

from cxxheaderparser.simple import ClassScope, NamespaceScope, parse_string

LAYERS = ("base", "sets", "problem", "solvers", "collision", "multibody", "picture")
DIRECTIVE = re.compile(r"^[ \t]*#(?!include)(?:[^\n]*\\\n)*[^\n]*$", re.MULTILINE)


def marked(text: str) -> str:
    """The header as the parser wants it: comments marked as documentation, no directives but #include."""
    text = DIRECTIVE.sub("", text)
    text = re.sub(r"^([ \t]*)//(?!/)", r"\1///", text, flags=re.MULTILINE)
    return re.sub(r"^([ \t]*[^\s/\"][^\n/\"]*)//(?!/)", r"\1///<", text, flags=re.MULTILINE)


def words(doxygen: str | None) -> str:
    """The text of a comment."""
    lines = [re.sub(r"^\s*///?<? ?", "", line) for line in (doxygen or "").splitlines()]
    return "\n".join(lines).strip()


def escaped(text: str) -> str:
    """A comment as Markdown: nothing in it is markup; what is indented stays as it is."""
    special = re.compile(r"([\\`*_\[\]#])")
    parts = []
    for indented, lines in groupby(text.splitlines(), key=lambda line: line.startswith("  ")):
        body = "\n".join(lines)
        if indented:
            parts.append(f"\n```text\n{textwrap.dedent(body)}\n```\n")
        else:
            parts.append(special.sub(r"\\\1", body).replace("<", "&lt;"))
    return "\n".join(parts)


def template(declared: Any) -> str:
    """`template <...>` of a declaration, or nothing."""
    if not getattr(declared, "params", None):
        return ""
    names = [
        f"{p.type.format()} {p.name or ''}" if hasattr(p, "type") else f"{p.typekey} {p.name or ''}"
        for p in declared.params
    ]
    return f"template <{', '.join(name.strip() for name in names)}>"


def parameters(function: Any) -> str:
    return ", ".join(p.format() for p in function.parameters)


def declaration(function: Any) -> str:
    """A function or method as it is called: result, name, parameters."""
    result = function.return_type.format() + " " if function.return_type else ""
    name = function.name.format()
    words_before = "static " if getattr(function, "static", False) else ""
    words_after = " const" if getattr(function, "const", False) else ""
    before = template(function.template)
    before += " " if before else ""
    return f"{before}{words_before}{result}{name}({parameters(function)}){words_after};"


def entry(code: str, comment: str) -> str:
    return f"```cpp\n{code}\n```\n\n" + (f"{escaped(comment)}\n\n" if comment else "")


def member(code: str, comment: str) -> list[str]:
    """A line of a synopsis: its comment behind it, or above it where that would be long."""
    text = " ".join(comment.split())
    if len(code) + len(text) < 96:
        return [f"{code}  // {text}" if text else code]
    return [f"// {line}" for line in textwrap.wrap(text, 96)] + [code]


def synopsis(lines: list[str]) -> str:
    return entry("\n".join(lines), "") if lines else ""


def enumerations(scope: ClassScope | NamespaceScope) -> Iterator[str]:
    for enum in scope.enums:
        if getattr(enum, "access", None) in {"private", "protected"}:
            continue
        values = [f"  {line}" for v in enum.values for line in member(f"{v.name},", words(v.doxygen))]
        name = enum.typename.segments[-1].format()
        yield entry("\n".join([f"enum class {name} {{", *values, "};"]), words(enum.doxygen))


def structure(scope: ClassScope, depth: int = 0) -> Iterator[str]:
    """A class with its public members: fields, then methods."""
    declared = scope.class_decl
    name = declared.typename.segments[-1].format()
    yield f"{'#' * (3 + depth)} {name}\n\n"
    if declared.doxygen:
        yield f"{escaped(words(declared.doxygen))}\n\n"
    if template(declared.template):
        yield entry(f"{template(declared.template)} struct {name};", "")
    fields: list[str] = []
    for field in scope.fields:
        if field.access == "public":
            value = f" = {field.value.format()}" if field.value else ""
            kind = "static constexpr " if field.constexpr else "static " if field.static else ""
            code = field.type.format_decl(field.name) if field.name else field.type.format()
            fields += member(f"{kind}{code}{value};", words(field.doxygen))
    yield synopsis(fields)
    methods: list[str] = []
    for method in scope.methods:
        if method.access == "public" and not method.deleted and not method.destructor:
            methods += member(declaration(method), words(method.doxygen))
    yield synopsis(methods)
    yield from enumerations(scope)
    for inner in scope.classes:
        if inner.class_decl.access == "public":
            yield from structure(inner, depth + 1)


def namespace(scope: NamespaceScope) -> Iterator[str]:
    yield from enumerations(scope)
    for alias in scope.using_alias:
        yield entry(f"using {alias.alias} = {alias.type.format()};", words(alias.doxygen))
    for variable in scope.variables:
        value = f" = {variable.value.format()}" if variable.value else ""
        text = f"{variable.type.format_decl(variable.name.format())}{value};"
        yield entry(text, words(variable.doxygen))
    for inner in scope.classes:
        yield from structure(inner)
    for function in scope.functions:
        yield entry(declaration(function), words(function.doxygen))
    for name, inner in scope.namespaces.items():
        if name not in {"detail", ""}:
            yield from namespace(inner)


def section(header: Path, include: Path) -> str:
    data = parse_string(marked(header.read_text()), filename=str(header))
    text = "".join(namespace(data.namespace))
    return f"## {header.relative_to(include)}\n\n{text}" if text else ""


def pages(root: Path) -> dict[str, str]:
    include = root / "include"
    made = {}
    for layer in LAYERS:
        headers = sorted((include / "amontons" / layer).rglob("*.hpp"))
        sections = "".join(section(header, include) for header in headers)
        made[f"cpp-reference/{layer}.md"] = f"# amontons/{layer}\n\n{sections}"
    return made
