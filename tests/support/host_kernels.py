"""The kernels of devices as CUDA C++ by the compiler of the processor."""

import ctypes
import shutil
import subprocess

import numpy as np
import pytest
from amontons.device import backend

HOST = """
#include <cmath>
#include <cstddef>
#define __global__
#define __device__
#define __shared__ static
#define __forceinline__ inline
struct Dim { unsigned x; };
static Dim blockIdx, gridDim, threadIdx = {0}, blockDim = {1};
#define __syncthreads()
using std::sqrt;
#include "kernels.cl"
extern "C" void place(unsigned group, unsigned groups) { blockIdx.x = group; gridDim.x = groups; }
"""


class Host:
    """The kernels as CUDA C++ has them, by the compiler of the processor: groups of one item, one by one."""

    device = backend.Device("host", "host", "cpu", "", 1 << 40, True)
    lost = False

    def __init__(self, library):
        self.library = library

    def allocate(self, nbytes):
        return np.full(nbytes, 255, np.uint8)  # not a number where nothing was written

    def host_memory(self, nbytes):
        return np.full(nbytes, 255, np.uint8)

    def upload(self, buffer, values, begin=0):
        buffer[values.itemsize * begin :][: values.nbytes] = values.reshape(-1).view(np.uint8)

    def download(self, buffer, begin, count):
        return buffer[8 * begin : 8 * (begin + count)].view(np.float64).copy()

    def program(self, launches):
        return lambda: [self.launch(kernel, groups, *arguments) for kernel, groups, arguments in launches]

    def launch(self, kernel, groups, *arguments):
        kinds = {np.float64: ctypes.c_double, np.uint32: ctypes.c_uint32}
        passed = [
            ctypes.c_void_p(a.ctypes.data) if isinstance(a, np.ndarray) else kinds[type(a)](a)
            for a in arguments
        ]
        for group in range(groups):
            self.library.place(ctypes.c_uint32(group), ctypes.c_uint32(groups))
            getattr(self.library, kernel)(*passed)


def compiled(folder):
    """A `Host`, built in a folder."""
    compiler = shutil.which("c++") or shutil.which("g++")
    if compiler is None:
        pytest.skip("no C++ compiler")
    (folder / "kernels.cl").write_text(backend.source())
    (folder / "host.cpp").write_text(HOST)
    library = folder / "host.so"
    options = [
        "-std=c++11",
        "-O1",
        "-ffp-contract=off",
        "-shared",
        "-fPIC",
        "-Wall",
        "-Wextra",
        "-Wno-unused-parameter",
        "-Werror",
    ]
    subprocess.run([compiler, *options, "-o", str(library), str(folder / "host.cpp")], check=True)
    return Host(ctypes.CDLL(str(library)))
