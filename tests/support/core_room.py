"""`pytest --core`, behind `make test ROOM=core`: the tests of the engine, with all extras out of reach.

A file takes part unless it names an extra or a library of extras. What takes part cannot import any.
"""

import re
import sys

# Packages of amontons beside the engine, and libraries that the engine does without.
EXTRAS = ("cli", "device", "gym", "io", "report", "studies", "viewer")
LIBRARIES = ("h5py", "matplotlib", "mujoco", "PIL", "pyarrow", "rich", "trimesh", "typer", "viser")
NAMED = re.compile(
    rf"\b(amontons\.({'|'.join(EXTRAS)})|{'|'.join(LIBRARIES)})\b"
    r"|\b(load_model|read_problem|read_quietly|read_recording|write_fmu|write_model|render|identify|sweep|devices?)\b"
    r"|\.(record|save|load|write|view)\("
)


class Refusal:
    """A finder that says of extras that they are not there."""

    def find_spec(self, name, path=None, target=None):
        parts = name.split(".")
        if parts[0] in LIBRARIES or (parts[0] == "amontons" and parts[1:2] and parts[1] in EXTRAS):
            raise ModuleNotFoundError(f"{name} is an extra, which no test of the core may need", name=name)


def pytest_addoption(parser):
    parser.addoption("--core", action="store_true", help="tests of the engine alone, without extras")


def pytest_configure(config):
    if config.getoption("--core"):
        sys.meta_path.insert(0, Refusal())


def pytest_ignore_collect(collection_path, config):
    if config.getoption("--core") and collection_path.name.startswith("test_"):
        return bool(NAMED.search(collection_path.read_text(encoding="utf-8"))) or None
    return None
