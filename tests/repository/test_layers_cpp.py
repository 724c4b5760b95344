"""The C++ half of the layer checker: each rule on a small tree that keeps it but for one file."""

import layers_cpp
import pytest
from cycles import find_cycles

# A tree that keeps all rules: a public and a private pair, a kernel, a door that uses its rooms, Eigen.
GOOD = {
    "include/amontons/base/math.hpp": "#pragma once\n#include <cmath>\n",
    "include/amontons/problem/problem.hpp": '#include "amontons/base/math.hpp"\n',
    "src/problem/problem.cpp": '#include "amontons/problem/problem.hpp"\n#include "problem/check.hpp"\n',
    "src/problem/check.hpp": "",
    "include/amontons/solvers/driver/options.hpp": "#include <amontons/problem/problem.hpp>\n",
    "include/amontons/solvers/krylov/cg.hpp": '#include "amontons/solvers/driver/options.hpp"\n',
    "src/solvers/krylov/cg.cpp": '#include "amontons/solvers/krylov/cg.hpp"\n#include "norm.hpp"\n',
    "src/solvers/krylov/norm.hpp": '#include "solvers/linear/kernel.hpp"\n',
    "src/solvers/linear/kernel.hpp": "",
    "src/solvers/linear/kernel.isa.cpp": '#include "solvers/linear/kernel.hpp"\n#include <Eigen/Core>\n',
    "include/amontons/solvers/solvers.hpp": '#include "amontons/solvers/krylov/cg.hpp"\n',
    "src/multibody/model/model.hpp": '#include "amontons/solvers/solvers.hpp"\n',
}


def faults(folder, files, without_header=()):
    for name, text in files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    return list(layers_cpp.check_cpp(folder, dict.fromkeys(without_header, "a reason")))


def only(folder, name, text, **options):
    """The single fault of the good tree with one file more."""
    found = faults(folder, GOOD | {name: text}, **options)
    assert len(found) == 1, found
    return found[0]


# Breaks when the checker refuses what the rules allow: then every test below finds one fault too many.
def test_good_tree_passes(tmp_path):
    assert faults(tmp_path, GOOD) == []


# Breaks when an include of a later layer passes, through quotes, brackets or a name relative to src.
@pytest.mark.parametrize(
    "line",
    ['#include "amontons/solvers/solvers.hpp"', "#  include <amontons/solvers/krylov/cg.hpp>"],
)
def test_later_layer(tmp_path, line):
    fault = only(tmp_path, "include/amontons/problem/residual.hpp", f"{line}\n")
    assert "problem/residual.hpp: layer problem may not include include/amontons/solvers/" in fault
    assert "move what it needs to problem or below" in fault


# Breaks when rooms have no order: linear stands before krylov.
def test_later_room(tmp_path):
    fault = only(tmp_path, "src/solvers/linear/a.hpp", '#include "solvers/krylov/norm.hpp"\n')
    assert "room linear may not include src/solvers/krylov/norm.hpp of room krylov" in fault


# Breaks when a room reaches every other room of its layer through the door.
def test_room_may_not_use_the_door(tmp_path):
    fault = only(tmp_path, "src/solvers/companions/a.hpp", '#include "amontons/solvers/solvers.hpp"\n')
    assert "is the door of solvers, which no room uses" in fault


# Breaks when a folder that nobody listed counts as a layer or a room: the list would not tell the house.
@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("src/other/a.hpp", "not in a folder of the layer list base, sets"),
        ("src/a.hpp", "not in a folder of the layer list"),
        ("include/amontons/solvers/quick/a.hpp", "solvers has no room quick (but linear, driver"),
        ("src/base/small/a.hpp", "base has no room small (but none at all)"),
    ],
)
def test_unknown_place(tmp_path, name, message):
    assert message in only(tmp_path, name, "")


# Breaks when a later layer looks into the private headers of an earlier one, which the order would allow.
def test_private_header_of_another_layer(tmp_path):
    fault = only(tmp_path, "src/multibody/step/a.hpp", '#include "solvers/linear/kernel.hpp"\n')
    assert "src/solvers/linear/kernel.hpp is private to solvers" in fault
    assert "include/amontons/solvers" in fault


# Breaks when what is no engine reaches behind the headers that are installed.
def test_extras_use_public_headers(tmp_path):
    fault = only(tmp_path, "fmu/x.cpp", '#include "y.hpp"\n#include "problem/check.hpp"\n')
    assert fault.startswith("fmu/x.cpp: problem/check.hpp is not installed")


