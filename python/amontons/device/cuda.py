"""Devices of NVIDIA by CUDA: CuPy, which brings the compiler of kernels along, and the driver."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..checks import Array
from ..errors import InputError
from .backend import Device, Launch, failed, no_room, source

PACKAGE = 'CuPy (pip install "amontons[cuda]")'
DRIVER = "the driver of NVIDIA"
OPTIONS = ("--fmad=false", "-std=c++17")
"""no contraction of a product and a sum: the bits are those of OpenCL"""


def _module() -> Any:
    try:
        import cupy
    except ImportError as error:
        raise InputError(f"CUDA needs the package {PACKAGE}: {error}") from None
    return cupy


def _described(cupy: Any, index: int) -> Device:
    found = cupy.cuda.runtime.getDeviceProperties(index)
    version = cupy.cuda.runtime.driverGetVersion()
    driver = f"CUDA {version // 1000}.{version % 1000 // 10}"
    name = found["name"].decode() if isinstance(found["name"], bytes) else str(found["name"])
    return Device(f"cuda:{index}", name, "gpu", driver, int(found["totalGlobalMem"]), True)


def devices() -> list[Device]:
    """All devices; none without a driver. InputError where CuPy is missing."""
    cupy = _module()
    try:
        count = cupy.cuda.runtime.getDeviceCount()
    except cupy.cuda.runtime.CUDARuntimeError:  # no driver, or none that fits
        return []
    return [_described(cupy, i) for i in range(count)]


class Cuda:
    """The kernels on a CUDA device, a `Backend`. group: work items of a group."""

    def __init__(self, index: int, *, group: int | None = None, text: str | None = None) -> None:
        self._cupy = cupy = _module()
        self.device = _described(cupy, index)
        self.lost = False
        self.group = 256 if group is None else group
        self._on = cupy.cuda.Device(index)
        text = source() if text is None else text
        with self._on:
            self._stream = cupy.cuda.Stream(non_blocking=True)
            program = cupy.RawModule(code=text, options=OPTIONS)
            names = re.findall(r"^KERNEL (\w+)\(", text, re.MULTILINE)
            self._kernels = {name: program.get_function(name) for name in names}
            for kernel in self._kernels.values():
                _ = kernel.num_regs  # loads it: a stream that is captured must not wait for that

    @contextmanager
    def _here(self) -> Iterator[None]:
        """On the device and in the stream of this object; what the driver reports names the device."""
        cuda = self._cupy.cuda
        try:
            with self._on, self._stream:
                yield
        except (cuda.runtime.CUDARuntimeError, cuda.driver.CUDADriverError) as error:
            self.lost = True
            raise failed(self.device, error) from error

    def allocate(self, nbytes: int) -> Any:
        """See `Backend`."""
        try:
            with self._here():
                return self._cupy.empty(nbytes, dtype=np.uint8)
        except self._cupy.cuda.memory.OutOfMemoryError:
            raise no_room(self.device, nbytes) from None

    def host_memory(self, nbytes: int) -> NDArray[np.uint8]:
        """See `Backend`. Pinned: the device copies it while the host goes on."""
        cuda = self._cupy.cuda
        try:
            with self._on:
                return np.frombuffer(cuda.alloc_pinned_memory(nbytes), np.uint8, nbytes)
        except (cuda.runtime.CUDARuntimeError, cuda.memory.OutOfMemoryError):  # the system pins no more
            return np.empty(nbytes, np.uint8)

    def upload(self, buffer: Any, values: NDArray[Any], begin: int = 0) -> None:
        """See `Backend`."""
        offset = begin * values.itemsize
        with self._here():
            buffer[offset : offset + values.nbytes].set(values.reshape(-1).view(np.uint8))

    def download(self, buffer: Any, begin: int, count: int) -> Array:
        """See `Backend`."""
        with self._here():
            return buffer[8 * begin : 8 * (begin + count)].get().view(np.float64)

    def launch(self, kernel: str, groups: int, *arguments: Any) -> None:
        """See `Backend`."""
        with self._here():
            self._kernels[kernel]((groups,), (self.group,), arguments)

    def program(self, launches: Sequence[Launch]) -> Callable[[], None]:
        """See `Backend`. A graph: the device goes from kernel to kernel without the host."""
        held = tuple(launches)  # with their buffers, which the graph knows by address only
        with (
            self._here(),
            self._cupy.cuda.Stream(non_blocking=True) as apart,
        ):  # no other thread launches there
            apart.begin_capture()
            for kernel, groups, arguments in held:
                self._kernels[kernel]((groups,), (self.group,), arguments)
            graph = apart.end_capture()

        def run(held: tuple[Launch, ...] = held) -> None:
            with self._here():
                graph.launch(self._stream)

        return run
