"""What a page plays and who owns it; the page itself is looked at in test_viewer_browser."""

import threading

import amontons
import numpy as np
import pytest
from amontons import ModelBuilder, Simulation, scenes, shapes
from amontons.viewer.plots import columns
from amontons.viewer.runs import LiveRun, ReplayRun
from amontons.viewer.spring import FREQUENCY, Spring, connected_mass
from waiting import processor_time


def stack():
    return Simulation(scenes.make("stack", boxes=3), dt=5e-3, on_failure="ignore")


def same_state(a, b):
    return all(
        np.array_equal(getattr(a.state, name), getattr(b.state, name))
        for name in ("positions", "orientations", "linear_velocities", "angular_velocities")
    )


@pytest.fixture
def served(request):
    """A function that opens a viewer, which is closed after the test."""
    pytest.importorskip("viser", reason="needs viser: pip install 'amontons[view]'")
    opened = []

    def serve(subject, **options):
        opened.append(amontons.view(subject, **options))
        return opened[-1]

    yield serve
    for viewer in opened:
        viewer.close()


# Breaks when what the page plays is not what the simulation does by itself, or reset is not the beginning.
def test_live_run_is_the_simulation():
    run, alone = LiveRun(stack()), stack()
    run.advance(0.1, 10.0)  # 0.1 s of clock with 10 s to do it in: twenty steps
    alone.run(0.1)
    assert run.time == alone.time
    assert same_state(run.simulation, alone)
    assert run.history.shape == (20, 6)
    run.reset()
    assert run.time == 0
    assert same_state(run.simulation, stack())


# Breaks when a page that cannot keep pace freezes to catch up: it may take a part of its period only, and
# what is behind is dropped.
@pytest.mark.alone
def test_live_run_leaves_time_for_the_page():
    run = LiveRun(stack())
    run.speed = 1e6
    with processor_time() as spent:
        run.advance(1.0, 0.05)  # a million seconds to simulate
    assert spent.seconds < 1.0
    steps = run.simulation.steps
    run.speed = 1.0
    run.advance(0.0, 0.05)
    assert run.simulation.steps <= steps + 1


# Breaks when the spring has not the frequency that it says, is not damped, or its load stays after release: a
# body of mass m that hangs from k = m w^2 rests g / w^2 below the pointer.
def test_spring_carries_a_body():
    builder = ModelBuilder()
    builder.add_body("ball", shape=shapes.Sphere(0.1), density=1000)
    sim = Simulation(builder.build(), dt=2e-3)
    spring = Spring(sim)
    sim.before_step.append(spring.before_step)
    sim.state.forces[0] = (1.0, 0.0, 0.0)  # the user's own
    spring.grab(0, np.zeros(3))
    sim.run(5.0)
    m, stiffness = sim.model.bodies[0].mass, sim.model.bodies[0].mass * (2 * np.pi * FREQUENCY) ** 2
    expected = np.array([1.0, 0.0, -9.81 * m]) / stiffness
    # The spring acts with the state at the start of a step, of which the rest knows nothing.
    np.testing.assert_allclose(sim.state.positions[0], expected, atol=1e-6)
    spring.release()
    assert sim.state.forces[0].tolist() == pytest.approx([1.0, 0.0, 0.0], abs=1e-12)
    assert np.abs(sim.state.torques[0]).max() < 1e-12


# Breaks when pulling a light link at its end shakes it apart: joints connect it with what is a thousand times
# as heavy.
def test_spring_is_stable_on_a_light_link():
    builder = ModelBuilder()
    builder.add_body("heavy", shape=shapes.Sphere(0.2), density=30000)
    builder.add_body("light", shape=shapes.Capsule(0.02, 0.1), density=500, position=(0, 0, -0.4))
    builder.add_ball_joint("light", "heavy", point=(0, 0, -0.25))
    sim = Simulation(builder.build(), dt=5e-3)
    masses = connected_mass(sim.model)
    assert masses[0] == masses[1] == pytest.approx(sum(b.mass for b in sim.model.bodies))
    spring = Spring(sim)
    sim.before_step.append(spring.before_step)
    spring.grab(1, sim.state.positions[1] + (0, 0, -0.12))
    spring.pull(np.array([1.0, 0.0, 0.0]))
    sim.run(2.0)
    assert np.abs(sim.state.angular_velocities).max() < 50
    assert np.abs(sim.state.positions[1]).max() < 30  # both fall freely, 20 m


