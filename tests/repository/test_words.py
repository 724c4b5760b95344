"""tools/check_words.py finds hard sentences in small planted texts, and passes over what is no sentence."""

import sys

import check_words
import pytest

LONG = "One two three four five six seven eight nine ten " * 3
KINDS = ("long", "start", "idiom")


def found(name, text):
    """Measure -> lines of the hits."""
    hits = check_words.hits(name, text)
    return {kind: [int(hit.place.rpartition(":")[2]) for hit in hits[kind]] for kind in KINDS if hits[kind]}


# Breaks when the first word of a comment is not seen: in a block, behind code, after a full stop, in an item.
@pytest.mark.parametrize(
    ("name", "text", "lines"),
    [
        ("a.cpp", "int a;\n// Of all rows.\n", [2]),
        ("a.hpp", "int a;  // What it holds.\nint b;  // What it held.\n", [1, 2]),
        ("a.cpp", "// Rows are few.\n// Of these one\n// is free. What remains is closed.\n", [1, 1]),
        ("a.cpp", "// Cases:\n// - Of rows.\n// - What rows do.\n", [2, 3]),
        ("a.py", '"""What it does."""\nx = 1\n"""Of a row, N s."""\n', [1, 3]),
        ("a.py", "x = 1  # What it is.\n# Of rows.\n", [1, 2]),
        ("a.py", 'option(help="Of rows. "\n  "What they are.", n=1)\n', [1, 1]),
        ("a.md", "# Title\n\nOf rows.\nWhat is open is none.\n\n| Of a | b |\n", [6, 3, 3]),
    ],
)
def test_start(name, text, lines):
    assert found(name, text)["start"] == lines


# Breaks when code, strings, headings, questions, links or words inside a sentence count as a start.
@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("a.cpp", 'say("// Of rows");\n// Rows of what moves.\n// What is a row?\n// Often. Whatever.\n'),
        ("a.py", '"""Rows.\n\n>>> f(1)\nOf 3\n"""\n'),
        ("a.py", 'f("Of rows")\nx = ["What rows"]\nof = """\nOf rows."""\n'),
        (
            "a.md",
            "# What a step does\n\n```sh\nOf code.\n```\n\nWhat is `x`? See [What a step does](a.md).\n",
        ),
        ("a.md", "<!-- Of notes -->\n`Of` is code. [Of rows](a.md)\n"),
    ],
)
def test_no_start(name, text):
    assert "start" not in found(name, text)


# Breaks when the limit is not 30 words, a sentence does not end at its stop, its paragraph, item or cell, or
# signs count as words.
@pytest.mark.parametrize(
    ("text", "count"),
    [
        (LONG, 0),
        (LONG + "end.", 1),
        (LONG + "= + - e.g. end.", 1),
        (LONG + "= + - .", 0),
        (LONG.strip() + ". End.", 0),
        (LONG + "\n\nend.", 0),
        (LONG + "\n- end.", 0),
        (f"| {LONG} | end. |", 0),
        (LONG + "`one two three`.", 1),
        (LONG.replace("One", "`one two three`"), 0),
    ],
)
def test_long(text, count):
    assert len(check_words.hits("a.md", text + "\n")["long"]) == count


# Breaks when a sentence that goes over several lines of a comment or a docstring is not put together.
def test_long_over_lines():
    words = LONG.split()
    assert found("a.cpp", "int k;\n" + "".join(f"// {w}\n" for w in [*words, "end."])) == {"long": [2]}
    assert found("a.py", 'def f():\n    """' + "\n    ".join([*words, "end."]) + '"""\n') == {"long": [2]}


# Breaks when a phrase of the list is overlooked, or a plain one that resembles it is found.
def test_idiom():
    text = "The user is told. It has the last word. Three ways. None are free. To mend it in a hurry.\n"
    phrases = [hit.text.split('"')[1] for hit in check_words.hits("a.md", text)["idiom"]]
    assert phrases == ["is told", "has the last word", "ways", "None are", "mend", "in a hurry"]
    assert found("a.md", "Two ways to a solution. There are none. Defaults are None. Always amend.\n") == {}


def counts(number):
    return {"core": dict.fromkeys(KINDS, number)}


# Breaks when a count above its limit passes, or `--lower` raises a limit.
def test_limits_only_fall(tmp_path):
    path = tmp_path / "limits.csv"
    check_words.lower(path, counts(5))
    (fault, *_) = check_words.faults(counts(6), check_words.read_limits(path))
    assert fault.startswith("core: 6 x long, at most 5")
    assert list(check_words.faults(counts(5), check_words.read_limits(path))) == []
    check_words.lower(path, counts(9))
    assert check_words.read_limits(path) == counts(5)
    check_words.lower(path, counts(2))
    assert path.read_text() == "part,long,start,idiom\ncore,2,2,2\n"


# Breaks when a part of the table has no files, no limits, or `--list` says something else than the table.
def test_real_sources(root, monkeypatch, capsys):
    table, limits = check_words.measure(root), check_words.read_limits(root / check_words.LIMITS)
    assert limits.keys() == table.keys() == check_words.PARTS.keys()
    monkeypatch.setattr(check_words, "measure", lambda _: table)
    monkeypatch.setattr(sys, "argv", ["check_words.py", "--list", "core", "long"])
    assert check_words.main() == 0
    assert capsys.readouterr().out.count("\n") == max(1, len(table["core"]["long"]))
