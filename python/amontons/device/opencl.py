"""Devices of any vendor by OpenCL: pyopencl, and the driver of the vendor; pocl for the processor."""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..checks import Array
from ..errors import InputError
from .backend import Device, Launch, failed, no_room, source

PACKAGE = 'pyopencl (pip install "amontons[opencl]")'
DRIVER = "an OpenCL driver of its vendor, or pocl (pip install pocl-binary-distribution) for the processor"
GROUPS = {"gpu": 256}
"""work items of a group by kind of device; others 64"""


def _module() -> Any:
    try:
        import pyopencl
    except ImportError as error:
        raise InputError(f"OpenCL needs the package {PACKAGE}: {error}") from None
    return pyopencl


def _hardware(cl: Any) -> list[Any]:
    try:
        platforms = cl.get_platforms()
    except cl.Error:  # no driver at all
        return []
    found = []
    for platform in platforms:
        try:
            found += platform.get_devices()
        except cl.Error:  # a driver without its hardware
            continue
    return found


def _described(cl: Any, index: int, hardware: Any) -> Device:
    kinds = {cl.device_type.GPU: "gpu", cl.device_type.CPU: "cpu"}
    kind = next((name for bit, name in kinds.items() if hardware.type & bit), "accelerator")
    doubles = bool(hardware.double_fp_config)
    driver = f"{hardware.platform.name} {hardware.driver_version}"
    memory = int(hardware.global_mem_size)
    return Device(f"opencl:{index}", hardware.name.strip(), kind, driver, memory, doubles)


def devices() -> list[Device]:
    """All devices of all drivers; InputError where pyopencl is missing."""
    cl = _module()
    return [_described(cl, i, hardware) for i, hardware in enumerate(_hardware(cl))]


class OpenCL:
    """The kernels on an OpenCL device, a `Backend`. group: work items of a group, None for the default."""

    def __init__(self, index: int, *, group: int | None = None, text: str | None = None) -> None:
        self._cl = cl = _module()
        hardware = _hardware(cl)[index]
        self.device = _described(cl, index, hardware)
        self.lost = False
        self.group = GROUPS.get(self.device.kind, 64) if group is None else group
        self._largest = int(hardware.max_mem_alloc_size)
        self._context = cl.Context([hardware])
        self._queue = cl.CommandQueue(self._context)
        try:
            program = cl.Program(self._context, source() if text is None else text).build()
        except cl.Error as error:
            said = next((line for line in str(error).splitlines() if line.startswith("error")), str(error))
            raise InputError(
                f'device "{self.device.name}" ({self.device.hardware}): its driver {self.device.driver} does '
                f"not compile for it ({said[:200]}); install a newer one, or solve without device"
            ) from None
        self._lock = threading.Lock()
        self._kernels = {kernel.function_name: kernel for kernel in program.all_kernels()}

    def allocate(self, nbytes: int) -> Any:
        """See `Backend`."""
        cl = self._cl
        if nbytes > self._largest:
            raise no_room(self.device, nbytes)
        try:
            return cl.Buffer(self._context, cl.mem_flags.READ_WRITE, nbytes)
        except cl.Error:
            raise no_room(self.device, nbytes) from None

    def host_memory(self, nbytes: int) -> NDArray[np.uint8]:
        """See `Backend`."""
        return np.empty(nbytes, np.uint8)

    def upload(self, buffer: Any, values: NDArray[Any], begin: int = 0) -> None:
        """See `Backend`."""
        try:
            self._cl.enqueue_copy(self._queue, buffer, values, dst_offset=begin * values.itemsize)
        except self._cl.Error as error:
            raise self._failed(error) from error

    def download(self, buffer: Any, begin: int, count: int) -> Array:
        """See `Backend`."""
        values = np.empty(count)
        try:
            self._cl.enqueue_copy(self._queue, values, buffer, src_offset=8 * begin)
        except self._cl.Error as error:
            raise self._failed(error) from error
        return values

    def launch(self, kernel: str, groups: int, *arguments: Any) -> None:
        """See `Backend`."""
        try:
            with self._lock:  # arguments are set one by one, then the kernel is enqueued
                self._kernels[kernel](self._queue, (groups * self.group,), (self.group,), *arguments)
        except self._cl.Error as error:
            raise self._failed(error) from error

    def _failed(self, error: Exception) -> InputError:
        if isinstance(error, self._cl.MemoryError):  # drivers may allocate at the first use
            return no_room(self.device, 0)
        self.lost = True
        return failed(self.device, error)

    def program(self, launches: Sequence[Launch]) -> Callable[[], None]:
        """See `Backend`. The queue runs them in order; nobody waits between them."""
        held = tuple(launches)

        def run() -> None:
            for kernel, groups, arguments in held:
                self.launch(kernel, groups, *arguments)
            self._queue.flush()

        return run
