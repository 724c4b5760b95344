"""Figures and tables as files that are whole or not there at all."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterable, Sequence
from io import BytesIO, StringIO
from pathlib import Path
from typing import Any

from ..escapes import visible
from ..io.files import write_whole

FORMULA = ("=", "+", "-", "@")
"""First characters of cells that spreadsheets compute."""


def save_figure(figure: Any, path: Path, dpi: int, *, own: bool = True) -> None:
    """A Matplotlib figure as PNG, PDF or SVG, as the suffix says; it is closed, whatever happens.

    own: the name is our choice, in a folder that a user named.
    """
    from .plotting import plt

    try:
        data = BytesIO()
        figure.savefig(data, dpi=dpi, format=path.suffix.lower()[1:])
    finally:
        plt.close(figure)
    write_whole({path: data.getbuffer()}, own={path} if own else ())


def csv_bytes(header: Sequence[str], rows: Iterable[Iterable[Any]]) -> bytes:
    """A table as CSV."""
    text = StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(map(cell, header))
    writer.writerows(map(cell, row) for row in rows)
    return text.getvalue().encode()


def cell(value: Any) -> Any:
    """Content of a cell. A text that a spreadsheet would read as a formula gets an apostrophe in front, which
    marks a text there. Numbers stay.
    """
    if not isinstance(value, str):
        return value
    text = visible(value)
    return f"'{text}" if text.startswith(FORMULA) and not _is_number(text) else text


def _is_number(text: str) -> bool:
    try:
        return math.isfinite(float(text))
    except ValueError:
        return False


def title(text: str) -> str:
    """A text over a figure, as it is: without escapes, which no font has, and formulas."""
    return visible(text).replace("$", r"\$")
