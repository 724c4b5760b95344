"""The documentation site: what its pages are made of. `make docs` builds it and fails on any warning."""

import pytest


# Breaks when links between files of the repository no longer become links between pages of the site.
def test_links_become_those_of_the_site(root):
    import outside

    text = "[a](../ARCHITECTURE.md#layers) [b](cli.md) [c](../examples/door.py) `[d](../x.md)` [e](https://x.org/y.md)"
    changed = outside.links_of_the_site(root, "physics.md", text)
    assert changed == (
        "[a](source/ARCHITECTURE.md#layers) [b](cli.md) [c](source/examples/door.py.md)"
        " `[d](../x.md)` [e](https://x.org/y.md)"
    )
    back = outside.links_of_the_site(root, "source/ARCHITECTURE.md", "[m](docs/methods.md#auto)")
    assert back == "[m](../methods.md#auto)"


# Breaks when a page that is linked to is not made, or a source is not shown whole.
def test_pages_from_outside(root):
    import outside

    pages = outside.pages(root)
    assert (root / "examples" / "door.py").read_text() in pages["source/examples/door.py.md"]
    assert pages["source/examples/door.py.md"].startswith("---\nsearch:\n  exclude: true\n")
    assert "source/ARCHITECTURE.md" in pages
    assert "[door.py](door.py)" in pages["source/examples/index.md"]
    for uri in pages:
        assert outside.uri_of(root, outside.file_of(root, uri)) == uri


# Breaks when the lines of a docstring that describe parameters run into one another.
def test_docstring_becomes_a_list():
    pytest.importorskip("griffe")
    import docstrings

    text = "Does it.\n\ndt: a step (s),\n    of time. law, method: of it.\n\nRaises: never."
    assert docstrings.as_markdown(text) == (
        "Does it.\n\n- `dt`: a step (s), of time.\n- `law`, `method`: of it.\n\nRaises: never."
    )


# Breaks when an example of a docstring runs into its text, or its lines become a list.
def test_example_of_a_docstring_becomes_code():
    pytest.importorskip("griffe")
    import docstrings

    text = "Does it.\n\ndt: a step (s).\n\n>>> f(1)\nx: 3\n\nRaises: never."
    shown = "Does it.\n\n- `dt`: a step (s).\n\n```pycon\n>>> f(1)\nx: 3\n```\n\nRaises: never."
    assert docstrings.as_markdown(text) == shown


# Breaks when an equation is not shown, loses its number, or a slip in it goes unseen.
def test_equations():
    pytest.importorskip("latex2mathml")
    import equations

    html = '<div class="arithmatex">\\[u = A x \\tag{3}\\]</div><span class="arithmatex">\\(x_n\\)</span>'
    text, faults = equations.to_mathml(html)
    assert not faults
    assert text.count("<math") == 2
    assert 'id="eq-3"' in text
    assert "(3)</a>" in text
    _, faults = equations.to_mathml('<span class="arithmatex">\\(\\nosuchthing x\\)</span>')
    assert faults


# Breaks when a public header can no longer be read, or a declaration or its comment is lost on the way.
def test_cpp_reference(root):
    pytest.importorskip("cxxheaderparser")
    import cpp_reference

    pages = cpp_reference.pages(root)
    for header in (root / "include" / "amontons").rglob("*.hpp"):
        layer = header.relative_to(root / "include" / "amontons").parts[0]
        shown = f"## {header.relative_to(root / 'include')}" in pages[f"cpp-reference/{layer}.md"]
        text = header.read_text()
        assert shown or "inline" not in text or "namespace amontons::detail {" in text, header
    text = pages["cpp-reference/multibody.md"]
    assert "Report step();" in text
    assert "Advances the state by dt. Throws InputError" in text
    assert "double dt = 5e-3;  // s, > 0" in text
    assert "Scratch" not in text
