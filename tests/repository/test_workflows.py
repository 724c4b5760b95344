"""The workflows in .github, which no machine here runs: their form, targets, versions and limits."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
WORKFLOWS = sorted((ROOT / ".github" / "workflows").glob("*.yml"))
names = [path.stem for path in WORKFLOWS]


def check(path, schema):
    command = [sys.executable, "-m", "check_jsonschema", "--builtin-schema", schema, path]
    return subprocess.run(command, capture_output=True, text=True, check=False)


# Breaks when a key is misspelt or a value has the wrong type, by the schema that GitHub's editors use. The
# second schema asks for a limit of time in each job.
@pytest.mark.parametrize("path", WORKFLOWS, ids=names)
@pytest.mark.parametrize("schema", ["vendor.github-workflows", "custom.github-workflows-require-timeout"])
def test_workflow_follows_the_schema(path, schema):
    pytest.importorskip("check_jsonschema")
    done = check(path, schema)
    assert done.returncode == 0, done.stdout + done.stderr


# Breaks when the check above would pass anything.
def test_schema_refuses_a_misspelt_key(tmp_path):
    pytest.importorskip("check_jsonschema")
    wrong = tmp_path / "wrong.yml"
    wrong.write_text(WORKFLOWS[0].read_text().replace("runs-on:", "run-on:", 1))
    assert check(wrong, "vendor.github-workflows").returncode != 0


# Breaks when a workflow calls a target that the Makefile lacks, or one of the four is called by none.
def test_workflows_call_targets_of_the_makefile():
    made = set(re.findall(r"^([a-z_]+):", (ROOT / "Makefile").read_text(), re.MULTILINE))
    called = {t for path in WORKFLOWS for t in re.findall(r"run: make (\w+)", path.read_text())}
    assert called == {"lint", "test", "docs", "wheels"}
    assert called <= made


# Breaks when an action is taken at a branch or at a moving tag, whose content can change.
@pytest.mark.parametrize("path", WORKFLOWS, ids=names)
def test_actions_are_pinned_by_version(path):
    used = re.findall(r"uses: (\S+)", path.read_text())
    assert used
    for action in used:
        assert re.fullmatch(r"[\w./-]+@(v\d+\.\d+\.\d+|[0-9a-f]{40})", action), action
