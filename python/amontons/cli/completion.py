"""Values that a shell can complete, beside options and commands; for `autocompletion` of typer."""

from __future__ import annotations

from pathlib import Path
from textwrap import shorten

MODELS = (
    ".xml", ".mjcf", ".urdf", ".json", ".sdf", ".world", ".usd", ".usda", ".usdc", ".usdz", ".mjb", ".xacro",
)  # fmt: skip
SAVED = (".h5", ".hdf5", ".hdf")
PROBLEMS = (".hdf5", ".h5", ".npz", ".mtx")


def scene_names(incomplete: str) -> list[tuple[str, str]]:
    """Scenes with what they show."""
    from .. import scenes

    # Fish takes every line for a word of its own, and help that is longer is wrapped.
    return [
        (name, shorten(scenes.get(name).summary, 60, placeholder=" ..."))
        for name in scenes.names()
        if name.startswith(incomplete)
    ]


def subjects(incomplete: str) -> list[tuple[str, str]]:
    """Scenes and model files."""
    return scene_names(incomplete) + _files(incomplete, (*MODELS, *SAVED))


def problems(incomplete: str) -> list[tuple[str, str]]:
    """Problem files."""
    return _files(incomplete, PROBLEMS)


def recordings(incomplete: str) -> list[tuple[str, str]]:
    """Recordings, by their suffix."""
    return _files(incomplete, (".h5", ".hdf5", ".hdf"))


def studies(incomplete: str) -> list[tuple[str, str]]:
    """Study files."""
    return _files(incomplete, (".toml",))


def method_names(incomplete: str) -> list[str]:
    """Values of --method."""
    from ..problem.options import methods

    return [name for name in methods() if name.startswith(incomplete)]


def law_names(incomplete: str) -> list[str]:
    """Values of --law."""
    from ..problem.options import LAWS

    return [name for name in LAWS if name.startswith(incomplete)]


def _files(incomplete: str, suffixes: tuple[str, ...]) -> list[tuple[str, str]]:
    """Files with these suffixes, and folders, of which more can be typed."""
    folder, _, start = incomplete.rpartition("/")
    place = Path(incomplete[: len(folder) + 1] or ".").expanduser()
    head = incomplete[: len(incomplete) - len(start)]
    try:
        entries = sorted(place.iterdir())
    except OSError:
        return []
    found = []
    for entry in entries:
        if entry.name.startswith(start) and (start.startswith(".") or not entry.name.startswith(".")):
            if entry.is_dir():
                found.append((f"{head}{entry.name}/", "folder"))
            elif entry.suffix.lower() in suffixes:
                found.append((f"{head}{entry.name}", ""))
    return found
