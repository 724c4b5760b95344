"""Beside the package in a wheel: a bill of materials, the licences of linked parts; no trace of a folder."""

import importlib.metadata
import json
import re
import zipfile
from pathlib import Path

import amontons
import check_reproducible
import make_sbom
import pytest

ROOT = Path(__file__).resolve().parents[2]
MODULE = Path(amontons._core.__file__)


def headers(folder):
    """A folder with a header for each part, whose macros count up from 1."""
    for part in make_sbom.PARTS:
        path = folder / part.header
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("\n".join(f"#define {name} {k}" for k, name in enumerate(part.macros, 1)))
    return folder


def bill(folder, module_bytes, runtime="libstdc++", system="Linux"):
    module = folder / "module.so"
    module.write_bytes(module_bytes)
    return make_sbom.bill(module, [headers(folder)], runtime, "GNU 12.2.0", system)


def names(made):
    return [part["name"] for part in made["components"]]


# Breaks when a part is left out, or its version is not the one of its header.
def test_bill_names_what_is_compiled_in(tmp_path):
    made = bill(tmp_path, b"... libstdc++.so.6 ...")
    assert made["bomFormat"] == "CycloneDX"
    assert names(made) == ["nanobind", "robin-map", "eigen", "nlohmann-json"]
    assert {part["version"] for part in made["components"]} == {"1.2.3"}
    (tree,) = made["dependencies"]
    assert tree["dependsOn"] == [part["bom-ref"] for part in made["components"]]


# Breaks when a runtime inside the module is not told, or one that the system brings is.
def test_runtime_counts_where_it_is_inside(tmp_path):
    inside = bill(tmp_path, b"nothing is loaded", runtime="libc++", system="Windows")
    assert names(inside)[-2:] == ["libc++", "mingw-w64"]
    assert "libc++" not in names(bill(tmp_path, b"libc++.1.dylib", runtime="libc++", system="Darwin"))


# Breaks when a header that is not found gives a bill without its part.
def test_missing_header_is_an_error(tmp_path):
    headers(tmp_path)
    (tmp_path / make_sbom.PARTS[2].header).unlink()
    with pytest.raises(SystemExit, match="no version of eigen"):
        make_sbom.version_of(make_sbom.PARTS[2], [tmp_path])


# Breaks when dates, random numbers or the order of a set get into the file: wheels would differ.
def test_bill_is_the_same_twice(tmp_path):
    assert json.dumps(bill(tmp_path, b"")) == json.dumps(bill(tmp_path, b""))


# Breaks when a part in the bill has no text in licenses, or the folder names one that is not there.
def test_licences_have_their_texts():
    table = (ROOT / "licenses" / "README.md").read_text()
    linked = set(re.findall(r"\]\(([\w.-]+\.txt)\)", table))
    assert linked == {path.name for path in (ROOT / "licenses").glob("*.txt")}
    for part in make_sbom.PARTS:
        assert part.licence in table
        assert f"{part.name}.txt" in linked
    for licence, _ in make_sbom.RUNTIMES.values():
        assert licence in table


# Breaks when the installed package lacks a licence or its bill.
def test_installed_package_has_licences_and_bill():
    files = {str(path) for path in importlib.metadata.files("amontons") or ()}
    for path in (ROOT / "licenses").iterdir():
        assert any(name.endswith(f"licenses/licenses/{path.name}") for name in files), path.name
    (told,) = [path for path in importlib.metadata.files("amontons") or () if path.name.endswith(".cdx.json")]
    assert told.parts[-2] == "sboms"
    made = json.loads(Path(told.locate()).read_text())
    assert {"nanobind", "robin-map", "eigen", "nlohmann-json"} <= set(names(made))
    assert made["metadata"]["component"]["version"] == importlib.metadata.version("amontons")


# Breaks when the name of a folder gets into the module, which would then differ from folder to folder.
def test_module_names_no_folder():
    data = MODULE.read_bytes()
    assert str(ROOT).encode() not in data
    assert b"site-packages" not in data


def archive(path, date, content):
    with zipfile.ZipFile(path, "w") as made:
        made.writestr(zipfile.ZipInfo("amontons/module.so", date), content)
    return path


# Breaks when a difference in content or date passes as the same wheel, or the member is not named.
@pytest.mark.parametrize(("date", "content"), [((2020, 1, 1, 0, 0, 2), b"a"), ((2020, 1, 1, 0, 0, 0), b"b")])
def test_differences_of_wheels_are_named(date, content, tmp_path, capsys):
    first = archive(tmp_path / "a.whl", (2020, 1, 1, 0, 0, 0), b"a")
    assert check_reproducible.compare(first, archive(tmp_path / "c.whl", (2020, 1, 1, 0, 0, 0), b"a")) == 0
    assert check_reproducible.compare(first, archive(tmp_path / "b.whl", date, content)) == 1
    assert "differs: amontons/module.so" in capsys.readouterr().out
