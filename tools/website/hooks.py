"""What the documentation site does beyond MkDocs; `mkdocs.yml` names this file.

- Documents and sources outside docs/ that a page links to become pages (`outside`).
- The reference of C++ is made from the public headers (`cpp_reference`).
- Replays of the scenes (`tools/gallery.py --replays`) are taken in where they have been made. That
  of the wall is at the head of the home page; without it a picture is there.
- The playground (`make playground`) is taken in, and shown on its page, where it has been made.
- Tutorials can be taken along as notebooks (`notebooks`).
- Equations become MathML (`equations`).
- A page that would load something from the network is a warning, and so an error of `make docs`.
"""

import logging
import re
from pathlib import Path

import cpp_reference
import equations
import notebooks
import outside
from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files, InclusionLevel
from mkdocs.structure.pages import Page

ROOT = Path(__file__).resolve().parents[2]
PLAYGROUND = ROOT / "out" / "playground" / "index.html"
PLAYED = """[Open it alone](playground/index.html){ .md-button }

<iframe src="playground/index.html" title="The playground" loading="lazy" class="playground"></iframe>
"""
HERO = re.compile(r"<!-- hero: begin -->.*<!-- hero: end -->", re.DOTALL)
SHOWN = """<iframe id="hero" src="replays/wall.html" data-plain="replays/wall.html"
 data-forces="replays/wall-forces.html" title="A wrecking ball breaks through a wall"></iframe>

<p class="hero"><label><input type="checkbox" id="forces"> Force network</label>
<span>Drag to turn, wheel to zoom, bar to scrub; click a brick.</span></p>
"""
FIGURE = re.compile(r" <!-- [^;>]+; [^>]+? -->")
"""The comment behind a measured number, with its row and column: its space would stand before a comma."""
log = logging.getLogger("mkdocs.plugins.amontons")
# What a browser fetches by itself when it opens a page: all but links that one follows.
FETCHED = re.compile(
    r"<(?:script|img|iframe|video|source)\b[^>]*\bsrc=[\"']?(?:https?:)?//[^>]*>"
    r"|<link\b(?=[^>]*\brel=[\"']?(?:stylesheet|preconnect|preload|icon))[^>]*\bhref=[\"']?(?:https?:)?//[^>]*>"
    r"|@import\s+(?:url\()?[\"']?(?:https?:)?//[^;]*|url\([\"']?(?:https?:)?//[^)]*\)"
)


def add(files: Files, config: MkDocsConfig, uri: str, text: str) -> None:
    """Puts a file into the site that docs/ does not hold."""
    files.append(File.generated(config, uri, content=text, inclusion=InclusionLevel.NOT_IN_NAV))


def on_files(files: Files, config: MkDocsConfig) -> Files:
    for uri, text in cpp_reference.pages(ROOT).items():
        add(files, config, uri, text)
    for uri, text in outside.pages(ROOT).items():
        add(files, config, uri, text)
    for replay in sorted((ROOT / "out" / "replays").glob("*.html")):
        add(files, config, f"replays/{replay.name}", replay.read_text())
    if PLAYGROUND.exists():
        add(files, config, "playground/index.html", PLAYGROUND.read_text())
    for page in notebooks.pages(ROOT):
        uri = page.with_suffix(".ipynb").relative_to(ROOT / "docs").as_posix()
        add(files, config, uri, notebooks.as_text(page))
    return files


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    markdown = FIGURE.sub("", markdown)
    replays = {Path(file.src_uri).stem: file.src_uri for file in files if file.src_uri.startswith("replays/")}
    if page.file.src_uri == "gallery.md":
        for name, uri in replays.items():
            markdown = markdown.replace(f"**{name}**", f"**{name}** · [replay]({uri})")
            picture = f"![{name}](figures/gallery/{name}.png)"
            markdown = markdown.replace(picture, f"[{picture}]({uri})")
    if page.file.src_uri == "index.md" and {"wall", "wall-forces"} <= set(replays):
        markdown = HERO.sub(SHOWN, markdown)
    if page.file.src_uri == "playground.md" and PLAYGROUND.exists():
        markdown = markdown.replace("<!-- the page -->", PLAYED)
    notebook = Path(page.file.src_uri).with_suffix(".ipynb")
    if files.get_file_from_path(notebook.as_posix()):
        markdown += f"\n\n[This page as a notebook]({notebook.name})\n"
    return outside.links_of_the_site(ROOT, page.file.src_uri, markdown)


def on_page_content(html: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    text, faults = equations.to_mathml(html)
    for fault in faults:
        log.warning("%s: %s", page.file.src_uri, fault)
    return text


def on_post_build(config: MkDocsConfig) -> None:
    site = Path(config.site_dir)
    for file in [*site.rglob("*.html"), *site.rglob("*.css")]:
        if "replays" in file.parts:  # pages of the viewer, whose own tests see to that
            continue
        for match in FETCHED.finditer(file.read_text()):
            log.warning("%s loads from the network: %s", file.relative_to(site), match.group()[:120])
