"""What is missing to build is told in one line that names the remedy."""

import sys
import sysconfig

import check_environment
import pytest


# Breaks when a complete machine is refused: the tests themselves were built on one.
def test_complete_environment_passes(monkeypatch):
    monkeypatch.setattr(sys, "argv", ["check_environment.py"])
    assert check_environment.main() == 0


def old_python(monkeypatch, folder):
    monkeypatch.setattr(sys, "version_info", (3, 10, 1))


def no_header(monkeypatch, folder):
    monkeypatch.setattr(sysconfig, "get_paths", lambda: {"include": str(folder)})


def no_compiler(monkeypatch, folder):
    monkeypatch.delenv("CXX", raising=False)
    monkeypatch.setenv("PATH", str(folder))


def broken_compiler(monkeypatch, folder):
    monkeypatch.setenv("CXX", sys.executable)


def absent_compiler(monkeypatch, folder):
    monkeypatch.setenv("CXX", str(folder / "c++"))


# Breaks when a missing part is found late, by an error of pip, CMake or the compiler, or told at length.
@pytest.mark.parametrize(
    ("arrange", "message"),
    [
        (old_python, "Python 3.11 or newer is needed"),
        (no_header, "Python.h is missing"),
        (no_compiler, "no C++ compiler found"),
        (broken_compiler, "cannot build C++20"),
        (absent_compiler, "cannot be run"),
    ],
)
def test_what_is_missing_is_told_in_one_line(arrange, message, monkeypatch, tmp_path, capfd):
    monkeypatch.setattr(sys, "argv", ["check_environment.py"])
    arrange(monkeypatch, tmp_path)
    assert check_environment.main() == 1
    told = capfd.readouterr().err
    assert message in told
    assert told.count("\n") == 1


# Breaks when make stops fetching build tools that the system lacks.
def test_missing_build_tools_are_listed(monkeypatch, tmp_path):
    monkeypatch.setenv("PATH", str(tmp_path))
    assert check_environment.missing_build_tools() == ["cmake", "ninja"]
