"""Texts of strangers (names of bodies, files, models) as they may be printed."""

from __future__ import annotations

import unicodedata

BIDI = frozenset("\u061c\u200e\u200f\u202a\u202b\u202c\u202d\u202e\u2066\u2067\u2068\u2069")
"""Characters that turn what follows them round."""


def visible(text: str, keep: str = "") -> str:
    """The text with an escape (as \\x1b) in place of every character that a terminal or a page would obey and
    not show. These are control characters, line separators, changes of direction, and bytes that are not
    text.

    keep: of those, what stays as it is, such as line ends of our own.
    """
    if text.isascii() and text.isprintable():
        return text
    return "".join(c if c in keep or not _obeyed(c) else _escape(c) for c in text)


def _obeyed(character: str) -> bool:
    return unicodedata.category(character) in ("Cc", "Cs", "Zl", "Zp") or character in BIDI


def _escape(character: str) -> str:
    code = ord(character)
    if 0xDC80 <= code <= 0xDCFF:  # a byte of a name that is no UTF-8
        code -= 0xDC00
    return f"\\x{code:02x}" if code < 0x100 else f"\\u{code:04x}"
