"""What an index of packages shows: the README with absolute links, addresses, and one version everywhere."""

import re
import shutil
import tomllib

import package_metadata
import pytest
import set_version


# Breaks when a relative link or picture of the README leads nowhere on an index, or an absolute one
# or one within the page is changed.
def test_links_of_the_readme_become_absolute(root, monkeypatch):
    monkeypatch.setenv("AMONTONS_URL", "https://example.org/a/amontons/")
    monkeypatch.delenv("AMONTONS_DOCS_URL", raising=False)
    made = package_metadata.dynamic_metadata({}, {"version": "1.2.3"})
    text = made["readme"]["text"]
    before = package_metadata.LINK.findall((root / "README.md").read_text())
    after = package_metadata.LINK.findall(text)
    assert len(after) == len(before) > 15
    assert all(re.match(r"https://|#", target) for _, _, target in after)
    assert (
        "![A wrecking ball breaks through a wall](https://example.org/a/amontons/raw/v1.2.3/docs/figures/"
        in text
    )
    assert all(address.startswith("https://example.org/a/amontons") for address in made["urls"].values())
    assert (
        package_metadata.absolute("[a](https://b.c) [d](#e)", "https://x.y/z", "1")
        == "[a](https://b.c) [d](#e)"
    )


# Breaks when a build without an address invents one, or a wrong address gets into the metadata.
def test_address_is_optional_and_checked(root, monkeypatch):
    monkeypatch.delenv("AMONTONS_URL", raising=False)
    made = package_metadata.dynamic_metadata({}, {"version": "1.2.3"})
    assert made["urls"] == {}
    assert made["readme"]["text"] == (root / "README.md").read_text()
    monkeypatch.setenv("AMONTONS_URL", "example.org")
    with pytest.raises(ValueError, match="AMONTONS_URL is 'example.org'"):
        package_metadata.dynamic_metadata({}, {"version": "1.2.3"})


# Breaks when a file has another version than the package, the changelog no dated section of it or none of
# what is unreleased, or the recipe another requirement.
def test_one_version_everywhere(root):
    assert set_version.faults(root) == []
    project = tomllib.loads((root / "pyproject.toml").read_text())
    recipe = (root / "recipe/recipe.yaml").read_text()
    needed = next(r for r in project["build-system"]["requires"] if r.startswith("scikit-build-core"))
    assert needed.replace("core>", "core >") in recipe


# Breaks when a release leaves a file at the old version, loses a section of the changelog, or a file that
# disagrees is not named.
def test_version_is_set_everywhere(root, tmp_path):
    for name in (*set_version.PLACES, "CHANGELOG.md"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(root / name, tmp_path / name)
    set_version.write(tmp_path, "7.8.9", "2030-01-31")
    assert set_version.faults(tmp_path) == []
    text = (tmp_path / "CHANGELOG.md").read_text()
    assert "## [Unreleased]\n\n## [7.8.9] - 2030-01-31\n" in text
    assert f"## [{set_version.version_of(root)}]" in text
    (tmp_path / "CITATION.cff").write_text("version: 1.0.0\n")
    assert [fault.split(":")[0] for fault in set_version.faults(tmp_path)] == ["CITATION.cff", "CHANGELOG.md"]


# Breaks when a classifier names a Python or a system on which no test passed.
def test_classifiers_were_tested(root):
    project = tomllib.loads((root / "pyproject.toml").read_text())["project"]
    runs = [line for line in (root / "RELEASING.md").read_text().splitlines() if "| passed |" in line]
    for classifier in project["classifiers"]:
        kind, _, value = classifier.rpartition(" :: ")
        if kind == "Programming Language :: Python" and re.fullmatch(r"3\.\d+", value):
            assert any(f"Python {value} " in run for run in runs), classifier
        if kind.startswith("Operating System"):
            assert any(value.lower() in run for run in runs), classifier
