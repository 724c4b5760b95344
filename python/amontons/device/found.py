"""Which devices there are, and the one that a name means."""

from __future__ import annotations

import re
import threading
import weakref
from typing import Any

from .. import _core
from ..checks import shown
from ..errors import InputError
from ..problem.iterate import source_of_name
from ..simulation.pairs import search_of_name
from . import cuda, opencl
from .backend import Backend, Device, Memory
from .methods import DeviceMethod
from .pairs import PairFinder

BACKENDS: dict[str, Any] = {"cuda": cuda, "opencl": opencl}
NAMES = '"cpu", "gpu", "cuda", "cuda:1", "opencl", "opencl:1"'


def devices() -> tuple[Device, ...]:
    """The devices that `device=` may name: those of CUDA, then those of OpenCL.

    Empty where neither CuPy nor pyopencl is installed or no driver is. A device without double precision is
    listed and cannot be used. Importing the packages and asking the drivers takes a second the first time.

    >>> names = [device.name for device in devices()]
    """
    found: list[Device] = []
    for module in BACKENDS.values():
        try:
            found += module.devices()
        except InputError:  # its package is not installed
            continue
    return tuple(found)


def remedies() -> dict[str, str | None]:
    """The missing part of each backend, or None."""
    told: dict[str, str | None] = {}
    for name, module in BACKENDS.items():
        try:
            told[name] = None if module.devices() else f"no device found: install {module.DRIVER}"
        except InputError as error:
            told[name] = str(error)
    return told


def _listed(found: tuple[Device, ...] | list[Device]) -> str:
    return ", ".join(f"{d.name} ({d.hardware}, {d.kind})" for d in found) or "none"


def chosen_device(name: str) -> Device:
    """The device of a name; InputError that says what is missing."""
    if name == "gpu":
        usable = [d for d in devices() if d.kind == "gpu" and d.doubles]
        if not usable:
            missing = "; ".join(f"{k}: {v}" for k, v in remedies().items() if v)
            raise InputError(
                f'device "gpu": no GPU with double precision was found ({missing or "no driver shows one"}); '
                f"devices found: {_listed(devices())}"
            )
        return usable[0]
    kind, _, index = name.partition(":")
    if kind not in BACKENDS or not re.fullmatch("[0-9]{0,9}", index):
        raise InputError(f"unknown device {shown(name)}; names are {NAMES}")
    found = BACKENDS[kind].devices()
    if not found:
        raise InputError(f'device "{name}": none was found; it needs {BACKENDS[kind].DRIVER}')
    if not index:  # a GPU before a processor
        found = sorted(found, key=lambda d: (not d.doubles, d.kind != "gpu"))
    if int(index or 0) >= len(found):
        raise InputError(f'device "{name}" is absent; found are {_listed(found)}')
    device = found[int(index or 0)]
    if not device.doubles:
        raise InputError(
            f'device "{device.name}" ({device.hardware}, {device.driver}) has no double precision, which the '
            "passes need"
        )
    return device


_opened: dict[str, Backend] = {}
_lock = threading.Lock()


def open_device(device: Device) -> Backend:
    """Its backend: the kernels are built once per process, and again after a call that failed."""
    with _lock:
        if device.name not in _opened or _opened[device.name].lost:
            kind, _, index = device.name.partition(":")
            made = opencl.OpenCL(int(index)) if kind == "opencl" else cuda.Cuda(int(index))
            _opened[device.name] = made
        return _opened[device.name]


def source_on(backend: Backend, name: str, least_contacts: int) -> _core.IterateSource:
    """Solves on a device; each takes buffers that no other one uses, and gives them back at its end."""
    idle: list[Memory] = []

    def make(problem: _core.Problem, law: _core.Law, threads: int) -> DeviceMethod:
        try:
            memory = idle.pop()
        except IndexError:
            memory = Memory(backend)
        method = DeviceMethod(problem, law, backend, memory, threads=threads)
        weakref.finalize(method, idle.append, memory)
        return method

    return _core.IterateSource(name, make, least_contacts=least_contacts, with_layout=True, as_method=True)


def _chosen(device: object) -> Device:
    if not isinstance(device, str):
        raise InputError(f"device is {shown(device)}; it must be one of the names {NAMES}")
    return chosen_device(device)


def _source_of_name(device: object, least_contacts: int) -> _core.IterateSource:
    chosen = _chosen(device)
    return source_on(open_device(chosen), chosen.name, least_contacts)


def _search_of_name(device: object, least: int) -> _core.PairSearch:
    backend = open_device(_chosen(device))
    return _core.PairSearch(PairFinder(backend).find, least, backend.host_memory)


source_of_name.supply(_source_of_name)
search_of_name.supply(_search_of_name)
