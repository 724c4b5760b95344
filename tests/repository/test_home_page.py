"""The home page of the site: its ways, its figures, and how it looks; skipped where none is built."""

import csv
import io
import os
import re
from html.parser import HTMLParser
from pathlib import Path, PurePosixPath
from urllib.parse import urljoin, urlsplit

import numpy as np
import pytest
from PIL import Image

PICTURES = Path(__file__).with_name("home")
BLOCK = 16
"""pixels: a block of the compared pictures"""
INK = 0.35
"""The largest share of a block that letters blacken, of any font: bold ones of the headings."""
SHIFTED = 0.05
"""The share of the blocks that have letters in one picture only: letters of other fonts are wider."""

ONE_LINE = "article :is(p, li, code) { white-space: nowrap !important; overflow: hidden }"
"""A line that one font breaks and another does not would shift all that is below it."""

PLACE_OF_REPLAY = """() => {
  const hero = document.getElementById("hero"), place = document.createElement("div");
  place.style.cssText = `background: #888; height: ${hero.offsetHeight}px; width: ${hero.offsetWidth}px`;
  hero.replaceWith(place);
}"""
"""An empty frame is white or transparent, depending on whether it has loaded."""


class Links(HTMLParser):
    def __init__(self):
        super().__init__()
        self.found = []

    def handle_starttag(self, tag, attributes):
        address = dict(attributes).get("href") if tag == "a" else None
        if address and not urlsplit(address).scheme:
            self.found.append(address.partition("#")[0])


@pytest.fixture(scope="module")
def site(root, site):
    """The built site, which must be as new as its home page."""
    sources = [root / "docs" / "index.md", root / "docs" / "site.css", root / "mkdocs.yml"]
    if max(file.stat().st_mtime for file in sources) > (site / "index.html").stat().st_mtime:
        pytest.skip("the site is older than its sources: make docs")
    return site


def article(site, page):
    """The addresses that the text of a page leads to, without menus."""
    text = (site / page).read_text()
    links = Links()
    links.feed(text[text.index("<article") : text.index("</article>")])
    found = {PurePosixPath(urljoin(page, link)).as_posix() for link in links.found if link}
    return {link for link in found if link.endswith(".html") and (site / link).exists()}


# Breaks when a reader needs more than two clicks, in texts alone, to what is asked for first.
def test_two_clicks(site):
    first = article(site, "index.html")
    second = first.union(*(article(site, page) for page in first if not page.startswith("replays/")))
    wanted = ("install.html", "tutorials/first_scene.html", "tutorials/robots.html", "playground.html",
              "tutorials/contact_forces.html", "troubleshooting.html", "gallery.html")  # fmt: skip
    assert set(wanted) <= first
    assert {"scenes.html", "models.html", "simulation.html", "engines.html"} <= second


# Breaks when the comment behind a measured number leaves a space before a comma, or ends the cell of a table.
def test_figures_are_shown_whole(site):
    text = re.sub(r"<[^>]+>", "", (site / "engines.html").read_text())
    assert re.search(r"quadruped takes \S+ us, of the Go1 \S+ us; amontons needs \S+ us and \S+ us", text)
    assert not re.search(r"\d (mm/s|mm|us|ms|%|times) [,.;:]", text)


# Breaks when the picture of the card house says what the run did not give: there it fell, here it stands.
def test_creep_was_recorded(root):
    with (root / "docs" / "figures" / "creep.csv").open() as file:
        creep = {row["engine"].split()[0].strip(","): float(row["creep"]) for row in csv.DictReader(file)}
    assert creep["MuJoCo"] > 90  # mm: more than the height of a card
    assert creep["amontons"] < 0.005  # what rounds to the 0.00 of the picture


# Breaks when the first screen names a command that a clone does not have, or installs from an index in which
# the package is not.
@pytest.mark.parametrize("page", ["docs/index.md", "README.md"])
def test_first_commands_are_those_of_a_clone(root, page):
    first = re.search(r"```sh\n(.*?)```", (root / page).read_text(), re.DOTALL).group(1)
    assert "source .venv/bin/activate" in first
    targets = re.findall(r"\bmake (\w+)", first)
    assert targets == ["demo"]
    assert re.search(r"^demo:", (root / "Makefile").read_text(), re.MULTILINE)
    assert "pip install" not in first


# Breaks when the replay at the head weighs more than a picture of a page may, or is not there.
def test_weight_of_the_head(site):
    if not (site / "replays" / "wall.html").exists():
        pytest.skip("no replays: make replays")
    assert 'id="hero" src="replays/wall.html"' in (site / "index.html").read_text()
    assert (site / "replays" / "wall.html").stat().st_size < 1.1e6


def shot(chromium, address, width, scheme):
    """The first screen, without the replay: it moves."""
    page = chromium.new_page(viewport={"width": width, "height": 900}, color_scheme=scheme)
    page.route("**/replays/*", lambda route: route.fulfill(body=""))
    page.route("**/creep.webp", lambda route: route.abort())
    page.goto(address + "index.html")
    wide = page.evaluate("document.documentElement.scrollWidth")
    page.add_style_tag(content=ONE_LINE)
    page.evaluate(PLACE_OF_REPLAY)
    pixels = np.asarray(Image.open(io.BytesIO(page.screenshot())).convert("L"), dtype=float) / 255
    page.close()
    return pixels, wide


def blocks(pixels):
    """Means over blocks of BLOCK pixels."""
    rows, columns = (n // BLOCK for n in pixels.shape)
    cut = pixels[: rows * BLOCK, : columns * BLOCK]
    return cut.reshape(rows, BLOCK, columns, BLOCK).mean(axis=(1, 3))


# Breaks when the home page looks otherwise than in the committed pictures: an element is not there, or at
# another place, a colour scheme that does not follow the system, a page wider than a telephone.
# AMONTONS_RENEW_PICTURES=1 writes them anew, to be looked at.
@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [1440, 390])
def test_looks_as_committed(chromium, address, width, scheme):
    pixels, wide = shot(chromium, address, width, scheme)
    assert wide <= width
    ground = pixels[-400:, :4].mean()  # the left margin, below the header
    assert ground > 0.95 if scheme == "light" else ground < 0.2
    file = PICTURES / f"{width}-{scheme}.png"
    found = blocks(pixels)
    if os.environ.get("AMONTONS_RENEW_PICTURES"):
        PICTURES.mkdir(exist_ok=True)
        Image.fromarray((255 * found).round().astype(np.uint8)).save(file, optimize=True)
    committed = np.asarray(Image.open(file), dtype=float) / 255
    contrast = abs(ground - (0.0 if scheme == "light" else 1.0))
    assert found.shape == committed.shape
    assert np.abs(found - committed).mean() < SHIFTED * INK * contrast


# Breaks when the switch does not show the replay with the force network, or does not lead back.
def test_switch_of_forces(chromium, address):
    page = chromium.new_page()
    page.route("**/replays/*", lambda route: route.fulfill(body=""))
    page.goto(address + "index.html")
    if not page.locator("#hero").count():
        pytest.skip("no replays: make replays")
    for wanted in ("replays/wall-forces.html", "replays/wall.html"):
        page.click("#forces")
        assert page.get_attribute("#hero", "src") == wanted
    page.close()
