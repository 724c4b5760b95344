"""The public names: how many there are, and that those of earlier versions say where they are now."""

import re
import subprocess
import sys

import amontons
import pytest
from core_room import EXTRAS, LIBRARIES

DOORS = (amontons.vi, amontons.parts, amontons.results)
# What `simulation.NAME` is now a member of, by the table of CHANGELOG.md.
PARTS = {"kinematics": amontons.results.Kinematics, "forces": amontons.results.Forces}


@pytest.fixture(scope="module")
def simulation():
    return amontons.Simulation(amontons.scenes.stack(boxes=1))


def moved(text):
    """(before, now) of all names of the rows `place.X` for X = ..."""
    for owner, names, now in re.findall(
        r"^\| `([\w.]+)\.X` for X = ([^|]+) \| `([\w.]+)\.X` \|$", text, re.M
    ):
        for name in re.findall(r"`(\w+)`", names):
            yield f"{owner}.{name}", f"{now}.{name}"


# Breaks when the package shows more than people who simulate need: all else has modules of its own.
def test_few_names():
    assert len(amontons.__all__) == len(set(amontons.__all__)) <= 50
    assert dir(amontons) == sorted(amontons.__all__)


# What makes derivatives, loads and poses for goals: most programs do without.
ANALYSES = {f"amontons.simulation.{name}" for name in ("derivative", "loads", "inverse_kinematics", "tape")}


# Breaks when `import amontons` loads more than the engine, or an extra does not load when it is used.
def test_extras_load_late():
    code = (
        "import sys, amontons; print(*sys.modules); "
        "[getattr(door, name) for door in (amontons, amontons.vi, amontons.results) for name in door.__all__]"
    )
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    late = ANALYSES | {f"amontons.{name}" for name in EXTRAS} | {*LIBRARIES, "scipy", "importlib.metadata"}
    assert not late & set(run.stdout.split())


# Breaks when Simulation grows again: what tells of poses or forces belongs to one of its two parts.
def test_few_members(simulation):
    members = [name for name in dir(simulation) if not name.startswith("_")]
    assert len(members) <= 35, members


# Breaks when a name is public in two places, so that programs and documents differ in which they take.
def test_one_place_for_a_name():
    shown = [name for door in (amontons, *DOORS) for name in door.__all__]
    assert len(shown) == len(set(shown))
    own = {name for name in dir(amontons.Simulation) if not name.startswith("_")}
    for part in PARTS.values():
        assert not own & set(dir(part))


# Breaks when a name that moved is only missing, or the error sends its reader to a place where it is not.
def test_names_that_moved(root, simulation):
    table = dict(moved((root / "CHANGELOG.md").read_text()))
    assert len(table) > 80
    with pytest.raises(AttributeError, match=r"now amontons\.view\(simulation\)"):
        simulation.view  # noqa: B018
    for before, now in table.items():
        owner, _, name = before.partition(".")
        place = now.split(".")[-2]
        if owner == "amontons":
            assert name in getattr(amontons, place).__all__
            with pytest.raises(ImportError, match=f"^{before} is now {now}$"):
                getattr(amontons, name)
            with pytest.raises(ImportError, match=f"^{before} is now {now}$"):
                exec(f"from amontons import {name}", {})
        else:
            assert hasattr(PARTS[place], name)
            with pytest.raises(AttributeError, match=f"^{before} is now {now}$"):
                getattr(simulation, name)


# Breaks when names that never were are answered by something else than the usual error, or hasattr raises.
def test_unknown_names(simulation):
    assert not hasattr(amontons, "nothing")
    assert not hasattr(simulation, "nothing")
    with pytest.raises(AttributeError, match=r"no attribute 'contcts' \(did you mean 'contacts'\?\)"):
        simulation.contcts  # noqa: B018


# Breaks when a part keeps showing what its simulation was before its options or its model changed.
def test_parts_follow_their_simulation(simulation):
    forces = simulation.forces
    simulation.step()
    simulation.change_options(dt=1e-3)
    simulation.step()
    assert forces.instant.time == simulation.time - 1e-3
    assert "Forces of amontons.Simulation" in repr(forces)
