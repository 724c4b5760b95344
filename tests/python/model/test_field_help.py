"""help(...) of dataclasses: every field with its words."""

import dataclasses
import pydoc

import amontons
import pytest
from amontons.field_help import describe_fields

CLASSES = [amontons.Model, amontons.Motor, amontons.results.Rollout, amontons.results.Reaction]


# Breaks when help of a class leaves out a field that has a docstring, or shows that of its type.
@pytest.mark.parametrize("cls", CLASSES, ids=lambda cls: cls.__name__)
def test_help_names_the_fields(cls):
    printed = pydoc.render_doc(cls, renderer=pydoc.plaintext)
    assert "Built-in immutable sequence" not in printed
    for field in dataclasses.fields(cls):
        if field.init:
            assert f"|  {field.name}: " in printed, field.name


# Breaks when the words of the class itself get lost, or are added twice.
def test_docstring_begins_as_written():
    text = amontons.Motor.__doc__
    assert text.startswith("Drive of one degree of freedom")
    assert text.count("Fields:") == 1
    assert "kp: stiffness of a position motor" in text
    assert amontons.Motor().__doc__ == text


@dataclasses.dataclass
class Plate:
    """A plate."""

    width: float = 1.0
    """width (m)"""
    _hidden: int = 0
    """not shown"""
    colour: str = ""


# Breaks when sources are parsed before somebody asks, which slows the import, or a private field is shown.
def test_sources_are_read_late():
    describe_fields([Plate, int, "no class"])
    text = vars(Plate)["__doc__"]
    assert not text.complete
    assert Plate.__doc__ == "A plate.\n\nFields:\n\nwidth: width (m)"
    assert text.complete