# Breaks when options that are changed half way disturb the state, or are not those of the next step.
def test_options_change_while_it_goes_on():
    sim = stack()
    sim.run(0.1)
    other = sim.copy()
    sim.change_options(dt=1e-3, method="apgd", tolerance=1e-8)
    assert same_state(sim, other)
    assert (sim.time, sim.steps, sim.dt) == (other.time, other.steps, 1e-3)
    sim.state.linear_velocities[0] = (0.5, 0, 0)  # at rest the start would be accepted
    report = sim.step()
    assert report.method == "apgd"
    assert report.time == pytest.approx(other.time + 1e-3)
    for bad in ({"methods": "apgd"}, {"dt": -1.0}, {"method": "none"}):
        before = dict(sim.options)
        with pytest.raises(amontons.InputError):
            sim.change_options(**bad)
        assert dict(sim.options) == before


@pytest.fixture
def recording(tmp_path):
    sim = stack()
    with amontons.record(tmp_path / "a.h5", sim, every=2) as recorder:
        for _ in range(20):
            recorder.add(sim.step())
    with amontons.read_recording(tmp_path / "a.h5") as opened:
        yield opened


# Breaks when a recording is played at another speed than it says, past its end, or shows another frame.
def test_replay_shows_the_frames(recording):
    run = ReplayRun(recording)
    run.playing, run.speed = True, 0.5
    run.advance(0.045, 1.0)  # 22.5 ms of simulated time: two frames of 10 ms have begun
    assert run.frame == 2
    assert run.time == pytest.approx(0.02)
    assert np.array_equal(run.positions, recording.positions[2])
    assert run.history[:, 0].tolist() == pytest.approx([0.005, 0.01, 0.015, 0.02])
    run.advance(100.0, 1.0)
    assert (run.frame, run.playing) == (10, False)
    run.seek(-5)
    assert run.frame == 0


# Breaks when a command of the page is run by another thread than the one that plays, when they are run in
# another order than they were posted in, or when closing leaves the simulation with a load or a callback.
def test_commands_are_run_by_the_owner(served):
    sim = stack()
    viewer = served(sim)
    done = threading.Event()
    seen = []
    for k in range(50):
        viewer.post(lambda k=k: seen.append((k, threading.current_thread().name)))
    viewer.post(done.set)
    assert done.wait(20)
    assert [k for k, _ in seen] == list(range(50))
    assert {name for _, name in seen} == {"amontons viewer"}
    with pytest.raises(amontons.InputError, match="play=None"):
        viewer.update()
    viewer.close()
    assert sim.before_step == []


# Breaks when an error of a command or of a step ends the thread in place of the play.
def test_an_error_stops_the_play_only(served):
    viewer = served(stack(), play=True)
    done = threading.Event()

    def fault():
        raise amontons.InputError("no such thing")

    viewer.post(fault)
    viewer.post(done.set)
    assert done.wait(20)
    assert not viewer.run.playing


# Breaks when the program that steps by itself does not get what the page asks for, at its own pace.
def test_a_program_may_step_by_itself(served):
    sim = stack()
    viewer = served(sim, play=None)
    viewer.post(lambda: sim.change_options(tolerance=1e-3))
    sim.step()
    viewer.update()
    assert sim.options["tolerance"] == 1e-3
    assert viewer.url.startswith("http://localhost:")
    assert viewer.url in viewer._repr_html_()


