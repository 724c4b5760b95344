"""A browser without a window, and what tests ask of a page of the viewer."""

from __future__ import annotations

import os
import shutil

import numpy as np
from waiting import LONGEST, until

PROGRAMS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
OPTIONS = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
"""WebGL by the processor: a server has no graphics card."""


def launch(playwright):
    """Chromium: that of AMONTONS_BROWSER, of the system, or of Playwright; None where there is none."""
    named = os.environ.get("AMONTONS_BROWSER")
    programs = [named] if named else [found for name in PROGRAMS if (found := shutil.which(name))]
    for program in [*programs, None]:
        try:
            return playwright.chromium.launch(executable_path=program, args=OPTIONS)
        except Exception:  # of many kinds: not there, or not to be started
            continue
    return None


def open_page(browser, url, size=(900, 600)):
    """A page and the addresses that it asks for, each of which it is refused unless its server is that of the
    given one."""
    server = url.partition("?")[0]
    context = browser.new_context(viewport={"width": size[0], "height": size[1]})
    page = context.new_page()
    asked = []

    def route(request):
        asked.append(request.request.url)
        if request.request.url.startswith((server, "blob:", "data:")):
            request.continue_()
        else:
            request.abort()

    page.set_default_timeout(1e3 * LONGEST)
    page.route("**/*", route)
    page.on("websocket", lambda socket: asked.append(socket.url))
    page.goto(url)
    page.wait_for_selector("canvas")
    return page, asked


def picture(page):
    """What is on the canvas and beside it, as (height, width, 3)."""
    import io

    from PIL import Image

    return np.asarray(Image.open(io.BytesIO(page.screenshot())).convert("RGB"), dtype=int)


def unfold(page, folder, label):
    """Opens a folder of the panel, so that the control with this label is visible. A click can get lost while
    the panel is still being built or another folder is moving: then it is repeated."""
    control = page.get_by_label(label).first
    for _ in range(10):
        page.get_by_text(folder, exact=True).click()
        if until(control.is_visible, 3):
            return
    raise AssertionError(f"folder {folder} does not show {label}")


def like(pixels, colour, spread=60):
    """Where a picture has about the direction of a colour, light or dark: (height, width)."""
    unit = np.array(colour) / np.linalg.norm(colour)
    along = pixels @ unit
    off = np.linalg.norm(pixels - along[..., None] * unit, axis=-1)
    return (off < spread) & (along > 60)
