"""P-SPG-FB and APGD on devices: the passes as kernels for OpenCL and CUDA.

A leaf of the package: `problem` and `simulation` reach it by the hook `source_of_name` alone. pyopencl or
CuPy are imported with the first use of a device.
"""

from .backend import Device as Device
from .found import devices as devices

__all__ = ["Device", "devices"]
