"""Tells in one line what is missing to build amontons: run by make before anything else.

Written for any Python 3, standard library only, because it must be able to tell that Python is too old.
With --build-tools it prints the build tools (cmake, ninja) that the system lacks, for pip to install; with
--compiler the C++ compiler to use.
"""

import os
import re
import shutil
import subprocess
import sys
import sysconfig
import tempfile

PYTHON = (3, 11)
CMAKE = (3, 22)
CXX20 = "#include <concepts>\n#include <span>\nint main() { return std::span<int>{}.size(); }\n"


def python_problem():
    version = sys.version_info[:2]
    if version < PYTHON:
        return (
            "Python %d.%d or newer is needed, %s is %d.%d: install one and run make PYTHON=/path/to/python3"
            % (PYTHON + (sys.executable,) + version)
        )
    try:
        import ensurepip  # noqa: F401
        import venv  # noqa: F401
    except ImportError:
        return (
            "Python module venv is missing: install it (Debian, Ubuntu: apt install python%d.%d-venv)"
            % version
        )
    header = os.path.join(sysconfig.get_paths()["include"], "Python.h")
    if not os.path.exists(header):
        return (
            "Python header %s is missing: install the development files of Python "
            "(Debian, Ubuntu: apt install python%d.%d-dev; Fedora: dnf install python3-devel)"
            % ((header,) + version)
        )
    return None


def compiler():
    """The compiler that CMake takes: $CXX, else the first of the usual names."""
    if os.environ.get("CXX"):
        return os.environ["CXX"]
    return next((name for name in ("c++", "g++", "clang++") if shutil.which(name)), None)


def compiler_problem():
    name = compiler()
    if name is None:
        return "no C++ compiler found: install one (Debian, Ubuntu: apt install g++)"
    with tempfile.TemporaryDirectory() as folder:
        source = os.path.join(folder, "check.cpp")
        with open(source, "w") as file:
            file.write(CXX20)
        command = name.split() + ["-std=c++20", source, "-o", os.path.join(folder, "check")]
        try:
            run = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
        except OSError:
            return "C++ compiler %s (from CXX) cannot be run: set CXX to a C++20 compiler" % name
    if run.returncode != 0:
        return (
            "C++ compiler %s cannot build C++20: GCC 11, Clang 14 or newer is needed (choose with CXX)" % name
        )
    return None


def missing_build_tools():
    missing = []
    cmake = shutil.which("cmake")
    if cmake:
        text = subprocess.run([cmake, "--version"], stdout=subprocess.PIPE).stdout.decode()
        version = re.search(r"(\d+)\.(\d+)", text)
    if not cmake or not version or tuple(map(int, version.groups())) < CMAKE:
        missing.append("cmake")
    if not shutil.which("ninja"):
        missing.append("ninja")
    return missing


def main():
    if "--build-tools" in sys.argv:
        print(" ".join(missing_build_tools()))
        return 0
    if "--compiler" in sys.argv:
        print(compiler())
        return 0
    problem = python_problem() or compiler_problem()
    if problem:
        sys.stderr.write("amontons: " + problem + "\n")
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
