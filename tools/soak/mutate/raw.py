"""Damage to bytes, and to the words of a text."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

Rng = np.random.Generator

INTERESTING = [0, 1, 0x7F, 0x80, 0xFF, 0x20, 0x0A, 0x3C, 0x3E, 0x22, 0x25, 0x26]
WORDS = (
    b"nan inf -inf 1e308 -1e308 1e-320 1e999 -0 0x10 2147483648 -2147483649 9223372036854775808 "
    b"18446744073709551616 1e10 1000000000 99999999999999999999 %s%n%x %s %n ${x} ../../x NULL true -1 0.5 "
    b"1,5 1e 1e+ + - . '' \\ \xff\xfe \x00 \xe2\x82\xac"
).split(b" ")


def pick(rng: Rng, things: list) -> object:
    return things[int(rng.integers(len(things)))]


def _span(rng: Rng, size: int) -> tuple[int, int]:
    """A short piece more often than a long one."""
    start = int(rng.integers(size + 1))
    return start, min(size, start + 1 + int(2 ** rng.uniform(0, 10)))


def flip_bit(rng: Rng, data: bytearray) -> None:
    if data:
        data[rng.integers(len(data))] ^= 1 << int(rng.integers(8))


def set_byte(rng: Rng, data: bytearray) -> None:
    if data:
        data[rng.integers(len(data))] = (
            pick(rng, INTERESTING) if rng.random() < 0.5 else int(rng.integers(256))
        )


def noise(rng: Rng, data: bytearray) -> None:
    start, end = _span(rng, len(data))
    data[start:end] = rng.bytes(end - start)


def cut(rng: Rng, data: bytearray) -> None:
    start, end = _span(rng, len(data))
    del data[start:end]


def truncate(rng: Rng, data: bytearray) -> None:
    del data[int(rng.integers(len(data) + 1)) :]


def repeat(rng: Rng, data: bytearray) -> None:
    start, end = _span(rng, len(data))
    data[end:end] = bytes(data[start:end]) * int(rng.integers(1, 9))


def swap(rng: Rng, data: bytearray) -> None:
    (a, b), (c, d) = _span(rng, len(data)), _span(rng, len(data))
    if b <= c:
        data[a:b], data[c:d] = data[c:d], data[a:b]


def integer(rng: Rng, data: bytearray) -> None:
    """An extreme number of 2, 4 or 8 bytes in the place of another."""
    width = int(rng.choice([2, 4, 8]))
    values = [0, 1, -1, 2 ** (8 * width - 1) - 1, -(2 ** (8 * width - 1)), 65536, 10**6, 10**9]
    if len(data) >= width:
        start = int(rng.integers(len(data) - width + 1))
        value = pick(rng, values) % 2 ** (8 * width)
        data[start : start + width] = value.to_bytes(width, "little")


def word(rng: Rng, data: bytearray) -> None:
    """A word of a text becomes another one."""
    parts = bytes(data).split(b" ")
    parts[rng.integers(len(parts))] = pick(rng, WORDS)
    data[:] = b" ".join(parts)


def line(rng: Rng, data: bytearray) -> None:
    """A line of a text is left out, repeated or moved."""
    lines = bytes(data).split(b"\n")
    a, b = int(rng.integers(len(lines))), int(rng.integers(len(lines)))
    match int(rng.integers(3)):
        case 0:
            del lines[a]
        case 1:
            lines.insert(b, lines[a])
        case 2:
            lines[a], lines[b] = lines[b], lines[a]
    data[:] = b"\n".join(lines)


BINARY: list[Callable[[Rng, bytearray], None]] = [
    flip_bit, set_byte, set_byte, noise, cut, truncate, repeat, swap, integer, integer,
]  # fmt: skip
TEXT = [*BINARY[:-2], word, word, word, line, line]
"""Of a text."""


def damage(rng: Rng, data: bytes, kinds: list[Callable[[Rng, bytearray], None]]) -> bytes:
    changed = bytearray(data)
    kinds[int(rng.integers(len(kinds)))](rng, changed)
    return bytes(changed)
