"""A column of cards with arrows, as SVG that is readable on light and dark pages.

A drawing is 400 units wide and never scaled up, so that text keeps its size from 400 to 1280 pixels. All text
stands on light cards; lines between cards have a grey that is visible on white and on black.
"""

import textwrap
from dataclasses import dataclass, field
from xml.sax.saxutils import escape

WIDTH, PAD, GAP, MARGIN = 400, 10, 20, 22
TITLE, TEXT, CODE = 15, 13.5, 12.5
# Mean width of a character over the size of its font (1): measured on Verdana, the widest usual font.
WIDE, WIDE_CODE = 0.56, 0.61
FONT = "system-ui, -apple-system, 'Segoe UI', Roboto, sans-serif"
LINE = "#808592"
FILLS = {"plain": "#eef1fb", "choice": "#fff3d6", "end": "#e2f3e5", "danger": "#fde5e0"}
INK, FAINT = "#1b1f2a", "#454b5a"


@dataclass(frozen=True)
class Card:
    """Title, code (the name in the sources) and text; `kind` is a key of FILLS."""

    title: str
    text: str = ""
    code: str = ""
    kind: str = "plain"


@dataclass
class Drawing:
    label: str
    """for readers of the screen"""
    y: float = 4.0
    parts: list[str] = field(default_factory=list)
    middles: list[float] = field(default_factory=list)
    """of the cards, for arrows beside them"""

    def card(self, card: Card, *, indent: float = 0, arrow: bool = True) -> None:
        """Draws a card below the last one, with an arrow to it unless it is the first or `arrow` is False."""
        x, width = MARGIN + indent, WIDTH - 2 * MARGIN - indent
        lines = wrapped(card.text, width - 2 * PAD, TEXT * WIDE)
        titles = wrapped(card.title, width - 2 * PAD, TITLE * WIDE * 1.06)
        rows = [("t", line, TITLE, 20.0) for line in titles]
        rows += [("c", line, CODE, 17.0) for line in wrapped(card.code, width - 2 * PAD, CODE * WIDE_CODE)]
        rows += [("p", line, TEXT, 18.0) for line in lines]
        height = sum(step for *_, step in rows) + PAD + 4
        if self.middles and arrow:
            self.down(self.y, self.y + GAP)
        self.y += (GAP if arrow else 6) if self.middles else 0
        self.parts.append(
            f'<rect x="{x:g}" y="{self.y:g}" width="{width:g}" height="{height:g}" rx="7" '
            f'fill="{FILLS[card.kind]}" stroke="{LINE}"/>'
        )
        at = self.y + 2
        for kind, line, size, step in rows:
            at += step
            self.parts.append(
                f'<text class="{kind}" x="{x + PAD:g}" y="{at:g}" font-size="{size:g}">{escape(line)}</text>'
            )
        self.middles.append(self.y + height / 2)
        self.y += height

    def down(self, start: float, end: float) -> None:
        x = WIDTH / 2
        self.parts.append(f'<path class="l" d="M{x:g} {start:g}V{end - 2:g}"/>')
        self.parts.append(f'<path class="h" d="M{x - 5:g} {end - 8:g}h10l-5 7z"/>')

    def back(self, source: int, target: int) -> None:
        """An arrow at the left from one card up to an earlier one."""
        low, high, x = self.middles[source], self.middles[target], MARGIN - 14
        self.parts.append(f'<path class="l" d="M{MARGIN:g} {low:g}H{x:g}V{high:g}H{MARGIN - 7:g}"/>')
        self.parts.append(f'<path class="h" d="M{MARGIN - 8:g} {high - 5:g}v10l7 -5z"/>')

    def svg(self) -> str:
        height = round(self.y + 6)
        style = (
            f"text{{font-family:{FONT};fill:{INK}}}.t{{font-weight:600}}.p{{fill:{FAINT}}}"
            f".c{{font-family:ui-monospace,Consolas,monospace;fill:{FAINT}}}"
            f".l{{fill:none;stroke:{LINE};stroke-width:2}}.h{{fill:{LINE}}}"
        )
        return "\n".join(
            [
                f'<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH}" height="{height}" '
                f'viewBox="0 0 {WIDTH} {height}" role="img">',
                f"<title>{escape(self.label)}</title>",
                f"<style>{style}</style>",
                *self.parts,
                "</svg>",
                "",
            ]
        )


def wrapped(text: str, width: float, character: float) -> list[str]:
    """The lines of a text in a width, both in units of the drawing."""
    return textwrap.wrap(text, int(width / character), break_long_words=False) if text else []
