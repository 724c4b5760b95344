"""Files of xacro, the macros of ROS: expanded by the package of that name, where it is installed."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from ...errors import FileError, InputError
from ...limits import Limits


@contextmanager
def expanded(path: Path, limits: Limits) -> Iterator[Path]:
    """A file with the URDF that a xacro file makes. xacro evaluates expressions of the file as Python."""
    if limits.folder is not None:
        raise FileError(
            f"{path}: xacro evaluates what the file says, anywhere; with limits.folder give the URDF that it "
            "makes: `xacro robot.xacro > robot.urdf`"
        )
    try:
        import xacro
    except ImportError:
        raise InputError(
            f"{path}: this file needs xacro: pip install amontons[ros]; or `xacro robot.xacro > robot.urdf`"
        ) from None
    try:
        text = xacro.process_file(str(path)).toprettyxml(indent="  ")
    except Exception as error:  # xacro lets pass whatever an expression raises
        reason = " ".join(str(error).split())[:300]
        raise FileError(f"{path}: xacro cannot expand it: {type(error).__name__}: {reason}") from None
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / f"{path.name.removesuffix('.xacro').removesuffix('.urdf')}.urdf"
        file.write_text(text, encoding="utf-8")
        yield file