# Breaks when an installed header includes one that is not installed, if only of its own layer.
def test_public_header_may_not_use_src(tmp_path):
    fault = only(tmp_path, "include/amontons/problem/b.hpp", '#include "problem/check.hpp"\n')
    assert "a public header may not include src/problem/check.hpp" in fault


# Breaks when a source whose functions are declared under another name, or in another room, passes.
def test_source_without_header(tmp_path):
    assert "no header sets/box.hpp declares what it defines" in only(tmp_path, "src/sets/box.cpp", "")
    (tmp_path / "src/sets/box.cpp").unlink()
    fault = only(tmp_path, "src/solvers/choice/cg.cpp", "")
    assert "solvers/krylov/cg.hpp has that name: bring them into one room" in fault


# Breaks when a kernel is asked for a header X.isa.hpp, or passes without X.hpp.
def test_kernel_without_header(tmp_path):
    assert "no header sets/lanes.hpp declares" in only(tmp_path, "src/sets/lanes.isa.cpp", "")
    assert faults(tmp_path, {"src/sets/lanes.hpp": ""}) == []


# Breaks when the table of exceptions is not looked at, or keeps lines that no longer say anything.
def test_table_of_sources_without_header(tmp_path):
    listed = ["src/sets/register.cpp"]
    assert faults(tmp_path, GOOD | {listed[0]: ""}, listed) == []
    assert "WITHOUT_HEADER lists src/sets/register.cpp, which has a header or is gone" in only(
        tmp_path, "src/sets/register.hpp", "", without_header=listed
    )


# Breaks when headers alone are looked at: rows.hpp includes joints.hpp, and joints.cpp rows.hpp.
def test_cycle_through_a_source(tmp_path):
    files = {
        "include/amontons/multibody/joints/joints.hpp": "",
        "src/multibody/joints/joints.cpp": '#include "rows.hpp"\n',
        "src/multibody/joints/rows.hpp": '#include "amontons/multibody/joints/joints.hpp"\n',
    }
    found = faults(tmp_path, GOOD | files)
    assert len(found) == 1
    assert "multibody/joints/joints -> multibody/joints/rows -> multibody/joints/joints" in found[0]
    assert "src/multibody/joints/joints.cpp includes src/multibody/joints/rows.hpp" in found[0]


# Breaks when only the first of two cycles is printed, or a kernel's cycle is not that of its header.
def test_every_cycle_is_printed(tmp_path):
    files = {
        "src/sets/a.hpp": '#include "b.hpp"\n',
        "src/sets/b.hpp": '#include "a.hpp"\n',
        "src/sets/c.isa.cpp": '#include "d.hpp"\n',
        "src/sets/c.hpp": "",
        "src/sets/d.hpp": '#include "c.hpp"\n#include "d.hpp"\n',
    }
    found = faults(tmp_path, GOOD | files)
    assert ["sets/a -> sets/b -> sets/a" in line for line in found] == [True, False, False]
    assert "sets/c -> sets/d -> sets/c" in found[1]
    assert "src/sets/d.hpp -> src/sets/d.hpp" in found[2]


# Breaks when the search calls a diamond a cycle, or stops at the first cycle of a knot.
def test_cycles_of_a_graph():
    assert list(find_cycles({"a": {"b", "c"}, "b": {"d"}, "c": {"d"}})) == []
    assert len(list(find_cycles({"a": {"b"}, "b": {"a", "c"}, "c": {"b"}}))) == 2


# Breaks when a user of the installed library, or of the bindings, would need Eigen or the reader of JSON.
@pytest.mark.parametrize("name", ["include/amontons/sets/e.hpp", "bindings/e.cpp"])
@pytest.mark.parametrize("library", ["Eigen/Dense", "nlohmann/json.hpp"])
def test_libraries_are_for_sources(tmp_path, name, library):
    message = f"<{library}>, which is for sources below src only"
    assert message in only(tmp_path, name, f"#include <{library}>\n")


# Breaks when a name that resolves nowhere is passed over: a moved file would leave the rules.
def test_include_that_is_not_found(tmp_path):
    assert '"gone.hpp" not found' in only(tmp_path, "src/sets/a.hpp", '#include "gone.hpp"\n')
