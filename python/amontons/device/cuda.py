"""Devices of NVIDIA by CUDA: CuPy, which brings the compiler of kernels along, and the driver."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..checks import Array
from ..errors import InputError
from .backend import Device, no_room, source

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
        self.group = 256 if group is None else group
        self._on = cupy.cuda.Device(index)
        self._kernels: dict[str, Any] = {}
        with self._on:
            self._program = cupy.RawModule(code=source() if text is None else text, options=OPTIONS)

    def allocate(self, nbytes: int) -> Any:
        """See `Backend`."""
        try:
            with self._on:
                return self._cupy.empty(nbytes, dtype=np.uint8)
        except self._cupy.cuda.memory.OutOfMemoryError:
            raise no_room(self.device, nbytes) from None

    def upload(self, buffer: Any, values: NDArray[Any]) -> None:
        """See `Backend`."""
        with self._on:
            buffer[: values.nbytes].set(values.reshape(-1).view(np.uint8))

    def download(self, buffer: Any, count: int) -> Array:
        """See `Backend`."""
        with self._on:
            return buffer[: 8 * count].get().view(np.float64)

    def launch(self, kernel: str, groups: int, *arguments: Any) -> None:
        """See `Backend`."""
        with self._on:
            if kernel not in self._kernels:
                self._kernels[kernel] = self._program.get_function(kernel)
            self._kernels[kernel]((groups,), (self.group,), arguments)