# Breaks when what is followed does not stay where it was seen, jumps when following begins or ends, or what
# is dragged meanwhile is not where the pointer is: the world moves back by what the body has moved.
def test_the_eye_follows_a_body(served):
    sim = stack()
    viewer = served(sim, play=None)
    viewer.choose(2)
    sim.state.positions[2] += (1.0, 0.0, 0.0)
    viewer.follow(True)
    viewer.show()
    assert viewer.stage.offset.tolist() == [0, 0, 0]
    sim.state.positions[2] += (0.5, 0.25, 0.0)
    viewer.show()
    assert viewer.stage.offset.tolist() == [0.5, 0.25, 0]
    assert tuple(viewer.stage._root.position) == (-0.5, -0.25, 0)
    viewer.follow(False)
    sim.state.positions[2] += (9.0, 0.0, 0.0)
    viewer.show()
    assert viewer.stage.offset.tolist() == [0.5, 0.25, 0]


# Breaks when an instance of the page is not where its body is, or shows another shape when asked for.
def test_instances_are_where_their_bodies_are(served):
    builder = ModelBuilder()
    builder.add_body("ball", shape=shapes.Sphere(0.5), density=1)
    builder.add_visual("ball", shapes.Box((0.1, 0.1, 0.1)), position=(1, 0, 0))
    sim = Simulation(builder.build())
    viewer = served(sim, play=None)
    sim.state.positions[0], sim.state.orientations[0] = (0, 0, 3), (0, 0, 0, 1)  # half a turn about z
    viewer.show()
    for which, expected in (("visual", (-1, 0, 3)), ("collision", (0, 0, 3))):
        viewer.stage.show_shapes(which)
        viewer.show()
        ((_, handle),) = viewer.stage._batches
        np.testing.assert_allclose(handle.batched_positions[0], expected, atol=1e-6)


# Breaks when walls hide what is in a box, what stands free is drawn as of glass, or the switch does nothing.
@pytest.mark.parametrize(("name", "glass"), [("hopper", True), ("spheres_in_box", True), ("incline", False)])
def test_walls_are_seen_through(served, name, glass):
    viewer = served(Simulation(scenes.make(name)), play=None)
    assert viewer.stage.see_through == glass
    for wanted in (glass, not glass):
        viewer.stage.show_through(wanted)
        for batch, handle in viewer.stage._batches:
            assert handle.opacity == (0.25 if wanted and not batch.moves else None)


# Breaks when a plot shows another quantity, or a residual of zero leaves it without one.
def test_plots_show_the_history():
    run = LiveRun(stack())
    run.advance(0.05, 10.0)
    t, values = columns(run.history, "contacts")
    assert t.tolist() == pytest.approx([0.005 * (k + 1) for k in range(10)])
    assert values[-1] == len(run.contacts)
    assert columns(np.zeros((1, 6)), "residual")[1].tolist() == [-16]


# Breaks when something that has no view, or a place where no page can be, is not refused by name.
def test_bad_input_is_refused(served):
    with pytest.raises(amontons.InputError, match="str"):
        served("wall")
    with pytest.raises(amontons.InputError, match="speed"):
        served(stack(), speed=0.0)
    sim = stack()
    for place, named in (
        ({"host": "no.such.host.invalid"}, "host"),
        ({"port": 0}, "port"),
        ({"port": 70000}, "port"),
    ):
        with pytest.raises(amontons.InputError, match=named):
            served(sim, **place)
    assert sim.before_step == []


# Breaks when the first view is so wide that balls look like eggs, or begins inside of a wall: a ball beside
# a block that stands where the eye would be is looked at from elsewhere.
def test_the_eye_begins_in_the_open(served):
    def eye(*walls):
        builder = ModelBuilder()
        for position, half in walls:
            builder.add_geom(None, shapes.Box(half), position=position)
        builder.add_body("ball", shape=shapes.Sphere(0.5), density=1000)
        viewer = served(Simulation(builder.build()))
        camera = viewer._server.initial_camera
        assert np.degrees(camera.fov) <= 45
        return np.array(camera.position)

    free = eye()
    again = eye((tuple(free), (0.5, 0.5, 0.5)))
    assert (abs(again - free) > 0.5).any()
    assert np.linalg.norm(again) == pytest.approx(np.linalg.norm(free))
    assert eye(((0, 0, 0), (50, 50, 1.2)))[2] > 1.2  # nowhere around, but above


