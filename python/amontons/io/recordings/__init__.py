"""Runs in files: recordings of what happened, and saved states from which a simulation goes on.

All are HDF5, which is imported when it is used.
"""

from __future__ import annotations

from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...checks import flag
from ...limits import DEFAULT, Limits

if TYPE_CHECKING:
    from ...simulation.simulation import Simulation
    from .recorder import Recorder
    from .recording import Recording


def record(
    path: str | PathLike[str],
    simulation: Simulation,
    *,
    every: int = 1,
    contacts: bool = True,
    signals: bool = True,
    source: str = "",
    overwrite: bool = False,
) -> Recorder:
    """Begin a recording of a simulation; `read_recording` reads it.

    path: names the file from now on. It can be read at any time, and whatever ends the process, all but the
        last second is in it. close(), or the end of the block, marks it as complete; an exception does not.
    every: states and contacts are recorded every so many steps, beginning with the state that the simulation
        is in now; reports of every step.
    contacts: whether contact tables are recorded, which take by far the most room.
    signals: whether motor efforts, controls, reactions and sensors are recorded with the states, as columns
        such as "screw.motor" and "foot.fx".
    source: free text, where the model came from.
    overwrite: replace a file that is there, unless it is being recorded.

    Raises InputError, FileError if the file exists or cannot be written.

    >>> simulation = Simulation(scenes.make("stack"))
    >>> with record("run.h5", simulation) as recorder:
    ...     report = simulation.run(0.1, after_step=recorder)  # or recorder.add(simulation.step())
    """
    from .recorder import Recorder

    return Recorder(
        Path(path),
        simulation,
        every=every,
        contacts=contacts,
        signals=flag("signals", signals),
        source=source,
        overwrite=overwrite,
    )


def read_recording(path: str | PathLike[str], *, limits: Limits = DEFAULT) -> Recording:
    """Open a recording; its arrays are read as they are indexed.

    limits: what the file may ask for.

    Raises FileNotFoundError, or FileError naming the file and what is missing or damaged.

    >>> simulation = Simulation(scenes.make("stack"))
    >>> with record("stack.h5", simulation) as recorder:
    ...     report = simulation.run(0.1, after_step=recorder)
    >>> with read_recording("stack.h5") as recording:
    ...     print(len(recording), "frames")
    21 frames
    """
    from .recording import open_recording

    return open_recording(path, limits)


def is_recording(path: str | PathLike[str]) -> bool:
    """Whether a file says that it is a recording; False of what cannot be read."""
    from .recording import says_recording

    return says_recording(path)


def save_simulation(simulation: Simulation, path: str | PathLike[str]) -> None:
    """See `Simulation.save`."""
    from .saved_state import save

    save(simulation, path)


def load_simulation(path: str | PathLike[str], options: dict[str, Any]) -> Simulation:
    """See `Simulation.load`."""
    from .saved_state import load

    return load(path, options)
