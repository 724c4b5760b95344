"""The engine compiled to WebAssembly, and its page; skipped where it was not built (make playground)."""

import base64
import json
import shutil
import subprocess

import amontons
import make_playground
import numpy as np
import pytest
from amontons import shapes

STEPS = 200
# Half the size of the box around each body at the start, in its own axes.
BOXES = """playground.stage.groups.map((group) => {
  const mesh = group.children[0];
  mesh.geometry.computeBoundingBox();
  const { min, max } = mesh.geometry.boundingBox;
  return [max.x - min.x, max.y - min.y, max.z - min.z].map((length) => length / 2);
})"""
NAMES = [example.scene for example in make_playground.EXAMPLES]


def built(root, path):
    """A file that make playground makes; the test is skipped where a source is newer."""
    file = root / path
    if not file.exists():
        pytest.skip("the playground is not built: make playground")
    sources = [p for folder in ("include", "src", "playground") for p in (root / folder).rglob("*.?p*")]
    if max(p.stat().st_mtime for p in sources) > file.stat().st_mtime:
        pytest.skip("the playground is older than its sources: make playground")
    return file


@pytest.fixture(scope="module")
def engine(root):
    file = built(root, "build/playground/engine.js")
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
    return built(root, "out/playground/index.html")


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
def test_pointer_pulls_a_box(page):
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


# Breaks when a shape of a model is not drawn, or not where it is.
def test_all_shapes_are_drawn(page, tmp_path):
    builder = amontons.ModelBuilder()
    corners = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
    faces = [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]
    for fixed in (
        shapes.Plane(),
        shapes.Mesh(corners, faces),
        shapes.HeightField(np.zeros((3, 4)), size_x=2.0, size_y=1.0),
    ):
        builder.add_geom(None, fixed)
    moving = (
        shapes.Sphere(0.5),
        shapes.Ellipsoid((0.5, 0.3, 0.2)),
        shapes.Box((0.5, 0.3, 0.2)),
        shapes.Capsule(0.2, 0.3),
        shapes.Cylinder(0.2, 0.5),
        shapes.Hull(corners),
    )
    for k, shape in enumerate(moving):
        builder.add_body(f"body {k}", position=(3 * k, 0, 2), shape=shape, density=1000)
    model = tmp_path / "shapes.json"
    amontons.write_model(builder.build(), model)
    page.set_input_files("#file", model)
    page.wait_for_function("playground.world.bodies === 6")
    assert page.evaluate("playground.stage.world.children.length") == 3
    boxes = page.evaluate(BOXES)
    # Half the extent along each axis; the origin of the hull's body is its centre of mass.
    assert np.allclose(
        boxes[:5], [[0.5] * 3, [0.5, 0.3, 0.2], [0.5, 0.3, 0.2], [0.2, 0.2, 0.5], [0.2, 0.2, 0.5]]
    )
    assert np.allclose(boxes[5], [0.5] * 3)


# Breaks when the example of the document does not run.
def test_example_of_the_document_runs(root, engine, tmp_path):
    text = (root / "docs" / "playground.md").read_text().split("```js\n")[1].split("```")[0]
    model = tmp_path / "model.json"
    amontons.write_model(amontons.scenes.make("stack", boxes=2), model)
    script = text.replace('"model.json"', json.dumps(str(model)))
    done = subprocess.run(["node", "-e", script], cwd=root, capture_output=True, text=True, timeout=100)
    assert "sound: true" in done.stdout, done.stderr


# Breaks when a machine without emscripten gets a traceback instead of what to install.
def test_what_is_missing_is_named(monkeypatch):
    monkeypatch.setenv("PATH", "")
    with pytest.raises(SystemExit, match="emcmake.*apt-get install emscripten npm"):
        make_playground.main()


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
