"""The engine compiled to WebAssembly, and its page; skipped where it was not built (make playground)."""

import base64
import json
import shutil
import subprocess

import amontons
import make_playground
import numpy as np
import pytest

STEPS = 200
NAMES = [example.scene for example in make_playground.EXAMPLES]


@pytest.fixture(scope="module")
def engine(root):
    file = root / "build" / "playground" / "engine.js"
    if not file.exists():
        pytest.skip("the playground is not built: make playground")
    if not shutil.which("node"):
        pytest.skip("no node to run the playground with")
    return file


@pytest.fixture(scope="module")
def scenes():
    return make_playground.scenes()


@pytest.fixture(scope="module")
def states(root, engine, scenes, tmp_path_factory):
    """Poses (n, 7) and velocities (n, 6) of every scene after STEPS steps in node."""
    file = tmp_path_factory.mktemp("playground") / "scenes.json"
    file.write_text(json.dumps(scenes))
    words = [root / "tests" / "support" / "world_states.js", engine, root / "playground" / "world.js", file]
    done = subprocess.run(["node", *words, str(STEPS)], capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr[-3000:]
    read = [(d["poses"], d["velocities"]) for d in json.loads(done.stdout)]
    return [[np.frombuffer(base64.b64decode(text)) for text in pair] for pair in read]


# Breaks when WebAssembly rounds otherwise than the native engine: products contracted with sums, functions
# of another C library, sums in another order, vectors that a compiler gets wrong. Every bit counts.
@pytest.mark.parametrize("k", range(len(NAMES)), ids=NAMES)
def test_bits_are_those_of_the_native_engine(states, scenes, tmp_path, k):
    file = tmp_path / "model.json"
    file.write_text(scenes[k]["model"])
    options = {"dt": scenes[k]["dt"], "tolerance": scenes[k]["tolerance"], "on_failure": "ignore"}
    simulation = amontons.Simulation(amontons.load_model(file), threads=1, **options)
    for _ in range(STEPS):
        simulation.step()
    s = simulation.state
    poses, velocities = states[k]
    assert np.hstack((s.positions, s.orientations)).tobytes() == poses.tobytes()
    assert np.hstack((s.linear_velocities, s.angular_velocities)).tobytes() == velocities.tobytes()


@pytest.fixture(scope="module")
def page_file(root):
    file = root / "out" / "playground" / "index.html"
    if not file.exists():
        pytest.skip("the playground is not built: make playground")
    return file


@pytest.fixture(scope="module")
def chromium():
    browser = pytest.importorskip("browser", reason="the helpers of tests in a browser")
    sync_api = pytest.importorskip("playwright.sync_api", reason="pip install playwright")
    with sync_api.sync_playwright() as playwright:
        launched = browser.launch(playwright)
        if launched is None:
            pytest.skip("no browser: playwright install chromium")
        yield launched
        launched.close()


@pytest.fixture(params=[(1280, 800), (390, 844)], ids=["desktop", "telephone"])
def page(request, chromium, page_file):
    """The page as opened from a folder, paused; the test fails if it asks for anything or goes wrong."""
    width, height = request.param
    page = chromium.new_page(viewport={"width": width, "height": height})
    wrong = []
    address = page_file.as_uri()
    page.on("request", lambda r: r.url.startswith((address, "data:", "blob:")) or wrong.append(r.url))
    page.on("console", lambda m: m.type != "error" or wrong.append(m.text))
    page.on("pageerror", lambda error: wrong.append(str(error)))
    page.goto(address)
    page.wait_for_function("window.playground !== undefined", timeout=60_000)
    page.click("#play")
    page.click("#reset")
    yield page
    page.close()
    assert wrong == []


def shown(page, name):
    return page.inner_text(f"#told-{name}")


# Breaks when the page does not start from a file, asks for another one, is wider than the window, or its
# buttons do not step, pause and reset.
def test_page_steps_and_resets(page):
    assert page.evaluate("document.documentElement.scrollWidth <= window.innerWidth")
    assert shown(page, "time") == "0.00 s"
    for _ in range(4):
        page.click("#step")
    assert shown(page, "time") == "0.02 s"
    assert page.evaluate("playground.curve.steps.every((s) => s.sound && s.residual <= s.tolerance)")
    assert page.evaluate("playground.curve.steps.length") == 4
    assert int(shown(page, "contacts")) > 100
    page.click("#reset")
    assert shown(page, "time") == "0.00 s"
    page.click("#play")
    page.wait_for_function("playground.world.report().time > 0.1")
    page.click("#play")
    stopped = shown(page, "time")
    page.wait_for_timeout(200)
    assert shown(page, "time") == stopped


# Breaks when a pointer on a body does not pull it, or does not let go of it.
def test_pointer_pulls_a_brick(page):
    page.select_option("#scene", label="Stack")
    page.click("#reset")
    top = "Array.from(playground.world.poses().subarray(7 * 6, 7 * 6 + 3))"
    before = page.evaluate(top)
    x, y = page.evaluate(f"playground.stage.seen({top})")
    page.mouse.move(x, y)
    page.mouse.down()
    assert page.evaluate("playground.stage.held.body") == 6
    assert page.evaluate("playground.playing")
    page.mouse.move(x + 60, y - 30, steps=4)
    page.wait_for_function("playground.world.report().time > 0.5", timeout=60_000)
    page.mouse.up()
    assert page.evaluate("playground.stage.held") is None
    moved = np.array(page.evaluate(top)) - before
    assert np.hypot(moved[0], moved[1]) > 0.05
    assert moved[2] > 0.02


# Breaks when a slider does not reach the engine: without friction the cards slide apart, and a larger step or
# another tolerance shows in the next report.
def test_sliders_change_the_world(page):
    page.select_option("#scene", label="House of cards")
    height = "playground.world.poses()[7 * 14 + 2]"
    start = page.evaluate(height)
    run = "for (let k = 0; k < 60; ++k) playground.step()"
    page.evaluate("playground.play(false)")
    page.evaluate(run)
    assert abs(page.evaluate(height) - start) < 1e-4
    page.locator("#friction").fill("0")
    assert page.inner_text("#friction-value") == "0.00"
    time = page.evaluate("playground.world.report().time")
    page.evaluate(run)
    assert page.evaluate(height) < start - 0.01
    page.locator("#dt").fill("-2")
    assert page.inner_text("#dt-value") == "10 ms"
    before = page.evaluate("playground.world.poses()[2]")
    page.click("#step")
    assert page.evaluate("playground.world.report().time") == pytest.approx(time + 60 * 0.005 + 0.01)
    assert before != page.evaluate("playground.world.poses()[2]")


# Breaks when a model of the user is not read, or a fault of it is not told.
def test_models_of_the_user_are_opened(page, tmp_path):
    model = tmp_path / "mine.json"
    amontons.write_model(amontons.scenes.make("stack", boxes=3), model)
    page.set_input_files("#file", model)
    page.wait_for_function("playground.world.bodies === 3")
    model.write_text(model.read_text().replace('"mass": 8', '"mass": -8'))
    page.set_input_files("#file", model)
    page.wait_for_function("document.getElementById('fault').textContent.includes('mass')")
    assert page.evaluate("playground.world.bodies") == 3
