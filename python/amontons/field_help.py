"""Fields of dataclasses in `help(...)`.

Their docstrings stand below them in the source. Python does not keep them.
"""

from __future__ import annotations

import ast
import dataclasses
import inspect
import textwrap
from collections.abc import Iterable, Iterator
from typing import Any


def describe_fields(classes: Iterable[Any]) -> None:
    """Adds the fields of each dataclass to what `help` prints; the source is read when that happens first."""
    for cls in classes:
        if inspect.isclass(cls) and dataclasses.is_dataclass(cls):
            cls.__doc__ = _Text(cls.__doc__ or "")


class _Text:
    """The docstring of a class, completed when it is read."""

    def __init__(self, text: str) -> None:
        self.text, self.complete = text, False

    def __get__(self, instance: object, owner: type) -> str:
        if not self.complete:
            self.complete = True
            if lines := list(_lines(owner)):
                self.text = f"{inspect.cleandoc(self.text)}\n\nFields:\n\n" + "\n".join(lines)
        return self.text


def _lines(cls: type) -> Iterator[str]:
    """A line for each field that has a docstring, in the order of the source."""
    try:
        source = textwrap.dedent(inspect.getsource(cls))
    except (OSError, TypeError):  # no source beside the package
        return
    (tree,) = ast.parse(source).body
    assert isinstance(tree, ast.ClassDef)
    for field, text in zip(tree.body, tree.body[1:], strict=False):
        if not isinstance(field, ast.AnnAssign) or not isinstance(field.target, ast.Name):
            continue
        name = field.target.id
        if isinstance(text, ast.Expr) and isinstance(text.value, ast.Constant) and name[0] != "_":
            yield f"{name}: {' '.join(str(text.value.value).split())}"
