"""The C++ library in the project of another: the same digits as in Python, and no Python needed."""

import os
import re
import shutil
import subprocess
import sys

import amontons
import pytest


def run(*command, **options):
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True, **options)
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]
    return done.stdout


def configure(project, build, prefix, tools):
    """Configures and builds a project against the installed library."""
    options = (f"-DCMAKE_PREFIX_PATH={prefix}", "-DCMAKE_BUILD_TYPE=Release")
    run("cmake", "-S", project, "-B", build, *options, env=tools)
    run("cmake", "--build", build, env=tools)


@pytest.fixture
def tools(tmp_path):
    """An environment in which cmake and a compiler are found, but no Python."""
    folder = tmp_path / "bin"
    folder.mkdir()
    names = ("cmake", "ninja", "make", "c++", "g++", "gcc", "cc", "ld", "as", "ar", "ranlib", "sh", "uname")
    found = [name for name in names if shutil.which(name)]
    if "cmake" not in found or "c++" not in found:
        pytest.skip("no cmake or no c++ on the path")
    for name in found:
        (folder / name).symlink_to(shutil.which(name))
    return {"PATH": str(folder), "HOME": str(tmp_path)}


@pytest.fixture
def prefix(root, tmp_path, tools):
    """The library as cmake installs it, from the build of the Python package."""
    build = root / "build" / "python"
    if not (build / "cmake_install.cmake").exists():
        pytest.skip("build/python is not there: make install")
    run("cmake", "--install", build, "--component", "development", "--prefix", tmp_path / "prefix", env=tools)
    return tmp_path / "prefix"


# Breaks when find_package, the installed headers or the library lack something, when installing asks for
# Python, or when C++ and Python do not do the same: every digit is compared.
def test_same_scene_in_both_languages(root, tmp_path, tools, prefix):
    build = tmp_path / "build"
    example = root / "examples" / "cpp"
    configure(example, build, prefix, tools)
    in_cpp = run(build / "knock")
    in_python = run(sys.executable, example / "knock.py", env={**os.environ, "PYTHONWARNINGS": "error"})
    assert in_cpp == in_python
    assert in_cpp.count("\n") == 10


# Breaks when the first program of a user does not compile against the installed library, when a name, a ray
# or a contact of it finds nothing, or when the model that Python writes does not come to C++.
def test_first_hour(root, tmp_path, tools, prefix):
    pytest.importorskip("mujoco")
    example = root / "examples" / "first_hour" / "cpp_loop"
    assert len((example / "cpp_loop.cpp").read_text().splitlines()) < 60
    amontons.write_model(amontons.load_model(root / "examples" / "models" / "arm.xml"), tmp_path / "arm.json")
    configure(example, tmp_path / "build", prefix, tools)
    said = run(tmp_path / "build" / "cpp_loop", tmp_path / "arm.json")
    assert "the pusher meets the box" in said
    assert "the box stands 0.300 m before the wall" in said
    assert "the hand touches the floor" in said
    broken = tmp_path / "broken.json"
    broken.write_text(re.sub(r'"mass":[0-9.]+', '"mass": "heavy"', (tmp_path / "arm.json").read_text()))
    done = subprocess.run([tmp_path / "build" / "cpp_loop", broken], capture_output=True, text=True)
    assert done.returncode == 2
    assert f"{broken}: bodies[0].mass: give a number" in done.stderr


# Breaks when the library alone cannot be configured where there is no Python, or looks for one.
def test_configured_without_python(root, tmp_path, tools):
    import importlib.metadata

    assert shutil.which("python3", path=tools["PATH"]) is None
    eigen = importlib.metadata.distribution("cmeel-eigen").locate_file("cmeel.prefix")
    build = tmp_path / "build"
    run("cmake", "-S", root, "-B", build, f"-DCMAKE_PREFIX_PATH={eigen}", env=tools)
    cache = (build / "CMakeCache.txt").read_text()
    assert "Python_EXECUTABLE" not in cache
    assert "nanobind" not in cache
