"""The checks of style see what they look for; sources are small trees."""

import check_style
import duplicates
import pytest


def tree(folder, files):
    for name, text in files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    return check_style.measure(folder, {})


def cpp_function(lines, branches=0):
    body = ["  if (k) ++k;"] * branches + ["  ++k;"] * (lines - 2 - branches)
    return "\n".join(["void f(int k) {", *body, "}", ""])


def with_comments(text):
    return "// Why.\n" * text.count("\n") + text


# Breaks when an empty tree, or one at the limits, is refused.
def test_tree_at_the_limits_passes(tmp_path):
    faults = tree(
        tmp_path,
        {
            "src/a.cpp": with_comments(cpp_function(70, 19) + cpp_function(3) * 9),
            "python/amontons/a.py": "def f():\n    return 1\n",
        },
    )
    assert faults == []


# Breaks when a limit is not applied, in either language, or the place is not named.
@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("src/a.cpp", with_comments(cpp_function(71)), "src/a.cpp:72: f has 71 lines; at most 70"),
        ("bindings/a.cpp", cpp_function(30, 20), "bindings/a.cpp:1: f has complexity 21; at most 20"),
        (
            "src/a.cpp",
            with_comments("void f(int a, int b, int c, int d, int e, int g, int h) {}\n"),
            "src/a.cpp:2: f has 7 parameters; at most 6",
        ),
        ("include/amontons/a.hpp", with_comments(cpp_function(36)), "C++: a tenth of the functions has"),
        ("python/amontons/a.py", "def f(k):\n" + "    k += 1\n" * 70, "a.py:1: f has 71 lines"),
        ("src/a.cpp", "int k;\n" * 9 + "// Why.\n", "10.0% of the lines are comments; at least 18%: 1 lines"),
    ],
)
def test_limit(tmp_path, name, text, message):
    faults = tree(tmp_path, {name: text})
    assert any(message in fault for fault in faults), faults


# Breaks when functions are overlooked, or && of a reference is a branch: templates, lambdas, members.
def test_functions_of_all_kinds_are_seen(tmp_path):
    path = tmp_path / "a.hpp"
    path.write_text(
        "template <class F>\nrequires true\nvoid a(F&& f, int&& k) {\n  const auto g = [&](auto&& y) {\n"
        "    if (y) return k;\n    return 0;\n  };\n  g(f);\n}\n"
        "struct S {\n  S() : x(1) {\n  }\n  int operator()(int k) const { return k ? 1 : 2; }\n  int x;\n};\n"
    )
    found = {f.name: (f.lines, f.complexity) for f in check_style.functions(tmp_path, [path])}
    assert found == {"a": (7, 2), "S::S": (2, 1), "S::operator ( )": (1, 2)}


# Breaks when a string counts as a comment, a block comment as code, or a trailing one as a line of its own.
def test_comment_lines(tmp_path):
    path = tmp_path / "a.cpp"
    path.write_text('// one\n/* two\n\n   three */\nint a;  // behind\nauto s = "// none";\n\n')
    assert check_style.measure_text([path]) == check_style.Text(code=2, comments=3, trailing=1)


LOOP = "double sum(int n) {\n  double s = 0;\n  for (int i = 0; i < n; ++i)\n    s += a[i];\n"
LOOP += (
    "  if (s > 1) s = 1;\n  const double t = s / n;\n  while (t < s) s -= t;\n  g(s);\n  return h(t, s);\n}\n"
)
SHAPE = LOOP.replace("sum", "total").replace("s ", "w ").replace("a[", "b[").replace("1", "2")


def runs(first, second, suffix=".cpp"):
    lines = {name: duplicates.statements(text, suffix) for name, text in (("a", first), ("b", second))}
    return [(pair.files, pair.first, pair.second) for pair in duplicates.duplicates(lines)]


# Breaks when copies hide behind comments, blank lines, other names or numbers; or within one file.
def test_copies_are_found():
    assert runs(LOOP, LOOP) == [(("a", "b"), (1, 9), (1, 9))]
    assert runs(LOOP, "// Why.\n\n" + SHAPE) == [(("a", "b"), (1, 9), (3, 11))]
    assert runs(LOOP + "int x;\n" + LOOP, "") == [(("a", "a"), (1, 9), (12, 20))]


# Breaks when what merely looks alike is called a copy: five equal lines, a list, includes, braces.
def test_what_is_no_copy():
    assert runs("\n".join(LOOP.split("\n")[:5]), LOOP) == []
    assert runs("f(a, 1);\n" * 3 + "g(b);\n" * 9, "f(c, 2);\n" * 3 + "g(d);\n" * 9) == []
    assert runs("#include <cmath>\n" * 9 + "}\n" * 9, "#include <cmath>\n" * 9 + "}\n" * 9) == []


# Breaks when docstrings count as code, or a string in an expression as a docstring.
def test_python_copies():
    text = '"""Doc\nstring."""\n' + "".join(f"x{k} = f('{k}', [{k}])\ny = x{k} + 2\n" for k in range(3))
    assert runs(text, text, ".py") == [(("a", "b"), (3, 8), (3, 8))]


# Breaks when an excuse hides other files, or stays when nothing needs it any more.
def test_boilerplate(tmp_path):
    pairs = duplicates.duplicates({name: duplicates.statements(LOOP, ".cpp") for name in ("src/a", "src/b")})
    assert len(list(check_style.duplicate_faults(pairs, {}))) == 1
    assert list(check_style.duplicate_faults(pairs, {("src/a", "src/b"): "why"})) == []
    found = list(check_style.duplicate_faults(pairs, {("src/a", "src/c"): "why"}))
    assert "src/a:1-9 and src/b:1-9" in found[0]
    assert "BOILERPLATE lists src/a and src/c, which no longer agree" in found[1]
