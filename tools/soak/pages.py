"""What reaches the viewer: requests with forged origins, hosts and tokens, odd messages, foreign pages."""

from __future__ import annotations

import gc
import http.client
import logging
import os
import time
from collections.abc import Callable
from functools import cache
from typing import Any
from urllib.parse import parse_qs, urlsplit

import amontons
import numpy as np
from amontons import scenes

from .family import Case, Failure, Family, Measures
from .mutate import raw
from .mutate.raw import Rng, pick
from .names_and_links import name

ODD: list[Any] = [
    None, True, -1, 0, 2**63, 1e308, float("nan"), float("inf"), "", "x", "inf", "\x1b[2J", [], {}, [1, 2, 3],
    "coulomb", "0.5", b"\xff", [[]], -1e300, 10**6,
]  # fmt: skip
CAMERA = {
    "type": "ViewerCameraMessage", "wxyz": [1, 0, 0, 0], "position": [0, -3, 1], "fov": 1.0, "near": 0.01,
    "far": 1000.0, "image_height": 600, "image_width": 800, "look_at": [0, 0, 0], "up_direction": [0, 0, 1],
}  # fmt: skip
DRAG = {
    "type": "SceneNodeDragMessage", "phase": "start", "name": "/scene/visual 0", "instance_index": 0,
    "start_position": [0.0, 0.0, 1.0], "start_screen_pos": [0.5, 0.5], "end_position": [0.0, 0.0, 1.0],
    "end_screen_pos": [0.5, 0.5], "button": "left", "modifier": None, "owner": "",
}  # fmt: skip
CLICK = {
    "type": "SceneNodeClickMessage", "name": "/scene/visual 0", "instance_index": 0, "owner": "",
    "ray_origin": [0.0, 0.0, 1.0], "ray_direction": [0.0, 1.0, 0.0], "screen_pos": [0.5, 0.5],
    "modifier": None,
}  # fmt: skip


@cache
def viewer() -> Any:
    """One of the process."""
    logging.getLogger("amontons").addHandler(logging.NullHandler())
    logging.getLogger("amontons").propagate = False
    logging.getLogger("asyncio").addHandler(_Faults())
    return amontons.view(amontons.Simulation(scenes.make("stack", boxes=2), on_failure="ignore"))


faults: list[str] = []


class _Faults(logging.Handler):
    """What asyncio says of callbacks that failed."""

    def emit(self, record: logging.LogRecord) -> None:
        faults.append(record.getMessage() + str(record.exc_info and record.exc_info[1]))


def place() -> tuple[int, str]:
    parts = urlsplit(viewer().url)
    return int(parts.port or 0), parse_qs(parts.query)["token"][0]


def requests(case: Case) -> Measures:
    """A request of which host, origin or token may be forged; 403 if one is."""
    rng = case.rng()
    port, token = place()
    own = [f"localhost:{port}", f"127.0.0.1:{port}", f"[::1]:{port}"]
    mine = [None, f"http://{own[0]}", f"http://{own[1]}"]
    host = _often(rng, own, ["evil.example", f"evil.example:{port}", "localhost", "", f"{own[0]}.x"])
    odd = ["null", "http://evil.example", "file://", "", f"https://{own[0]}", f"http://{own[0]}@evil.example"]
    origin = _often(rng, mine, [*odd, f"http://localhost:{port + 1}"])
    given = _often(rng, [token], [token[:-1], token + "x", token.swapcase(), "", "..", "%2e%2e"])
    form = _often(
        rng, ["/{}/", "/?token={}", "/{}/index.html"], ["/{}", "/{}/../index.html", "/x/{}/", "//{}/"]
    )
    good = host in own and origin in mine and given == token and form not in ("/x/{}/", "//{}/")
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=20)
    connection.putrequest("GET", form.format(given), skip_host=True)
    for key, value in (("Host", host), ("Origin", origin)):
        if value is not None:
            connection.putheader(key, str(value))
    connection.endheaders()
    status = connection.getresponse().status
    connection.close()
    if not good and status not in (400, 403, 404):
        raise Failure(
            "door open", f"{status} for host {host!r}, origin {origin!r}, {form!r}, token {given!r}"
        )
    if good and status not in (200, 302, 404):
        raise Failure("door shut", f"{status} for host {host!r}, origin {origin!r}, {form!r}")
    return {"outcome": "accepted" if status < 400 else "refused"}


def _often(rng: Rng, good: list[Any], odd: list[Any]) -> Any:
    return pick(rng, good if rng.random() < 0.8 else odd)


def messages(case: Case) -> Measures:
    """Messages of a page with values, fields and bytes that are other ones."""
    import msgspec
    from websockets.exceptions import ConnectionClosedError
    from websockets.sync.client import connect

    shown = viewer()
    port, token = place()
    import viser

    protocol: Any = [f"viser-v{viser.__version__}"]
    inputs = list(shown._server.gui._gui_input_handle_from_uuid)
    address = f"ws://localhost:{port}/{token}"
    faults.clear()
    done: list[int] = []
    try:
        with connect(address, subprotocols=protocol, max_size=None, proxy=None, close_timeout=1) as page:
            page.send(msgspec.msgpack.encode(CAMERA))
            for part in range(5):
                if case.kept(part):
                    page.send(_message(case.rng(part), inputs, msgspec.msgpack.encode))
            page.ping().wait(10)
            shown.post(lambda: done.append(1))
            end = time.monotonic() + 30
            while not done and time.monotonic() < end:
                time.sleep(0.005)
    except ConnectionClosedError as error:
        raise Failure("unchecked message", f"the connection was ended: {error}") from None
    _judge(shown, done)
    return {"outcome": "done"}


