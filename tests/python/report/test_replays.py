"""What is made of recordings: pictures, movies, pages, scenes of USD, tables; and pictures of simulations."""

import csv
import re
import shutil
import subprocess

import amontons
import numpy as np
import pytest
from amontons import ModelBuilder, Simulation, scenes, shapes
from amontons.cli import app
from amontons.report.replays.film import movie_frames
from PIL import Image
from typer.testing import CliRunner


def call(*arguments):
    return CliRunner().invoke(app, [str(a) for a in arguments])


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    path = tmp_path_factory.mktemp("replays") / "pendulum.h5"
    sim = Simulation(scenes.make("pendulum"), dt=5e-3, on_failure="ignore")
    with amontons.record(path, sim, every=4) as recorder:
        for _ in range(80):
            recorder.add(sim.step())
    return path


# Breaks when a picture is not of the size asked for, or does not show where things are: the bright ball moves
# to the right in a window that stays. Seen along y from below zero, x is to the right.
def test_render_shows_the_state():
    builder = ModelBuilder(gravity=(0, 0, 0))
    builder.add_body("ball", shape=shapes.Sphere(0.5), density=1, linear_velocity=(1, 0, 0))
    sim = Simulation(builder.build())
    view = {"azimuth": -90.0, "elevation": 0.0, "target": (0, 0, 0), "width": 6}
    columns = []
    for _ in range(2):
        image = amontons.render(sim, (120, 80), **view)
        assert image.shape == (80, 120, 3)
        assert image.dtype == np.uint8
        seen = (image < 250).any(axis=2)
        # 20 pixels to the metre; of those on the outline, 2 pi 10, all are seen in place of half of them.
        assert np.pi * 10**2 <= seen.sum() <= np.pi * (10**2 + 2 * 10)
        columns.append(np.nonzero(seen)[1].mean())
        sim.run(1.0)
    assert columns[1] - columns[0] == pytest.approx(20, abs=1)
    kept = amontons.render_view(sim, (100, 100), azimuth=-90.0, elevation=0.0)
    assert kept["target"] == pytest.approx((2, 0, 0), abs=1e-9)
    assert 1 < kept["width"] < 1.2
    assert (
        amontons.render(sim, (100, 100), **kept) == amontons.render(sim, (100, 100), azimuth=-90, elevation=0)
    ).all()


# Breaks when a size or view that no picture can have is not refused by name.
@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        ({"size": (0, 10)}, "size"),
        ({"size": (10, 10**6)}, "size"),
        ({"size": 640}, "give \\(width, height\\)"),
        ({"target": (1, 0)}, "target"),
        ({"target": "bob"}, "no body 'bob'|no body \"bob\""),
        ({"width": 0}, "width"),
        ({"distance": -1}, "distance"),
        ({"fixed": "gone"}, "known are glass, show, hide"),
        ({"forces": -1.0}, "forces"),
    ],
)
def test_render_refuses(arguments, named):
    sim = Simulation(scenes.make("pendulum"))
    with pytest.raises(amontons.InputError, match=named):
        amontons.render(sim, **{"size": (10, 10)} | arguments)


