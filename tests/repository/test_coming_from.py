"""The tables of docs/coming-from.md: the names of amontons and of MuJoCo that they give exist."""

import inspect
import re

import amontons
import pytest
from amontons import Material, Model, ModelBuilder, Motor, Simulation

CODE = re.compile(r"`([^`]+)`")
# What a name stands for in the tables, and where it is looked up.
OURS = {
    "simulation": Simulation,
    "kinematics": amontons.results.Kinematics,
    "forces": amontons.results.Forces,
    "builder": ModelBuilder,
    "Model": Model,
    "amontons": amontons,
    "shapes": amontons.shapes,
    "problem": amontons.vi.Problem,
}
CALLED = {"Simulation": Simulation, "ModelBuilder": ModelBuilder, "Material": Material, "Motor": Motor}


def rows(root, engine):
    """(theirs, ours) of the table under a heading, header left out."""
    text = (root / "docs" / "coming-from.md").read_text()
    section = re.search(rf"^## {engine}\n(.*?)(?=^## |\Z)", text, re.MULTILINE | re.DOTALL).group(1)
    lines = [line.strip("|").split(" | ") for line in section.splitlines() if line.startswith("| ")]
    return [(left, right) for left, right in lines[1:]]


def engines(root):
    return re.findall(r"^## (.+)$", (root / "docs" / "coming-from.md").read_text(), re.MULTILINE)


def keywords(code):
    """(function, its keywords) of calls such as Material(friction=, mass=)."""
    for name, inside in re.findall(r"([\w.]+)\(([^()]*)\)", code):
        yield name, re.findall(r"(\w+)=", inside)


def check_keywords(name, given):
    last = name.split(".")[-1]
    places = (ModelBuilder, amontons.parts, amontons.vi, *OURS.values())
    callee = CALLED.get(last) or next(
        (getattr(place, last) for place in places if hasattr(place, last)), None
    )
    assert callee is not None, name
    parameters = inspect.signature(callee).parameters
    open_ended = any(p.kind is p.VAR_KEYWORD for p in parameters.values())
    for keyword in given:
        assert open_ended or keyword in parameters, f"{name} has no {keyword}"


# Breaks when a name of ours in the tables is not there: renamed, misspelt, never written.
def test_our_names_exist(root):
    for engine in engines(root):
        for _, right in rows(root, engine):
            for code in CODE.findall(right):
                for owner, name in re.findall(r"\b([A-Za-z]+)\.(?=(\w+))", code):
                    if owner in OURS and name != "gym":  # a package of its own
                        assert hasattr(OURS[owner], name), f"{engine}: {code}"
                for name in re.findall(r"(?<![.\w])(add_\w+)", code):
                    assert hasattr(ModelBuilder, name), f"{engine}: {code}"
                for name, given in keywords(code):
                    check_keywords(name, given)


# Breaks when the table names something that MuJoCo does not have.
def test_names_of_mujoco_exist(root):
    mujoco = pytest.importorskip("mujoco")
    model = mujoco.MjModel.from_xml_string("<mujoco/>")
    data = mujoco.MjData(model)
    checked = 0
    for left, _ in rows(root, "MuJoCo"):
        for code in CODE.findall(left):
            for path in re.findall(r"\b((?:mujoco|data|model)(?:\.\w+)+)", code):
                owner, *names = path.split(".")
                thing = {"mujoco": mujoco, "data": data, "model": model}[owner]
                if names[0] == "rollout":  # a module of the full package
                    continue
                for name in names:
                    thing = getattr(thing, name)
                checked += 1
    assert checked > 25
