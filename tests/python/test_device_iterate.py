"""Iterates from outside: the protocol, and the reference in NumPy, against those of the compiled module."""

import amontons
import numpy as np
import pytest
from amontons.device import NumpyIterate

from device_problems import NAMES, compare_to_cpu, problems

METHODS = ("p-spg-fb", "apgd")
LAWS = ("associated", "coulomb")


# Breaks when a pass of NumPy, the layout or the way through the binding means something else than in C++.
@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("name", NAMES)
def test_numpy_is_the_cpu(name, method, law):
    def solve(problem, options):
        return problem.solve(iterate=NumpyIterate(problem, law=law), **options)

    compare_to_cpu(name, method, law, solve)
