"""amontons.examples: the files that come with the package."""

import amontons
import pytest
from amontons import examples


# Breaks when a file is missing, cannot be read, or a wrong name is not answered by the right one.
def test_examples_are_read():
    pytest.importorskip("mujoco")
    for name in examples.names():
        if name.endswith(".obj"):
            assert amontons.studies.read_assembly(examples.path(name)).blocks
        elif name.endswith(".hdf5"):
            assert len(amontons.vi.read_problem(examples.path(name)).b)
        else:
            floating = {"floating_base": True} if name.endswith(".urdf") else {}
            assert amontons.load_model(examples.path(name), **floating).bodies
    with pytest.raises(amontons.InputError, match=r"unknown example 'arms.xml' \(did you mean 'arm.xml'\?\)"):
        examples.path("arms.xml")


# Breaks when the clone and an installed package have different files.
def test_files_are_those_of_the_clone(root):
    kinds = (root / "examples" / kind for kind in ("models", "problems", "assemblies"))
    assert {p.name for kind in kinds for p in kind.iterdir()} == set(examples.names())
