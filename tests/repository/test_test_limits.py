"""What conftest.py and pyproject.toml promise of every test: a hang is a failure that names its test."""

import subprocess
import sys

from waiting import LONGEST

HANGS = """
import threading, time
def sleeps():
    time.sleep(600)
def test_hangs():
    thread = threading.Thread(target=sleeps, daemon=True)
    thread.start()
    thread.join()
"""


# Breaks when a test that hangs holds up the run, is not named, or the stack of one of its threads is lost.
def test_a_hang_is_a_failure(root, tmp_path):
    (tmp_path / "test_it.py").write_text(HANGS)
    limits = ["--timeout", "4", "-o", "faulthandler_timeout=2", "-n", "1"]
    command = [sys.executable, "-m", "pytest", "-c", root / "pyproject.toml", *limits, tmp_path]
    result = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=LONGEST)
    assert result.returncode == 1
    assert "crashed while running" in result.stdout
    assert "test_it.py::test_hangs" in result.stdout
    assert "in sleeps" in result.stderr
    assert "in test_hangs" in result.stderr
