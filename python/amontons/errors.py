"""Types of errors and warnings. Every message names the thing that is wrong and the remedy.

A message may hold the name that a stranger gave to a body or a file. As text it has escapes in place of what
a terminal would obey; `args` has it as it was.
"""

from ._core import InputError as InputError
from .escapes import visible


def _text(self: BaseException) -> str:
    return visible(" ".join(map(str, self.args)), "\n")


InputError.__doc__ = """An argument that cannot be used; the message names it and the remedy.

>>> try:
...     Material(friction=-1)
... except InputError as error:
...     print(error)
material: friction is -1; it must not be negative
"""
InputError.__str__ = _text  # type: ignore[method-assign,assignment]


class FileError(InputError):
    """A file that cannot be read or written; the message starts with its name.

    >>> try:
    ...     amontons.read_recording(examples.path("arm.xml"))
    ... except FileError as error:
    ...     print("not a recording")
    not a recording
    """


class SymmetrisedWarning(UserWarning):
    """A matrix in a file was unsymmetric and was replaced by its symmetric part.

    >>> import warnings
    >>> with warnings.catch_warnings():
    ...     warnings.simplefilter("error", vi.SymmetrisedWarning)  # refuse unsymmetric files
    ...     problem = vi.read_problem(examples.path("plates.hdf5"))
    """

    __str__ = _text


class StepWarning(UserWarning):
    """The solve of a time step ended above its tolerance; the simulation went on with the best it found.

    >>> import warnings
    >>> with warnings.catch_warnings():
    ...     warnings.simplefilter("error", StepWarning)  # a step that misses its tolerance raises
    ...     report = Simulation(scenes.make("stack")).step()
    >>> report.converged
    True
    """


class SimulationError(RuntimeError):
    """A time step failed; the state of the simulation is that before the step.

    >>> simulation = Simulation(scenes.make("arch"), max_iterations=1, method="jacobi", on_failure="raise")
    >>> try:
    ...     report = simulation.step()
    ... except SimulationError:
    ...     print(simulation.steps, "steps")
    0 steps
    """

    __str__ = _text


class ModelWarning(UserWarning):
    """A model is ambiguous or empty: its file does not say whether the base is fixed, or it has no body.

    >>> import warnings
    >>> with warnings.catch_warnings(record=True) as caught:
    ...     warnings.simplefilter("always")
    ...     simulation = Simulation(Model())
    >>> caught[0].category.__name__
    'ModelWarning'
    """

    __str__ = _text


class UnsupportedWarning(ModelWarning):
    """A model file asks for things that are not read; they were left out, as strict=False allows.

    >>> import warnings
    >>> with warnings.catch_warnings():
    ...     warnings.simplefilter("error", UnsupportedWarning)  # as load_model(strict=True)
    ...     model = load_model(examples.path("arm.xml"))
    """
