"""Diagrams are those of the sources: files agree with the tool, changes are noticed, text fits its card."""

import re
import shutil

import cpp_facts
import diagrams
import drawing
import pytest

FILES = (
    "src/multibody/step",
    "src/solvers/choice",
    "src/solvers/direct",
    "include/amontons/multibody/step",
    "include/amontons/solvers/choice",
)
STEP = "src/multibody/step/step.cpp"
REPORT = "include/amontons/multibody/step/report.hpp"
AUTO = "src/solvers/choice/automatic.cpp"


@pytest.fixture
def sources(root, tmp_path):
    """A copy of what the diagrams read, to be changed."""
    for name in FILES:
        shutil.copytree(root / name, tmp_path / name)
    return tmp_path


def change(path, old, new):
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))


# Breaks when the sources or the captions changed and `python tools/diagrams.py` was not run.
@pytest.mark.parametrize("name", diagrams.DIAGRAMS)
def test_committed_diagrams_are_those_of_the_sources(root, name):
    assert (root / "docs/figures" / name).read_text() == diagrams.DIAGRAMS[name](root)
    pages = [root / "ARCHITECTURE.md", *(root / "docs").glob("*.md")]
    assert any(f"figures/{name})" in page.read_text() for page in pages)


# Breaks when the order of the calls is that of the captions and not that of the code, or a number is fixed.
def test_order_and_numbers_follow_the_sources(sources):
    step = sources / "src/multibody/step"
    change(step / "policy.hpp", "most_looks = 4", "most_looks = 7")
    change(
        step / "step.cpp",
        "  const bool corrected = correct(step, ",
        "  move_on(h);\n  const bool corrected = correct(step, ",
    )
    drawn = diagrams.step(sources)
    assert "up to 7 times" in " ".join(re.sub(r"<[^>]*>", " ", drawn).split())
    assert drawn.index("move_on()") < drawn.index("correct()")


# Breaks when a new stage, path or contender, or one that is gone, leaves a diagram as it was.
@pytest.mark.parametrize(
    ("draw", "path", "old", "new", "message"),
    [
        (diagrams.step, STEP, "resolve_impacts(", "resolved(", r"resolve_impacts\(\) has a caption"),
        (diagrams.step, STEP, "look_ahead(", "solve_step(", r"solve_step\(\) is called, but has no caption"),
        (diagrams.step, REPORT, "  accurate,", "  accurate, other,", "StepPath"),
        (diagrams.auto, AUTO, "linear_field(", "other_field(", "contenders"),
        (diagrams.auto, "src/solvers/direct/policy.hpp", "most_rows", "many_rows", "no constant"),
    ],
)
def test_changes_are_noticed(sources, draw, path, old, new, message):
    change(sources / path, old, new)
    with pytest.raises(cpp_facts.Changed, match=message):
        draw(sources)


# Breaks when contenders of auto are missed, or the reason is that of another case.
def test_contenders(root):
    groups = cpp_facts.contenders(root / "src/solvers/choice/automatic.cpp")
    assert {method for members in groups.values() for method, _ in members} >= {"apgd", "newton", "cg"}
    text = (root / "src/solvers/choice/automatic.cpp").read_text()
    assert sum(map(len, groups.values())) == text.count(".start = start_")


# Breaks when text runs out of its card: lines are no longer than the widest usual font allows.
def test_text_fits():
    card = drawing.Card("Title " * 20, "word " * 40, "code() " * 20)
    picture = drawing.Drawing("label")
    picture.card(card, indent=18)
    width = drawing.WIDTH - 2 * drawing.MARGIN - 18 - 2 * drawing.PAD
    for kind, size, line in re.findall(r'class="(\w)".*font-size="([\d.]+)">(.*)</text>', picture.svg()):
        character = drawing.WIDE_CODE if kind == "c" else drawing.WIDE
        assert len(line) * float(size) * character <= width


# Breaks when text is not dark on its card, or a line cannot be seen on a light or a dark page.
def test_contrast():
    def luminance(colour):
        parts = [int(colour[k : k + 2], 16) / 255 for k in (1, 3, 5)]
        linear = [c / 12.92 if c <= 0.03928 else ((c + 0.055) / 1.055) ** 2.4 for c in parts]
        return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]

    def contrast(a, b):
        low, high = sorted((luminance(a), luminance(b)))
        return (high + 0.05) / (low + 0.05)

    for fill in drawing.FILLS.values():
        assert contrast(drawing.FAINT, fill) > 7  # WCAG 2.2, level AAA for text
    for page in ("#ffffff", "#1e2129"):
        assert contrast(drawing.LINE, page) > 3  # for graphics
