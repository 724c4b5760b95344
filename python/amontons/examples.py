"""Models and problem files that come with the package.

Programs and notebooks can read them without a clone.
"""

from pathlib import Path

from .checks import chosen

__all__ = ["names", "path"]
# Beside this module in a wheel (cmake/PythonModule.cmake); in a clone in its folder of examples.
_PLACES = (Path(__file__).parent / "example_files", Path(__file__).parents[2] / "examples")
_KINDS = ("models", "problems", "assemblies")


def _files() -> dict[str, Path]:
    for place in _PLACES:
        if place.is_dir():
            return {path.name: path for kind in _KINDS for path in sorted((place / kind).iterdir())}
    return {}


def names() -> tuple[str, ...]:
    """The names that `path` takes: models (MJCF, URDF), problems (FCLIB), assemblies of blocks (OBJ).

    >>> examples.names()[:2]
    ('arm.xml', 'dog.urdf')
    """
    return tuple(_files())


def path(name: str) -> Path:
    """The path of an example file, for `load_model` or `vi.read_problem`. Do not write to it.

    Raises InputError naming the files that exist.

    >>> model = load_model(examples.path("arm.xml"))
    """
    return chosen("example", name, _files())
