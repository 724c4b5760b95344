"""The page of the viewer in a browser without a window: what it loads, plays, picks, drags, scrubs."""

from contextlib import contextmanager
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from threading import Thread
from urllib.parse import urlsplit

import amontons
import browser as chrome
import numpy as np
import pytest
from amontons import ModelBuilder, Simulation, shapes
from waiting import until

viser = pytest.importorskip("viser", reason="needs viser: pip install 'amontons[view]'")
playwright = pytest.importorskip("playwright.sync_api", reason="needs Playwright: pip install playwright")

BRICK, GREEN = (0.81, 0.48, 0.34), (40, 130, 70)


@pytest.fixture(scope="module")
def browser():
    with playwright.sync_playwright() as running:
        found = chrome.launch(running)
        if found is None:
            pytest.skip("needs Chromium: install it, or name it in AMONTONS_BROWSER")
        yield found
        found.close()


def crate():
    """One crate on a floor, in the middle of the picture."""
    builder = ModelBuilder()
    builder.add_geom(None, shapes.Plane())
    builder.add_body("crate", shape=shapes.Box((0.5, 0.5, 0.5)), density=100, position=(0, 0, 0.5))
    return Simulation(builder.build(), dt=5e-3, on_failure="ignore")


@pytest.fixture
def opened(browser):
    """A function that shows a simulation or a recording: viewer, page, addresses that were asked for."""
    shown = []

    def show(subject, **options):
        viewer = amontons.view(subject, **options)
        page, asked = chrome.open_page(browser, viewer.url)
        shown.append((viewer, page))
        return viewer, page, asked

    yield show
    for viewer, page in shown:
        page.context.close()
        viewer.close()


def brick_seen(page):
    """Where the scene, left of the panel, has the colour of the crate."""
    return chrome.like(chrome.picture(page)[150:, :520], BRICK)


def golden(page):
    """Where it is yellow: as green as red, and less blue."""
    red, green, blue = np.moveaxis(chrome.picture(page)[150:, :520], -1, 0)
    return (red - blue > 60) & (green > 0.85 * red)


def in_view(page):
    """Waits until the crate is drawn; the middle of it (column, row), in pixels of the page."""
    assert until(lambda: brick_seen(page).sum() > 5000)
    rows, columns = np.nonzero(brick_seen(page))
    return float(np.median(columns)), float(np.median(rows)) + 150


# Breaks when the page asks anyone but its own server for anything, stays empty, or a script fails.
def test_loads_from_its_server_alone(opened):
    viewer, page, asked = opened(crate())
    in_view(page)
    port = urlsplit(viewer.url).port
    own = (f"http://localhost:{port}/", f"ws://localhost:{port}", f"blob:http://localhost:{port}/", "data:")
    assert [address for address in asked if not address.startswith(own)] == []
    seen = brick_seen(page)
    # A convex body is one patch, which fills most of its bounds; the 2 % farthest away are the page's own.
    rows, columns = (np.percentile(v, [2, 98]) for v in np.nonzero(seen))
    assert 0.5 < 0.96 * seen.sum() / (np.ptp(rows) * np.ptp(columns)) < 1.1
    assert page.get_by_role("button", name="Play").is_visible()


# Breaks when a button does not reach the simulation, or what it does not the page.
def test_plays_and_pauses(opened):
    sim = crate()
    _, page, _ = opened(sim)
    in_view(page)
    page.get_by_role("button", name="Single step").click()
    assert until(lambda: sim.steps == 1)
    page.get_by_role("button", name="Play").click()
    assert until(lambda: sim.time > 0.2)
    page.get_by_role("button", name="Pause").click()
    page.get_by_role("button", name="Play").wait_for()
    steps = sim.steps
    page.wait_for_timeout(300)
    assert sim.steps == steps
    page.get_by_text(f"t = {sim.time:.3f} s · paused").wait_for()
    page.get_by_role("button", name="Reset").click()
    assert until(lambda: sim.steps == 0)


# Breaks when the body under the pointer is not the one that is picked, told and coloured.
def test_picks(opened):
    viewer, page, _ = opened(crate())
    page.mouse.click(*in_view(page))
    assert until(lambda: viewer.chosen == 0)
    assert page.title() == "amontons"
    page.get_by_text("crate", exact=True).wait_for()
    page.get_by_text("mass: 100 kg").wait_for()
    assert until(lambda: golden(page).sum() > 5000)


# Breaks when dragging does not pull the body towards the pointer, or holds it after the button is let go:
# upwards by a good part of its height.
def test_drags(opened):
    sim = crate()
    viewer, page, _ = opened(sim, play=True)
    column, row = in_view(page)
    page.mouse.move(column, row)
    page.mouse.down()
    for k in range(1, 11):
        page.mouse.move(column, row - 22 * k)
        page.wait_for_timeout(50)
    assert until(lambda: viewer.run.spring.body == 0)
    assert until(lambda: sim.state.positions[0, 2] > 0.6)
    page.mouse.up()
    assert until(lambda: viewer.run.spring.body is None)
    assert np.abs(sim.state.forces).max() < 1e-9
    assert until(lambda: sim.state.positions[0, 2] < 0.55)  # it falls again


