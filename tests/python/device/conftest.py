"""For the tests of devices."""

import pytest
from amontons import _core
from amontons.device import found
from amontons.problem.iterate import source_of_name
from amontons.simulation.pairs import search_of_name
from host_kernels import compiled
from numpy_iterate import NumpyIterate


@pytest.fixture(scope="session")
def host(tmp_path_factory):
    """The kernels as CUDA C++ on the processor."""
    return compiled(tmp_path_factory.mktemp("cuda"))


@pytest.fixture(autouse=True)
def numpy_device():
    """Lets `device="numpy"` mean the reference in NumPy, which needs no driver."""
    by_name, search_by_name = found._source_of_name, found._search_of_name

    def source(device, least_contacts):
        if device == "numpy":
            return _core.IterateSource("numpy", NumpyIterate.of_core, True, least_contacts)
        return by_name(device, least_contacts)

    source_of_name.supply(source)
    search_of_name.supply(lambda device, least: None if device == "numpy" else search_by_name(device, least))
    yield
    source_of_name.supply(by_name)
    search_of_name.supply(search_by_name)
