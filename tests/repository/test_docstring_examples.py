"""Examples in docstrings: every public class and function has one, and all of them hold."""

import doctest
import importlib.util
import inspect
import warnings

import amontons
import check_docs
import pytest

START = "import numpy as np\nimport amontons\nfrom amontons import *\nfrom amontons import gym"
"""what docs/reference/index.md says that examples begin with"""
NEEDS = {"load_model(": "mujoco", "sweep(": "pyarrow", "gym.": "mujoco"}
EXCEPT = {"amontons.view"}  # it serves a page until it is closed


def documented():
    """Name -> every public class, function and method with an example."""
    named = check_docs.public_names()
    named |= {f"amontons.shapes.{name}": value for name, value in vars(amontons.shapes).items()
              if inspect.isclass(value) and name in amontons.shapes._KINDS}  # fmt: skip
    if importlib.util.find_spec("gymnasium"):
        from amontons import gym

        named |= {f"amontons.gym.{name}": getattr(gym, name) for name in gym.__all__}
    methods = {
        f"{name}.{method}": value
        for name, thing in named.items()
        if inspect.isclass(thing)
        for method, value in inspect.getmembers(thing, inspect.isfunction)
        if not method.startswith("_") and ">>>" in (value.__doc__ or "")
    }
    return named, methods


NAMED, METHODS = documented()
EXAMPLES = sorted(name for name, thing in {**NAMED, **METHODS}.items() if ">>>" in (thing.__doc__ or ""))


# Breaks when a public class or function has no example.
def test_public_names_have_examples():
    wanted = {name for name, thing in NAMED.items() if inspect.isclass(thing) or inspect.isfunction(thing)}
    assert wanted - set(EXAMPLES) - EXCEPT == set()
    assert len(METHODS) > 12


# Breaks when the reference promises another beginning of examples than the one they have here.
def test_reference_tells_the_beginning(root):
    assert START in (root / "docs" / "reference" / "index.md").read_text()


# Breaks when an example raises, prints something else, or depends on what another one made.
@pytest.mark.parametrize("name", EXAMPLES)
def test_example_holds(name, tmp_path, monkeypatch):
    text = {**NAMED, **METHODS}[name].__doc__
    for call, package in NEEDS.items():
        if call in text:
            pytest.importorskip(package)
    monkeypatch.chdir(tmp_path)
    names = {}
    exec(START if "gym." in text else START.rpartition("\n")[0], names)
    example = doctest.DocTestParser().get_doctest(inspect.cleandoc(text), names, name, None, None)
    said = []
    with warnings.catch_warnings(action="ignore", category=amontons.UnsupportedWarning):
        doctest.DocTestRunner(optionflags=doctest.NORMALIZE_WHITESPACE).run(example, out=said.append)
    assert not said, "".join(said)
