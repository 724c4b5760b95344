"""Types of errors and warnings. Every message names the thing that is wrong and the remedy.

A message may hold the name that a stranger gave to a body or a file. As text it has escapes in place of what
a terminal would obey; `args` has it as it was.
"""

from ._core import InputError as InputError
from .visible import visible


def _text(self: BaseException) -> str:
    return visible(" ".join(map(str, self.args)), "\n")


InputError.__doc__ = """An argument that cannot be used; the message names it and the remedy."""
InputError.__str__ = _text  # type: ignore[method-assign,assignment]


class FileError(InputError):
    """A file that cannot be read or written; the message starts with its name."""


class SymmetrisedWarning(UserWarning):
    """A matrix in a file was unsymmetric and was replaced by its symmetric part."""

    __str__ = _text


class StepWarning(UserWarning):
    """The solve of a time step ended above its tolerance; the simulation went on with the best it found."""


class SimulationError(RuntimeError):
    """A time step failed; the state of the simulation is that before the step."""

    __str__ = _text


class ModelWarning(UserWarning):
    """A model is ambiguous or empty: its file does not say whether the base is fixed, or it has no body."""

    __str__ = _text


class UnsupportedWarning(ModelWarning):
    """A model file asks for things that are not read; they were left out, as strict=False allows."""