# Breaks when the first view begins between the walls of a funnel, or no longer within those of a hall: a ball
# of 1 m between four walls 4 m apart is looked at from outside, between walls 40 m apart from inside.
@pytest.mark.parametrize(("reach", "outside"), [(2.0, True), (20.0, False)])
def test_the_eye_begins_outside_of_a_funnel(served, reach, outside):
    builder = ModelBuilder()
    for x, y in ((1, 0), (-1, 0), (0, 1), (0, -1)):
        half = (0.1, reach, 5.0) if x else (reach, 0.1, 5.0)
        builder.add_geom(None, shapes.Box(half), position=(reach * x, reach * y, 0))
    builder.add_body("ball", shape=shapes.Sphere(0.5), density=1000)
    eye = np.array(served(Simulation(builder.build()))._server.initial_camera.position)
    assert (np.abs(eye[:2]).max() > reach) == outside


# Breaks when the panel does not say that the page is slower than it should be, or that it is as fast.
def test_pace_is_told_in_words():
    from amontons.viewer.panel import arrow_label, pace_of

    run = LiveRun(stack())
    run.achieved = 0.0612
    assert pace_of(run) == "slower than real time (0.061x)"
    run.achieved = 0.998
    assert pace_of(run) == "1.00x real time"
    run.speed, run.achieved = 2.0, 1.0
    assert pace_of(run) == "slower than 2 x real time (1x)"
    assert [arrow_label(k) for k in (0, 1, -1, 2.3)] == [
        f"Arrow length x{t}" for t in ("1", "10", "0.1", "200")
    ]


# Breaks when the box beside a slider cuts its number: at most six characters, on steps within the given ends.
@pytest.mark.parametrize(
    ("low", "high"), [(-np.pi, np.pi), (-1, 1), (-0.0573, 0.0572), (0.1 / 3, 2e-1), (-1234.5, 777.7)]
)
def test_numbers_of_sliders_are_short(low, high):
    from amontons.viewer.inspector import round_steps

    first, last, step = round_steps(low, high)
    assert low - 1e-9 <= first < last <= high + 1e-9
    assert first - low < step
    assert high - last < step
    assert 100 <= (last - first) / step <= 500
    for k in range(round((last - first) / step) + 1):
        assert len(f"{round(first + k * step, 9):g}") <= 7


# Breaks when a page has viser's title in place of the name of what it shows, or a name is markup.
def test_titles():
    from pathlib import Path

    from amontons.viewer.title import title_of, with_title

    path = Path("out/run.h5")
    assert title_of("hopper count=20 angle=3", path) == "hopper"
    assert title_of("my models/arm 2.xml elbow=1", path) == "arm 2"
    assert title_of("", path) == "run"
    page = "<head><title>Viser</title></head>"
    assert with_title(page, "a</title><b>") == "<head><title>a&lt;/title&gt;&lt;b&gt;</title></head>"


# Breaks when a line of the network is elsewhere, or as thick, as it should be: bars are cylinders of radius
# one and half length one along z.
def test_network_bars_lie_on_their_lines(served):
    from amontons.model.turns import rotate
    from amontons.viewer.network import Network

    viewer = served(stack())
    network = Network(viewer._server, "/test", room=4)
    start = np.array([[0, 0, 0], [1, 1, 1], [0, 0, 2.0]])
    end = np.array([[0, 0, 1], [2, 1, 0], [0, 0, 1.0]])
    network.show((start, end, np.array([0.1, 0.2, 0.3]), np.full((3, 3), 9, dtype=np.uint8)))
    handle = network._handle
    for sign, ends in ((-1, start), (1, end)):
        tips = np.column_stack((np.zeros((3, 2)), sign * handle.batched_scales[:3, 2]))
        at = handle.batched_positions[:3] + rotate(handle.batched_wxyzs[:3], tips)
        assert at == pytest.approx(ends, abs=1e-6)
    assert 2 * handle.batched_scales[:3, 0] == pytest.approx(np.array([0.1, 0.2, 0.3]))
    assert (handle.batched_scales[3:] == 0).all()
