"""A verdict as one page of HTML: what was asked, the answer, its margins, the worst joints, a picture."""

from __future__ import annotations

import base64
import html
import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ...io.files import writable, write_whole
from .picture import picture, png_bytes
from .search import Factor
from .stability import Stability

WORST = 10
"""Joints that the page lists"""
STYLE = (
    "body{font:15px/1.5 system-ui,sans-serif;max-width:52em;margin:2em auto;padding:0 1em;color:#222}"
    "table{border-collapse:collapse;margin:1em 0}"
    "td,th{padding:.2em .8em;border-bottom:1px solid #ddd;text-align:right}"
    "td:first-child,th:first-child{text-align:left}"
    "img{max-width:100%}.verdict{font-size:1.4em;font-weight:600}"
)
LIMITS = (
    "Blocks are rigid. Joints bear no tension beyond their mortar and slide by Coulomb's law. The verdict is "
    "about the geometry as drawn and about the start of a motion. Displacements, waves, and stones that "
    "break are not in it. A factor of collapse is that of the associated law, a bound where joints slide "
    "without opening. The value for blocks placed without stress is beside it."
)


def write_report(verdict: Stability, path: str | Path, *, title: str = "Stability") -> Path:
    """The page as an .html file that needs no other file; pictures need pillow."""
    target = writable(path)
    write_whole({target: page(verdict, title).encode()})
    return target


def page(verdict: Stability, title: str) -> str:
    """The text of the page."""
    facts = verdict.as_dict()
    shot = base64.b64encode(png_bytes(picture(verdict, (1200, 800)))).decode()
    parts = [
        f"<!doctype html><html lang='en'><meta charset='utf-8'><title>{html.escape(title)}</title>",
        f"<style>{STYLE}</style><h1>{html.escape(title)}</h1>",
        f"<p class='verdict'>{html.escape(verdict.verdict)}</p><p>{html.escape(verdict.meaning)}.</p>",
        _table(
            ("quantity", "value"),
            [
                ("blocks", facts["blocks"]),
                ("supports", ", ".join(facts["supports"][:8])),
                ("joints", facts["joints"]),
                ("weight of the free blocks", f"{facts['weight']:.4g} N"),
                ("unbalanced share of the weight", f"{facts['unbalanced']:.1e}"),
            ],
        ),
        f"<img alt='blocks, joints and forces' src='data:image/png;base64,{shot}'>",
    ]
    if verdict.factors:
        rows = [_factor(f) for f in verdict.factors]
        parts += [
            "<h2>Margins</h2>",
            _table(("load", "stands at", "falls at", "unit", "placed without stress"), rows),
        ]
    if verdict.equilibrium.status == "stands":
        parts += ["<h2>Joints that use the most</h2>", _worst(verdict)]
    if "falling" in facts:
        parts.append(f"<h2>Mechanism</h2><p>Fastest blocks: {html.escape(', '.join(facts['falling']))}.</p>")
    notes = "".join(f"<li>{html.escape(note)}</li>" for note in verdict.notes)
    parts.append(f"<h2>Assumptions</h2><ul>{notes}</ul><p>{html.escape(LIMITS)}</p></html>")
    return "\n".join(parts)


def _factor(f: Factor) -> tuple[str, ...]:
    upper = "none found" if math.isinf(f.upper) else f"{f.upper:.4g}"
    return f.load, f"{f.lower:.4g}", upper, f.unit, "" if math.isnan(f.placed) else f"{f.placed:.4g}"


def _worst(verdict: Stability) -> str:
    rows, names = verdict.joint_forces, verdict.assembly.names
    order = np.argsort(-np.maximum(rows["friction_used"], rows["eccentricity"]), kind="stable")[:WORST]
    return _table(
        ("joint", "compression (N)", "shear (N)", "friction used", "eccentricity", "mean stress (kPa)"),
        [
            (
                f"{names[r['a']]} on {names[r['b']]}", f"{r['compression']:.4g}", f"{r['shear']:.4g}",
                f"{r['friction_used']:.2f}", f"{r['eccentricity']:.2f}",
                f"{r['compression'] / r['area'] / 1e3:.3g}" if r["area"] else "",
            )
            for r in rows[order]
        ],
    )  # fmt: skip


def _table(heads: tuple[str, ...], rows: Sequence[tuple[object, ...]]) -> str:
    head = "".join(f"<th>{html.escape(name)}</th>" for name in heads)
    body = "".join("<tr>" + "".join(f"<td>{html.escape(str(x))}</td>" for x in row) + "</tr>" for row in rows)
    return f"<table><tr>{head}</tr>{body}</table>"
