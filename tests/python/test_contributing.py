"""Instructions for contributors name what exists: files, entries, make targets, hooks, one version."""

import re
import subprocess


def make(root, *arguments):
    return subprocess.run(["make", "-n", *arguments], cwd=root, capture_output=True, text=True)


# Breaks when a worked example names a file or an entry that was renamed or moved.
def test_worked_examples_name_real_entries(root):
    rows = re.findall(
        r"^\| `([^`]+)` \| `([^`]+)` \|", (root / "docs/extending.md").read_text(), re.MULTILINE
    )
    assert len(rows) > 40
    wrong = [(path, entry) for path, entry in rows if entry not in (root / path).read_text()]
    assert wrong == []


# Breaks when `make quick` overlooks a matching file of either language, or a room of the documents has none.
def test_quick_finds_the_tests_of_a_room(root):
    shown = make(root, "quick", "ROOM=joint").stdout
    for name in ("test_joints", "test_joint_forces", "tests/physics/test_joints_physics.py"):
        assert name in shown
    text = (root / "docs/extending.md").read_text() + (root / "CONTRIBUTING.md").read_text()
    rooms = {room for match in re.findall(r'ROOM=(\w+|"[^"]*")', text) for room in match.strip('"').split()}
    assert {"joint", "shapes", "solvers", "friction", "convex"} <= rooms
    for room in rooms:
        assert list(root.glob(f"tests/cpp/test_*{room}*.cpp")), room


# Breaks when a room without tests passes silently.
def test_quick_refuses_an_unknown_room(root):
    run = subprocess.run(["make", "quick", "ROOM=nosuch"], cwd=root, capture_output=True, text=True)
    assert run.returncode == 2
    assert "ROOM=nosuch" in run.stderr
