"""Files appear whole or not at all."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def replacing(*paths: Path) -> Iterator[list[Path]]:
    """Temporary files beside `paths`, which replace them when the block ends without an exception."""
    temporary: list[Path] = []
    try:
        for path in paths:
            handle, name = tempfile.mkstemp(prefix=f".{path.stem}-", suffix=path.suffix, dir=path.parent)
            os.close(handle)
            temporary.append(Path(name))
        yield temporary
        umask = os.umask(0)
        os.umask(umask)
        for new, path in zip(temporary, paths, strict=True):
            new.chmod(0o666 & ~umask)  # mkstemp gives 0600
            os.replace(new, path)
    finally:
        for new in temporary:
            new.unlink(missing_ok=True)