# Breaks when a movie shows a frame before its time, leaves out the end, or runs at another speed.
def test_movie_frames():
    times = np.arange(11) * 0.1
    assert movie_frames(times, 10.0, 1.0).tolist() == list(range(11))
    assert movie_frames(times, 10.0, 2.0).tolist() == [0, 2, 4, 6, 8, 10]
    assert movie_frames(times, 20.0, 1.0).tolist() == [k // 2 for k in range(21)]
    assert movie_frames(np.array([0.5]), 25.0, 1.0).tolist() == [0, 0]


# Breaks when pictures are not those of their times: the nearest frames, one file each.
def test_png(recorded, tmp_path):
    done = call("export", recorded, "--png", tmp_path / "a.png", "--times", "0,0.2", "--size", "100x60")
    assert done.exit_code == 0
    first, second = (np.asarray(Image.open(tmp_path / f"a-{t}s.png")) for t in ("0", "0.2"))
    assert first.shape == (60, 100, 3)
    assert (first != second).any()


# Breaks when an animation has another number of pictures or duration than frames and speed ask for.
@pytest.mark.parametrize("suffix", ["gif", "webp"])
def test_animation(recorded, tmp_path, suffix):
    path = tmp_path / f"a.{suffix}"
    done = call("export", recorded, "--gif", path, "--size", "64x48", "--fps", "10", "--speed", "0.5")
    assert done.exit_code == 0
    with Image.open(path) as image:
        assert image.size == (64, 48)
        assert image.n_frames == 9  # 0.4 s at half the speed, ten per second, and the end


# Breaks when ffmpeg is called wrongly: what the movie shows first is the first picture, but for its coding.
@pytest.mark.skipif(shutil.which("ffmpeg") is None, reason="needs ffmpeg")
def test_mp4(recorded, tmp_path):
    done = call("export", recorded, "--mp4", tmp_path / "a.mp4", "--size", "96x64", "--fps", "10")
    assert done.exit_code == 0
    call("export", recorded, "--png", tmp_path / "a.png", "--times", "0", "--size", "96x64")
    command = ["ffmpeg", "-loglevel", "error", "-i", tmp_path / "a.mp4", "-vframes", "1", tmp_path / "b.png"]
    subprocess.run([str(part) for part in command], check=True)
    ours, theirs = (np.asarray(Image.open(tmp_path / n).convert("L"), float) for n in ("a.png", "b.png"))
    assert np.abs(ours - theirs).mean() < 8


# Breaks when a number of the table is not that of the recording to the last bit, or under another name.
def test_csv(recorded, tmp_path):
    assert call("export", recorded, "--csv", tmp_path / "a.csv").exit_code == 0
    with (tmp_path / "a.csv").open() as file:
        rows = list(csv.DictReader(file))
    with amontons.read_recording(recorded) as recording:
        body, joint = recording.model.bodies[0].name, recording.model.joints[0].name
        assert [float(row["time"]) for row in rows] == recording.times.tolist()
        assert [float(row[f"{body}.z"]) for row in rows] == recording.positions[:, 0, 2].tolist()
        assert [float(row[f"{body}.qw"]) for row in rows] == recording.orientations[:, 0, 0].tolist()
        assert [float(row[joint]) for row in rows] == recording.joint_coordinates[:, 0].tolist()


# Breaks when a body of the scene is elsewhere than in the recording: USD's own composition of the transforms.
def test_usd(recorded, tmp_path):
    pxr = pytest.importorskip("pxr", reason="needs usd-core")
    from pxr import Usd, UsdGeom

    assert pxr is not None
    assert call("export", recorded, "--usd", tmp_path / "a.usda").exit_code == 0
    stage = Usd.Stage.Open(str(tmp_path / "a.usda"))
    meshes = [prim for prim in stage.Traverse() if prim.IsA(UsdGeom.Mesh)]
    with amontons.read_recording(recorded) as recording:
        assert len(meshes) == len(recording.model.geoms)
        body = stage.GetPrimAtPath("/scene/" + re.sub(r"\W", "_", recording.model.bodies[0].name))
        for k in (0, len(recording) - 1):
            matrix = UsdGeom.XformCache(1000 * recording.times[k]).GetLocalToWorldTransform(body)
            assert list(matrix.ExtractTranslation()) == pytest.approx(recording.positions[k, 0].tolist())
            q = matrix.ExtractRotationQuat()
            ours = recording.orientations[k, 0]
            assert abs(q.GetReal() * ours[0] + np.dot(q.GetImaginary(), ours[1:])) == pytest.approx(
                1, abs=1e-6
            )


# Breaks when the page is not one file that holds all it needs: nothing in it names another place.
def test_html(recorded, tmp_path):
    pytest.importorskip("viser", reason="needs viser: pip install 'amontons[view]'")
    assert call("export", recorded, "--html", tmp_path / "a.html").exit_code == 0
    page = (tmp_path / "a.html").read_text()
    assert "__VISER_EMBED_DATA__=" in page
    assert not re.search(r"""(src|href)=["'](https?:)?//""", page)
    assert [file.name for file in tmp_path.iterdir()] == ["a.html"]


# Breaks when a wrong name, time, size or subject is not told in one line, or something is written anyway.
@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["--html", "a.png"], "ends in .html"),
        (["--png", "a.png", "--times", "7"], "is not recorded"),
        (["--png", "a.png", "--times", "soon"], "write times"),
        (["--png", "a.png", "--size", "big"], "write WIDTHxHEIGHT"),
        (["--png", "a.png", "--size", "1x1"], "from 16 to 8192"),
        (["--png", "a.png", "--fixed", "gone"], "known are glass, show, hide"),
        (["--png", "a.png", "--target", "1,b,2"], "write X,Y,Z"),
        (["--png", "a.png", "--target", "nobody"], "no body"),
        (["--png", "a.png", "--width", "0"], "width"),
        (["--mp4", "a.mp4", "--size", "33x21"], "even numbers"),
        (["--gif", "a.gif", "--fps", "0"], "must be positive"),
        (["--csv", "no/a.csv"], "does not exist"),
        ([], "give --out"),
    ],
)
def test_bad_input_is_told(recorded, tmp_path, monkeypatch, arguments, told):
    monkeypatch.chdir(tmp_path)
    done = call("export", recorded, *arguments)
    assert done.exit_code == 2
    assert told in done.output
    assert list(tmp_path.iterdir()) == []


# Breaks when a saved simulation, a scene or nothing is taken for a recording.
def test_only_recordings(tmp_path):
    Simulation(scenes.make("pendulum")).save(tmp_path / "saved.h5")
    for subject in (tmp_path / "saved.h5", "pendulum", tmp_path / "gone.h5"):
        assert call("export", subject, "--csv", tmp_path / "a.csv").exit_code == 2
    assert not (tmp_path / "a.csv").exists()
