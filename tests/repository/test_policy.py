"""tools/check_policy.py sees tuned numbers outside policy.hpp, and constants without a reason."""

import subprocess
import sys

import check_policy
import pytest

ROOM = "solvers/choice"
POLICY = """\
#pragma once
namespace amontons::policy {
// Rows of an island (1): above them a dense factorisation costs more than a sweep, benchmarks/steps.py.
inline constexpr std::size_t most_rows = 180;
inline constexpr double growth = 0.25;  // growth of a turn (1): doubles the work in three turns
struct Policy {
  // Looks ahead (count): grains of a hopper overlap less. Off: 1.
  int most_looks = 4;
};
}
"""
NAMES = """\
constinit Policy policy;
bool named = name_policy("choice", {{"most_looks", &policy.most_looks}});
"""
SOURCE = """\
#include "policy.hpp"
constexpr double half = 0.5, none = 0.0;
constexpr std::size_t width = 3;
std::array<double, 36> block(double (&w)[36]) {
  // A comment may hold 1e-9 and 400, and so may "text 1e-9".
  const double root = std::sqrt(b * b - 4 * a * c) + x[17];
  say("at most 1e-9 of 400");
  return 1e9 * seconds;  // not tuned: nanoseconds per second
}
"""


def look(folder, files, limit=80, rooms=(ROOM,)):
    for name, text in {"policy.hpp": POLICY, "policy.cpp": NAMES, "order.cpp": SOURCE, **files}.items():
        path = folder / "src" / ROOM / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    return check_policy.violations(folder, rooms, limit)


# Breaks when the checker refuses numbers that are sizes, formulas or units, or constants with a reason.
def test_named_numbers_with_reasons_pass(tmp_path):
    assert look(tmp_path, {}) == []


# Breaks when a tuned number of that kind is overlooked in a source or a header, or its line is wrong.
@pytest.mark.parametrize(
    ("line", "literal"),
    [
        ("constexpr double share = 0.9;", "0.9"),
        ("constexpr std::size_t most = 5'000;", "5'000"),
        ("static constexpr Limits limits{20, 2, 0};", "20"),
        ("const double left = 1e-9 * deadline;", "1e-9"),
        ("  if (rows > 180) return;", "180"),
        ("  if (rows < 180 && bodies > 3) return;", "180"),
        ("  unsigned most = 4;", "4"),
        ("  Contender c{.first_turn = 8};", "8"),
        ("  return 2 + 44U * rows;", "44U"),
    ],
)
@pytest.mark.parametrize("file", ["automatic.cpp", "automatic.hpp"])
def test_tuned_number_elsewhere_is_found(tmp_path, file, line, literal):
    (fault,) = look(tmp_path, {file: f"// first\n\n{line}\n"})
    assert fault.startswith(f"src/{ROOM}/{file}:3: {literal.removesuffix('U')}")


# Breaks when a header that is installed is left out.
def test_public_headers_belong_to_the_room(tmp_path):
    path = tmp_path / "include" / "amontons" / ROOM / "automatic.hpp"
    path.parent.mkdir(parents=True)
    path.write_text("double share = 0.9;\n")
    (fault,) = look(tmp_path, {})
    assert fault.startswith(f"include/amontons/{ROOM}/automatic.hpp:1: 0.9")


# Breaks when a constant needs no comment, one without a unit or a reason will do, or one comment serves two.
@pytest.mark.parametrize(
    ("lines", "message"),
    [
        ("constexpr double lead = 4;", "the comment of lead must be"),
        ("// How far it is ahead.\nconstexpr double lead = 4;", "the comment of lead must be"),
        ("// lead (1):\nconstexpr double lead = 4;", "the comment of lead must be"),
        ("// lead: ties are 3 s apart\nconstexpr double lead = 4;", "the comment of lead must be"),
        ("// lead (s): ties\nconstexpr double lead = 4;\n\nconstexpr int k = 5;", "the comment of k must be"),
        ("// lead (s): ties\nconstexpr double lead = 4, other = 5;", "declares several constants"),
        ("struct Policy {\n  // How far.\n  int most_looks = 4;\n};", "the comment of most_looks"),
        ("struct Policy {\n  // lead (s): ties\n  double lead = 0.5;\n};", "lead is not named in"),
    ],
)
def test_constant_without_a_reason_is_found(tmp_path, lines, message):
    (fault,) = look(tmp_path, {"policy.hpp": f"{lines}\n"})
    assert message in fault


# Breaks when many numbers hide in one declaration, or the limit does not count those of policy.hpp.
def test_limit_counts_every_literal(tmp_path):
    costs = "// costs (ns): measured by benchmarks/steps.py\nconstexpr Costs costs{60, 70.0, 22, 1};\n"
    assert look(tmp_path, {"policy.hpp": costs}, limit=3) == []
    assert look(tmp_path, {"policy.hpp": costs}, limit=2) == [f"3 tuned numbers in {ROOM}; at most 2"]


# Breaks when a field of struct Policy is not seen, or the value that switches it off is not read.
def test_fields_are_numbers_that_may_have_a_neutral_value(tmp_path):
    assert look(tmp_path, {}) == []
    constants = check_policy.look(tmp_path, ROOM).constants
    assert [(c.name, c.numbers, c.off) for c in constants if c.field] == [("most_looks", 1, 1.0)]


# Breaks when a room that was renamed is silently no longer checked.
def test_room_that_does_not_exist_is_told(tmp_path):
    (fault,) = look(tmp_path, {}, rooms=(ROOM, "solvers/gone"))
    assert "ROOMS lists solvers/gone, which does not exist" in fault


# Breaks when `--count` of the real sources fails, or a room of the table is gone.
def test_count_lists_every_room(root):
    command = [sys.executable, root / "tools" / "check_policy.py", "--count"]
    shown = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    for room in check_policy.ROOMS:
        assert f"{room}: " in shown
        assert (root / "src" / room).is_dir(), room
