"""The title of a page: the name of what it shows."""

from __future__ import annotations

import gzip
import html
from pathlib import Path
from typing import Any

from ..escapes import visible

FILES = (".xml", ".mjcf", ".urdf", ".h5", ".hdf5", ".hdf")
OF_VISER = "<title>Viser</title>"


def title_of(source: str, path: Path) -> str:
    """The scene or the model file that a recording says it is of, else the recording's own name.

    source: as commands write it, the scene or the file and then parameters KEY=VALUE.
    """
    words = source.split(" ")
    while len(words) > 1 and "=" in words[-1]:
        words.pop()
    name = " ".join(words)
    name = Path(name).stem if Path(name).suffix.lower() in FILES else name
    return name or path.stem


def with_title(page: str, title: str) -> str:
    """The page of viser under this title."""
    return page.replace(OF_VISER, f"<title>{html.escape(visible(title))}</title>", 1)


def put_title(response: Any, title: str) -> None:
    """The same for a response of the server, which may be compressed; others stay as they are."""
    headers = response.headers
    if "text/html" not in headers.get("Content-Type", ""):
        return
    packed = headers.get("Content-Encoding") == "gzip"
    page = with_title((gzip.decompress(response.body) if packed else response.body).decode(), title).encode()
    response.body = gzip.compress(page, 1) if packed else page
    del headers["Content-Length"]
    headers["Content-Length"] = str(len(response.body))
