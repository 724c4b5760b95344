"""What an index of packages shows: the README with absolute links, addresses, and one version everywhere."""

import re
import tomllib

import package_metadata
import pytest


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


# Breaks when the recipe or the citation has another version than the package, or another requirement.
def test_one_version_everywhere(root):
    project = tomllib.loads((root / "pyproject.toml").read_text())
    version = project["project"]["version"]
    recipe = (root / "recipe/recipe.yaml").read_text()
    assert f'version: "{version}"' in recipe
    assert f"\nversion: {version}\n" in (root / "CITATION.cff").read_text()
    needed = next(r for r in project["build-system"]["requires"] if r.startswith("scikit-build-core"))
    assert needed.replace("core>", "core >") in recipe