# Breaks when a switch draws nothing, or a choice of the solver does not hold from the next step on.
def test_switches_and_solver(opened):
    sim = crate()
    sim.step()
    _, page, _ = opened(sim)
    in_view(page)
    green = chrome.like(chrome.picture(page)[150:, :520], GREEN, 25).sum()
    page.get_by_label("Forces").click(force=True)
    page.get_by_label("Contact points").click(force=True)
    assert until(lambda: chrome.like(chrome.picture(page)[150:, :520], GREEN, 25).sum() > green + 50)
    chrome.unfold(page, "Solver", "Law")
    page.get_by_label("Law").click()
    page.get_by_role("option", name="associated").click()
    assert until(lambda: sim.options["law"] == "associated")


def arm():
    """A bar on a hinge that a position motor holds, and one that an actuator drives; no weight."""
    builder = ModelBuilder(gravity=(0, 0, 0))
    for name, y in (("motor", 0.0), ("driven", 0.5)):
        builder.add_body(name, shape=shapes.Box((0.05, 0.05, 0.4)), density=500, position=(0, y, 0))
        motor = amontons.Motor("position", kp=100, kd=20) if name == "motor" else amontons.Motor()
        builder.add_revolute_joint(
            name, point=(0, y, 0.4), axis=(0, 1, 0), limits=(-1, 1), name=name, motor=motor
        )
    builder.add_actuator("drive", joint="driven", law="position", kp=100, kd=20, control_limits=(-0.5, 0.5))
    return Simulation(builder.build(), dt=5e-3)


# Breaks when a slider does not reach the simulation, is another one's, or does not follow what moves by
# itself: the controls of both drives go to the end of their sliders, and the joints to their places.
def test_sliders_move_joints(opened):
    sim = arm()
    _, page, _ = opened(sim)
    page.get_by_text("Joints").click()
    thumbs = page.get_by_role("slider")
    assert until(lambda: thumbs.count() == 5)  # of force arrows, two joints, a control, a motor
    _, joint, _, control, motor = thumbs.all()
    joint.press("Home")
    assert until(lambda: abs(sim.kinematics.coordinate("motor") + 1) < 1e-9)  # put there, at rest
    control.press("End")  # each for itself: the page sends what comes within 50 ms of a change as one
    assert until(lambda: sim.controls[0] == 0.5)
    motor.press("End")
    assert until(lambda: sim.controls[1] == 1)
    page.get_by_role("button", name="Play").click()
    assert until(lambda: abs(sim.kinematics.coordinate("motor") - 1) < 0.01)
    assert until(lambda: abs(sim.kinematics.coordinate("driven") - 0.5) < 0.01)
    assert until(lambda: float(joint.get_attribute("aria-valuenow")) > 0.98)
    page.get_by_role("button", name="Reset").click()
    assert until(lambda: abs(float(control.get_attribute("aria-valuenow"))) < 1e-3)


# Breaks when tolerance, method or step of the panel are not those of the next step.
def test_solver_panel_holds_at_once(opened):
    sim = crate()
    _, page, _ = opened(sim)
    in_view(page)
    page.get_by_text("View", exact=True).click()  # folds it: controls of Solver must be in the window
    chrome.unfold(page, "Solver", "Method")
    for label, option in (("Method", "apgd"), ("Tolerance", "1e-3")):
        page.get_by_label(label).click()
        page.get_by_role("option", name=option, exact=True).dispatch_event("click")
    step = page.get_by_label("Step (ms)")
    step.fill("2")
    step.press("Enter")
    assert until(lambda: (sim.options["method"], sim.options["tolerance"]) == ("apgd", 1e-3))
    assert until(lambda: sim.dt == pytest.approx(2e-3))
    page.get_by_role("button", name="Single step").click()
    assert until(lambda: sim.steps == 1)
    assert sim.time == pytest.approx(2e-3)


# Breaks when moving through a recording by hand shows another frame, or playing it does not end at its end.
def test_scrubs(opened, tmp_path):
    sim = crate()
    sim.state.linear_velocities[0] = (1, 0, 3)
    with amontons.record(tmp_path / "a.h5", sim, every=2) as recorder:
        for _ in range(60):
            recorder.add(sim.step())
    with amontons.read_recording(tmp_path / "a.h5") as recording:
        viewer, page, _ = opened(recording)
        before = in_view(page)
        thumb = page.get_by_role("slider").first
        thumb.press("End")
        assert until(lambda: viewer.run.frame == len(recording) - 1)
        thumb.press("Home")
        for _ in range(15):
            thumb.press("ArrowRight")
        assert until(lambda: viewer.run.frame == 15)
        page.get_by_text(f"t = {recording.times[15]:.3f} s").wait_for()
        assert until(lambda: abs(in_view(page)[1] - before[1]) > 10)
        page.get_by_role("button", name="Play").click()
        assert until(lambda: viewer.run.frame == len(recording) - 1)
        page.get_by_role("button", name="Play").wait_for()


