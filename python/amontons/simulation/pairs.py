"""Who finds the geoms of a simulation that are near each other."""

from __future__ import annotations

from .. import _core
from ..hooks import supplied_by


def search_of_device(device: str, least: int) -> _core.PairSearch | None:
    """The search of a device for models of at least so many geoms, None for "cpu".

    InputError for a device that there is not.
    """
    if isinstance(device, str) and device == "cpu":
        return None
    return search_of_name(device, least)


@supplied_by("amontons.device.found")
def search_of_name(device: str, least: int) -> _core.PairSearch:
    """`search_of_device` for all but "cpu"; amontons.device supplies it."""
    raise NotImplementedError
