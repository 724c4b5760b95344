"""Markdown tables, and numbers as they stand in them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence


def table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A Markdown table; columns after the first are aligned to the right."""
    lines = ["| " + " | ".join(header) + " |", "|---" + "|--:" * (len(header) - 1) + "|"]
    return "\n".join(lines + ["| " + " | ".join(row) + " |" for row in rows])


def milliseconds(seconds: str | float) -> str:
    """Three digits, whole milliseconds from 100 on; nothing for a blank."""
    if seconds == "":
        return ""
    value = 1e3 * float(seconds)
    return f"{value:.3g}" if value < 100 else f"{value:.0f}"


def scientific(value: str | float) -> str:
    return f"{float(value):.1e}" if value != "" else ""


def digits(value: str, scale: float) -> str:
    """Two digits, whole numbers from 10 to a million."""
    number = scale * float(value)
    return f"{number:.0f}" if 10 <= number < 1e6 else f"{number:.2g}"
