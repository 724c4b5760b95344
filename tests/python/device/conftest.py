"""For the tests of devices."""

import pytest
from amontons import _core
from amontons.device import found
from amontons.problem.iterate import source_of_name
from host_kernels import compiled
from numpy_iterate import NumpyIterate


@pytest.fixture(scope="session")
def host(tmp_path_factory):
    """The kernels as CUDA C++ on the processor."""
    return compiled(tmp_path_factory.mktemp("cuda"))


@pytest.fixture(autouse=True)
def numpy_device():
    """Lets `device="numpy"` mean the reference in NumPy, which needs no driver."""
    by_name = found._source_of_name

    def source(device, least_contacts):
        if device == "numpy":
            return _core.IterateSource("numpy", NumpyIterate.of_core, True, least_contacts)
        return by_name(device, least_contacts)

    source_of_name.supply(source)
    yield
    source_of_name.supply(by_name)