# Breaks when the file of `export --html` needs more than itself, or does not play.
def test_replay_file(browser, tmp_path):
    from amontons.viewer.page import write_page

    sim = crate()
    sim.state.linear_velocities[0] = (0, 0, 2.5)
    with amontons.record(tmp_path / "a.h5", sim, every=4) as recorder:
        for _ in range(100):
            recorder.add(sim.step())
    with amontons.read_recording(tmp_path / "a.h5") as recording:
        write_page(recording, tmp_path / "a.html")
    url = (tmp_path / "a.html").as_uri()
    page, asked = chrome.open_page(browser, url, size=(520, 400))
    try:
        clock = page.locator("input").first  # seconds of the play bar
        seen = set()
        assert until(lambda: seen.add(clock.input_value()) or len(seen) > 3)
        page.locator("button").first.click()  # a still page is drawn once
        assert brick_seen(page).sum() > 1000
        assert [a for a in asked if not a.startswith((url, "blob:", "data:"))] == []
    finally:
        page.context.close()


# Breaks when a click on a body of a replay does not tell its name and its contacts in that frame, or the page
# is not named after the scene. A crate of 100 kg rests: 981 N.
def test_a_click_on_a_replay_tells_the_body(browser, tmp_path):
    from amontons.viewer.page import write_page

    sim = crate()
    with amontons.record(tmp_path / "a.h5", sim, every=2, source="boxes count=1") as recorder:
        for _ in range(20):
            recorder.add(sim.step())
    with amontons.read_recording(tmp_path / "a.h5") as recording:
        write_page(recording, tmp_path / "a.html", forces=True)
    page, _ = chrome.open_page(browser, (tmp_path / "a.html").as_uri(), size=(520, 400))
    try:
        assert page.title() == "boxes"
        page.keyboard.press("Space")  # a still page is drawn once
        told = page.locator("#amontons-body")

        def clicked():
            page.mouse.click(260, 190)
            page.wait_for_timeout(300)
            return told.is_visible()

        assert until(clicked)
        text = told.inner_text()
        assert "crate" in text
        assert "100 kg" in text
        assert "the world: 981 N, stick" in text
        page.get_by_label("Close").click()
        assert not told.is_visible()
    finally:
        page.context.close()


# Breaks when the name of a body, of a joint or of a file is taken for markup: an iframe in it would run a
# script in the origin of the viewer. Nothing of it may become an element, and all of it is to be read.
def test_names_are_text(opened):
    name = "<img src=x onerror=top.bad=1><iframe srcdoc='<script>top.bad=1</script>'></iframe> **b** `c` &lt;"
    builder = ModelBuilder()
    builder.add_geom(None, shapes.Plane())
    builder.add_body(name, shape=shapes.Box((0.5, 0.5, 0.5)), density=100, position=(0, 0, 0.5))
    builder.add_prismatic_joint(name, None, point=(0, 0, 0.5), axis=(1, 0, 0), name=f"j {name}")
    viewer, page, _ = opened(Simulation(builder.build()), title=f"t {name}")
    in_view(page)
    viewer.post(lambda: viewer.choose(0))
    page.get_by_text(name, exact=True).first.wait_for()
    viewer.post(lambda: viewer.panel.tell(f"m {name}"))
    page.get_by_text(f"m {name}").wait_for()
    page.get_by_text("Joints").click()
    page.get_by_text(f"j {name}").first.wait_for()
    page.wait_for_timeout(300)
    assert page.locator("iframe").count() == 0
    assert page.locator("img[src=x]").count() == 0
    assert page.evaluate("window.bad") is None


# Breaks when a page of another origin reads the scene or changes anything, even one that knows the token.
def test_a_foreign_page_is_refused(browser, opened, tmp_path):
    sim = crate()
    viewer, _, _ = opened(sim)
    with serve_folder(tmp_path) as port:
        context = browser.new_context()
        page = context.new_page()
        page.goto(f"http://localhost:{port}/")
        for address in (viewer.url, viewer.url.partition("?")[0]):
            told = page.evaluate(
                """([address, version]) => new Promise(done => {
                    const socket = new WebSocket(address.replace("http", "ws"), ["viser-v" + version])
                    socket.onmessage = () => done("read")
                    socket.onopen = () => setTimeout(() => done("opened"), 500)
                    socket.onerror = () => done("refused")
                })""",
                [address, viser.__version__],
            )
            assert told == "refused"
            assert page.evaluate(
                "address => fetch(address).then(r => r.text(), e => 'refused')", address
            ) in ("refused",)
        context.close()
    assert sim.options["law"] == "coulomb"


@contextmanager
def serve_folder(folder):
    """A server of another origin."""
    handler = partial(SimpleHTTPRequestHandler, directory=folder)
    with ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        Thread(target=server.serve_forever, daemon=True).start()
        yield server.server_port
        server.shutdown()
