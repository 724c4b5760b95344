"""Instructions for contributors name what exists: files, entries, make targets, hooks, one version."""

import json
import re
import subprocess
import tomllib

import pytest


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


def version(root):
    return tomllib.loads((root / "pyproject.toml").read_text())["project"]["version"]


# Breaks when a release changes the version in pyproject.toml alone: these files repeat it.
def test_one_version(root):
    number = version(root)
    assert re.search(r"^version: (.*)$", (root / "CITATION.cff").read_text(), re.MULTILINE)[1] == number
    assert re.search(r"^amontons +([\d.]+)$", (root / "docs/cli.md").read_text(), re.MULTILINE)[1] == number
    assert f"## [{number}]" in (root / "CHANGELOG.md").read_text()
    cmake = (root / "CMakeLists.txt").read_text()
    assert "project(amontons VERSION ${version}" in cmake
    assert number not in cmake


# Breaks when the citation is no valid file, or loses the paper of the method.
def test_citation(root):
    yaml = pytest.importorskip("yaml")
    citation = yaml.safe_load((root / "CITATION.cff").read_text())
    assert citation["cff-version"] == "1.2.0"
    assert {"message", "title", "authors", "version"} <= citation.keys()
    (paper,) = citation["references"]
    assert paper["authors"][0]["family-names"] == "Tasora"
    said = " ".join((root / "src/solvers/companions/spg_literal.cpp").read_text().replace("//", " ").split())
    assert f'"{paper["title"]}"' in said


# Breaks when a check of `make lint` has no hook, or a hook calls a tool that is gone.
def test_hooks_are_those_of_lint(root):
    yaml = pytest.importorskip("yaml")
    (repository,) = yaml.safe_load((root / ".pre-commit-config.yaml").read_text())["repos"]
    entries = " ".join(hook["entry"] for hook in repository["hooks"])
    checks = re.search(r"^CHECKS := (.*)$", (root / "Makefile").read_text(), re.MULTILINE)[1].split()
    assert set(re.findall(r"tools/(\w+)\.py", entries)) == set(checks)
    assert "clang-format" in entries
    assert "ruff format" in entries
    for check in checks:
        assert (root / f"tools/{check}.py").is_file()


# Breaks when a template or the development container is no valid file, or names a target that make lacks.
def test_templates_and_container(root):
    yaml = pytest.importorskip("yaml")
    for path in root.glob(".github/ISSUE_TEMPLATE/*.yml"):
        form = yaml.safe_load(path.read_text())
        if path.name != "config.yml":
            assert {"name", "description", "body"} <= form.keys(), path
            assert {"textarea"} <= {part["type"] for part in form["body"]}, path
    container = json.loads((root / ".devcontainer/devcontainer.json").read_text())
    assert (root / ".devcontainer" / container["build"]["dockerfile"]).is_file()
    text = (root / ".github/pull_request_template.md").read_text() + container["postCreateCommand"]
    for target in re.findall(r"\bmake (\w+)", text):
        assert re.search(rf"^{target}:", (root / "Makefile").read_text(), re.MULTILINE), target


# Breaks when a decision lacks a part, or names a test, benchmark or tool that is gone.
def test_decisions_are_records(root):
    pages = [page.read_text() for page in (root / "docs/decisions").glob("*.md")]
    records = [record for page in pages for record in re.split(r"^## ", page, flags=re.MULTILINE)[1:]]
    assert len(records) > 30
    tests = [p for kind in ("cpp", "py") for p in (root / "tests").rglob(f"test_*.{kind}")]
    sources = "\n".join(p.read_text() for p in tests)
    files = {p.stem for p in tests}
    for record in records:
        parts = re.findall(r"^- \*([A-Z][a-z ]+)\*: \S", record, re.MULTILINE)
        assert parts == ["Context", "Decision", "Consequence", "Measured by"], record
        for name in re.findall(r"`(test_\w+|[a-z]+(?:_[a-z]+){2,})`", record.partition("*Measured by*")[2]):
            assert name in files or re.search(rf"(def |TEST\(){name}\(?", sources), name
