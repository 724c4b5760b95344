"""Storage of an HDF5 object, read from its header by our own code before the library opens it.

A dataset whose values are said to lie elsewhere (a virtual one) makes the library decode a description of
places as it opens the dataset; version 2.0 runs beyond its memory where that is damaged. So the class of
storage is read first. After the HDF5 File Format Specification 3.0, IV.A.1 (object headers) and IV.A.2.i (the
data layout message).
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

import h5py

LAYOUT, CONTINUATION = 0x08, 0x10  # types of messages
VIRTUAL = 3  # class of storage
MOST_BLOCKS, MOST_BYTES = 64, 1 << 20
"""A header is in one piece, or a few, of kilobytes."""


def is_virtual(path: Path, group: h5py.Group, key: str) -> bool:
    """Whether a dataset's header says that its values lie in other datasets.

    False where there is no such object or its header is none that we know, which is left to the library.
    """
    try:
        info = h5py.h5o.get_info(group.id, key.encode())
        creation = group.file.id.get_create_plist()
        if info.type != h5py.h5o.TYPE_DATASET or creation.get_sizes() != (8, 8):
            return False
        base = int(creation.get_userblock())
        with path.open("rb") as file:
            return any(
                kind == LAYOUT and len(body) > 1 and body[0] >= 3 and body[1] == VIRTUAL
                for kind, body in messages(file, base, int(info.addr))
            )
    except (OSError, KeyError, RuntimeError, ValueError, struct.error, OverflowError, IndexError):
        return False


def messages(file: BinaryIO, base: int, address: int) -> Iterator[tuple[int, bytes]]:
    """Type and body of every message of the object header at an address."""

    def read(at: int, size: int) -> bytes:
        file.seek(at)
        return file.read(min(size, MOST_BYTES))

    start = base + address
    first = read(start, 40)
    if first[:4] == b"OHDR":
        flags = first[5]
        at = 6 + 16 * bool(flags & 0x20) + 4 * bool(flags & 0x10)
        width = 1 << (flags & 3)
        blocks = [(start + at + width, int.from_bytes(first[at : at + width], "little"))]
        head, form, signature = 4 + 2 * bool(flags & 0x04), "<BH", 4
    else:
        blocks = [(start + 16, struct.unpack_from("<I", first, 8)[0])]
        head, form, signature = 8, "<HH", 0
    for at, size in blocks:  # grows as continuations are found
        block, place = read(at, size), 0
        while place + head <= len(block):
            kind, length = struct.unpack_from(form, block, place)
            body = block[place + head : place + head + length]
            yield kind, body
            if kind == CONTINUATION and len(body) >= 16 and len(blocks) < MOST_BLOCKS:
                where, there = struct.unpack_from("<QQ", body)
                # A block of the newer kind begins with a signature and ends with a checksum.
                blocks.append((base + where + signature, max(there - 2 * signature, 0)))
            place += head + length
