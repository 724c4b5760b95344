"""Shared by the tests of the repository: its site, and a browser."""

import functools
import threading
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer

import pytest


class Quiet(SimpleHTTPRequestHandler):
    def log_message(self, *_):
        pass


@pytest.fixture(scope="module")
def site(root):
    """The folder of the built site."""
    folder = root / "build" / "site"
    if not (folder / "index.html").exists():
        pytest.skip("the site is not built: make docs")
    return folder


@pytest.fixture(scope="module")
def address(site):
    """The address of a server of the site."""
    server = ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Quiet, directory=str(site)))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield f"http://127.0.0.1:{server.server_port}/"
    server.shutdown()


@pytest.fixture(scope="module")
def chromium():
    """A browser without a window."""
    browser = pytest.importorskip("browser", reason="the helpers of tests in a browser")
    sync_api = pytest.importorskip("playwright.sync_api", reason="pip install playwright")
    with sync_api.sync_playwright() as playwright:
        launched = browser.launch(playwright)
        if launched is None:
            pytest.skip("no browser: playwright install chromium")
        yield launched
        launched.close()
