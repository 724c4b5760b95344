"""P-SPG-FB, APGD and the search for pairs on devices: kernels for OpenCL and CUDA.

A leaf of the package: `problem` and `simulation` reach it by the hooks `source_of_name` and `search_of_name`
alone. pyopencl or CuPy are imported with the first use of a device.
"""

from .backend import Device as Device
from .found import devices as devices

__all__ = ["Device", "devices"]