def _message(rng: Rng, inputs: list[str], encode: Callable[[Any], bytes]) -> bytes | str:
    update = {
        "type": "GuiUpdateMessage",
        "uuid": str(pick(rng, inputs)),
        "updates": {"value": pick(rng, ODD)},
    }
    told = dict(pick(rng, [update, update, CAMERA, DRAG, CLICK]))  # type: ignore[call-overload]
    for _ in range(int(rng.integers(3))):
        key = str(pick(rng, [*told, "extra"]))
        if rng.random() < 0.2:
            told.pop(key, None)
        elif rng.random() < 0.1:
            told["type"] = pick(
                rng, ["ShareUrlRequest", "FileTransferStartUpload", "GuiFormSubmitMessage", 3]
            )
        else:
            told[key] = pick(rng, ODD)
    try:
        data = encode(told)
    except (OverflowError, TypeError, UnicodeError):
        return "text"
    return raw.damage(rng, data, raw.BINARY) if rng.random() < 0.2 else data


def _judge(shown: Any, done: list[int]) -> None:
    from amontons.problem.options import LAWS, methods

    gc.collect()  # of a task that failed asyncio tells when it goes
    if not done:
        raise Failure("hang", "the owner of the simulation no longer obeys")
    if faults:
        raise Failure("unchecked message", faults[0][:500])
    options = shown.run.simulation.options
    if not (0 < shown.run.speed < np.inf and options["law"] in LAWS and options["method"] in methods()):
        raise Failure("unchecked message", f"speed {shown.run.speed}, {dict(options)}")
    if not (0 < float(options["tolerance"]) <= 1 and 0 < shown.run.simulation.dt < np.inf):
        raise Failure("unchecked message", f"{dict(options)}")
    if not (np.isfinite(shown.run.positions).all() and np.isfinite(shown.marks.force_scale)):
        raise Failure("unchecked message", "a position is not finite")


@cache
def browser() -> Any:
    """Chromium without a window, or None."""
    import shutil

    if "LD_PRELOAD" in os.environ:  # a sanitizer, with which no browser starts
        return None
    try:
        from playwright.sync_api import sync_playwright
    except ImportError:
        return None
    programs = [shutil.which(program) for program in ("chromium", "chromium-browser", "google-chrome")]
    running = sync_playwright().start()
    for program in [*filter(None, programs), None]:
        try:
            options = ["--no-sandbox", "--disable-gpu", "--use-gl=angle", "--use-angle=swiftshader"]
            return running.chromium.launch(executable_path=program, args=options)
        except Exception:  # not there, or not to be started
            continue
    return None


FRAME = "<iframe srcdoc='<script>top.bad=1</script>'>"
FOREIGN = """([address, protocol]) => new Promise(done => {
  setTimeout(() => done("nothing"), 8000)
  try {
    const socket = new WebSocket(address, [protocol])
    socket.onopen = () => done("opened")
    socket.onerror = () => done("refused")
  } catch (error) { done("refused") }
})"""


def foreign(case: Case) -> Measures:
    """A page of another origin in a browser, which may know the token; and a name that is picked."""
    chrome = browser()
    if chrome is None:
        return {"outcome": "no browser"}
    import viser

    rng = case.rng()
    port, token = place()
    path = str(pick(rng, ["", token, token, f"?token={token}"]))
    host = str(pick(rng, ["localhost", "127.0.0.1"]))
    context = chrome.new_context()
    try:
        page = context.new_page()
        body = f"<!doctype html><title>{case.index}</title>"
        page.route("http://evil.example/", lambda route: route.fulfill(body=body, content_type="text/html"))
        page.goto("http://evil.example/")
        told = page.evaluate(FOREIGN, [f"ws://{host}:{port}/{path}", f"viser-v{viser.__version__}"])
        if told != "refused":
            raise Failure("door open", f"a page of another origin: {told}, {host}, {path!r}")
        if case.index % 4 == 0:
            _picked(
                context,
                name(rng) + "<img src=x onerror=top.bad=1><iframe srcdoc='<script>top.bad=1</script>'>",
            )
    finally:
        context.close()
    return {"outcome": "refused"}


def _picked(context: Any, given: str) -> None:
    builder = amontons.ModelBuilder()
    try:
        builder.add_body(given, shape=amontons.shapes.Sphere(0.1), density=1000)
        model = builder.build()
    except amontons.InputError:
        return
    with amontons.view(amontons.Simulation(model)) as shown:
        page = context.new_page()
        page.goto(shown.url)
        page.get_by_text("paused").wait_for(timeout=60_000)
        shown.post(lambda: shown.choose(0))
        page.get_by_text("mass:").wait_for(timeout=60_000)
        page.wait_for_timeout(100)
        if page.locator("iframe").count() or page.evaluate("window.bad") is not None:
            raise Failure("door open", f"the name {given!r} became a part of the page")


FAMILIES = [
    Family("viewer-requests", "requests to the viewer with forged hosts, origins and tokens", requests),
    Family("viewer-messages", "malformed messages of pages of the viewer", messages),
    Family(
        "viewer-pages", "pages of other origins, and names, in a browser", foreign, memory=1 << 46, cpu_s=120
    ),
]
