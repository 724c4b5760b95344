"""The description of a device, and the five functions of its backend."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib.resources import files
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ..checks import Array
from ..errors import InputError


@dataclass(frozen=True)
class Device:
    """A device that `device=` may name.

    >>> for device in devices():
    ...     name = device.name  # "cuda:0", "opencl:0": a name for Simulation(device=)
    """

    name: str
    """what `device=` takes: "opencl:0", "cuda:1" """
    hardware: str
    """as its driver calls it"""
    kind: str
    """gpu | cpu | accelerator"""
    driver: str
    """platform and version"""
    memory: int
    """bytes"""
    doubles: bool
    """double precision, without which it is of no use here"""


Launch = tuple[str, int, tuple[Any, ...]]
"""a kernel, its number of work groups and its arguments"""


class Backend(Protocol):
    """A device with the kernels of `source`, and a queue that runs them in the order of their launches."""

    device: Device
    lost: bool
    """whether a call failed: the next solve that names the device opens it again"""

    def allocate(self, nbytes: int) -> Any:
        """A buffer; InputError where the device has no room."""
        ...

    def host_memory(self, nbytes: int) -> NDArray[np.uint8]:
        """Memory of the host that uploads read fastest."""
        ...

    def upload(self, buffer: Any, values: NDArray[Any], begin: int = 0) -> None:
        """Copy an array into a buffer, from its entry `begin` of the type of the array on. An array in
        `host_memory` may be read until the next download."""
        ...

    def download(self, buffer: Any, begin: int, count: int) -> Array:
        """`count` doubles of a buffer from number `begin` on, once all that was launched is done."""
        ...

    def launch(self, kernel: str, groups: int, *arguments: Any) -> None:
        """Run a kernel with so many work groups; arguments are buffers, np.uint32 and np.float64."""
        ...

    def program(self, launches: Sequence[Launch]) -> Callable[[], None]:
        """These launches, in this order, as one call that may be repeated."""
        ...


def source() -> str:
    """The kernels, for OpenCL C and CUDA C++."""
    return "".join(files(__package__).joinpath(name).read_text() for name in ("kernels.cl", "pairs.cl"))


def no_room(device: Device, wanted: int) -> InputError:
    return InputError(
        f'device "{device.name}" ({device.hardware}) has {device.memory / 1e9:.3g} GB of memory, of which '
        f"{wanted / 1e9:.3g} GB are not free; solve the problem without device, or on one with more memory"
    )


def failed(device: Device, error: Exception) -> InputError:
    """A driver that reports anything but a lack of memory: a device that was reset or taken away."""
    said = " ".join(str(error).split())[:200] or type(error).__name__
    return InputError(
        f'device "{device.name}" ({device.hardware}) failed: {said}; go on with device="cpu", or start the '
        "program again; a simulation is as before the step"
    )


class Memory:
    """Buffers by name, which grow and stay, with what they hold: the next problem finds them."""

    def __init__(self, backend: Backend) -> None:
        self._backend = backend
        self._buffers: dict[str, tuple[int, Any]] = {}
        self.layout: Any = None
        """the arrays of the last problem on the host"""
        self.there: set[str] = set()
        """names of these arrays whose buffers hold the same"""
        self.sent = 0
        """bytes of all uploads"""

    @property
    def nbytes(self) -> int:
        """Size of all buffers (bytes)."""
        return sum(size for size, _ in self._buffers.values())

    def buffer(self, name: str, nbytes: int) -> Any:
        size, held = self._buffers.get(name, (0, None))
        if size < nbytes or held is None:
            # A quarter more than asked for where it grows: contacts come and go.
            size = max(256, nbytes if held is None else nbytes + nbytes // 4)
            if self.nbytes + size > self._backend.device.memory:
                raise no_room(self._backend.device, self.nbytes + size)
            held = self._backend.allocate(size)
            self._buffers[name] = (size, held)
        return held

    def filled(self, name: str, values: NDArray[Any]) -> Any:
        """A buffer with the values of an array."""
        held = self.buffer(name, values.nbytes)
        self.upload(held, values)
        return held

    def upload(self, held: Any, values: NDArray[Any], begin: int = 0) -> None:
        """See `Backend`; counted."""
        self.sent += values.nbytes
        if values.nbytes:
            self._backend.upload(held, np.ascontiguousarray(values), begin)
