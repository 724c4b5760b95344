"""Figures and tables as files that are whole or not there at all."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Sequence
from io import BytesIO, StringIO
from pathlib import Path
from typing import Any

from ..io.files import write_whole


def save_figure(figure: Any, path: Path, dpi: int) -> None:
    """A Matplotlib figure as PNG, in a folder that a user named; it is closed, whatever happens."""
    from matplotlib import pyplot

    try:
        data = BytesIO()
        figure.savefig(data, dpi=dpi, format="png")
    finally:
        pyplot.close(figure)
    write_whole({path: data.getbuffer()}, own={path})


def csv_bytes(header: Sequence[str], rows: Iterable[Iterable[Any]]) -> bytes:
    """A table as CSV."""
    text = StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(header)
    writer.writerows(rows)
    return text.getvalue().encode()
