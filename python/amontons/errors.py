"""What goes wrong, in types. Every message names the thing that is wrong and the remedy."""

from ._core import InputError as InputError


class FileError(InputError):
    """A file that cannot be read or written as a problem; the message starts with its name."""


class SymmetrisedWarning(UserWarning):
    """A matrix in a file was unsymmetric and was replaced by its symmetric part."""
