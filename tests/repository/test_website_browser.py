"""The documentation site in a real browser; skipped where it is not built (make docs) or no browser is."""

from waiting import until


# Breaks when a page asks for something that is not there or not here, or a script of it fails.
def test_pages_load_by_themselves(site, address, chromium):
    page = chromium.new_page()
    wrong = []
    page.on("request", lambda r: r.url.startswith((address, "data:", "blob:")) or wrong.append(r.url))
    page.on("response", lambda r: r.status < 400 or wrong.append(f"{r.status} {r.url}"))
    page.on("console", lambda m: m.type != "error" or wrong.append(m.text))
    page.on("pageerror", lambda error: wrong.append(str(error)))
    files = sorted(site.rglob("*.html"))
    shown = [file for file in files if "source" not in file.parts]  # sources are blocks of code, all alike
    for file in [*shown, site / "source" / "ARCHITECTURE.html"]:
        page.goto(address + file.relative_to(site).as_posix())
    assert len(shown) > 30
    assert wrong == []
    page.close()


# Breaks when equations are left as text, lose their numbers, or numbers their places.
def test_equations_are_drawn(address, chromium):
    page = chromium.new_page()
    page.goto(address + "algorithm.html#eq-14")
    box = page.locator("#eq-14 math").bounding_box()
    assert box["width"] > 100
    assert box["height"] > 10
    assert page.locator("#eq-14 .number").inner_text() == "(14)"
    assert page.locator(".arithmatex").count() == 0
    page.close()


# Breaks when the search finds nothing: its index is loaded by a script of its own.
def test_search_finds(address, chromium):
    page = chromium.new_page()
    page.goto(address + "index.html")
    page.click("input.md-search__input")
    page.locator("input.md-search__input").press_sequentially("friction cone")
    found = page.locator(".md-search-result__item")
    until(lambda: found.count() > 3)
    assert found.count() > 3
    page.close()


# Breaks when code runs out of the page on a screen of 1280 pixels, beside both menus, or any page is wider
# than its window, also on a telephone. Output of programs, whose blocks name no language, may be scrolled.
def test_code_fits(site, address, chromium):
    page = chromium.new_page()
    wide = {}
    for file in sorted([*site.glob("*.html"), *site.glob("tutorials/*.html")]):
        page.set_viewport_size({"width": 1280, "height": 800})
        page.goto(address + file.relative_to(site).as_posix())
        found = page.evaluate(
            """() => [...document.querySelectorAll('.md-typeset [class*=language-] pre > code')]
                .filter(code => code.scrollWidth > code.clientWidth + 1)
                .map(code => code.innerText.split('\\n').sort((a, b) => b.length - a.length)[0])"""
        )
        if found:
            wide[file.name] = found
        for width in (1280, 400):
            page.set_viewport_size({"width": width, "height": 800})
            if page.evaluate("document.documentElement.scrollWidth > window.innerWidth"):
                wide[file.name] = f"the page, in {width} pixels"
    assert wide == {}
    page.close()
