"""Recordings: what comes back, what a crash leaves, what is refused."""

import os

import amontons
import h5py
import numpy as np
import pytest
from amontons import scenes

STATE = ("positions", "orientations", "linear_velocities", "angular_velocities", "joint_coordinates")


def simulation(scene="stack", **parameters):
    return amontons.Simulation(scenes.make(scene, **parameters), dt=5e-3, on_failure="ignore")


def hidden(folder):
    return [p.name for p in folder.iterdir() if p.name.startswith(".")]


# Breaks when a frame differs from the state it was made of by a bit, frames are lost or counted wrongly, or
# the contacts of one frame are handed out for another. With joints (pendulum) and with contacts (stack).
@pytest.mark.parametrize(("scene", "parameters"), [("stack", {"boxes": 3}), ("pendulum", {})])
def test_comes_back(tmp_path, scene, parameters):
    sim = simulation(scene, **parameters)
    states, contacts, reports = [], [], []

    def remember():
        states.append({name: getattr(sim.state, name).copy() for name in STATE})
        contacts.append(sim.contacts.copy())

    remember()
    with amontons.record(tmp_path / "a.h5", sim, every=3, source="here") as recorder:
        for step in range(1, 12):
            reports.append(sim.step())
            recorder.add(reports[-1])
            if step % 3 == 0:
                remember()
    with amontons.read_recording(tmp_path / "a.h5") as recording:
        assert len(recording) == len(states) == 4
        assert recording.steps.tolist() == [0, 3, 6, 9]
        assert recording.times == pytest.approx(np.array([0, 3, 6, 9]) * 5e-3, abs=1e-12)
        assert recording.complete
        assert recording.source == "here"
        assert recording.options["dt"] == 5e-3
        assert recording.model == sim.model
        for k, state in enumerate(states):
            for name in STATE:
                np.testing.assert_array_equal(getattr(recording, name)[k], state[name])
            np.testing.assert_array_equal(recording.contacts(k), contacts[k])
        np.testing.assert_array_equal(recording.contacts(-1), contacts[-1])
        assert recording.contacts(1).dtype == sim.contacts.dtype
        assert recording.reports["time"].tolist() == [r.time for r in reports]
        assert recording.reports["status"].tolist() == [r.status for r in reports]
        assert recording.reports["solve"].tolist() == [r.timings.solve for r in reports]
        assert recording.frame_at(0.031) == 2
        with pytest.raises(amontons.InputError, match="there is no frame 4; the recording has 4"):
            recording.contacts(4)


# Breaks when the contacts of a recording from before there were moments can no longer be read, by name, or
# when moments are not recorded.
def test_contacts_without_moments(tmp_path):
    sim = simulation("rolling_balls")
    with amontons.record(tmp_path / "a.h5", sim) as recorder:
        recorder.add(sim.step())
    with amontons.read_recording(tmp_path / "a.h5") as recording:
        whole = recording.contacts(1)
    assert np.abs(whole["torque"]).max() > 0
    with h5py.File(tmp_path / "a.h5", "r+") as file:
        rows = file["contacts/rows"][()]
        del file["contacts/rows"]
        file["contacts/rows"] = rows[[n for n in rows.dtype.names if n not in ("torque", "spin")]]
    with amontons.read_recording(tmp_path / "a.h5") as recording:
        old = recording.contacts(1)
    assert old.dtype == whole.dtype
    for name in whole.dtype.names:
        np.testing.assert_array_equal(old[name], 0 if name in ("torque", "spin") else whole[name])


# Breaks when frames that did not fit the buffer are lost or written twice.
def test_many_flushes(tmp_path, monkeypatch):
    monkeypatch.setattr("amontons.io.recordings.recorder.BUFFER", 1000)
    sim = simulation(boxes=2)
    heights = [sim.state.positions[1, 2]]
    with amontons.record(tmp_path / "a.h5", sim) as recorder:
        for _ in range(20):
            recorder.add(sim.step())
            heights.append(sim.state.positions[1, 2])
    recording = amontons.read_recording(tmp_path / "a.h5")
    assert recording.positions[:, 1, 2].tolist() == heights
    assert [len(recording.contacts(k)) for k in (1, 20)] == [8, 8]
    recording.close()


# Breaks when contact tables are stored against the wish of the caller.
def test_without_contacts(tmp_path):
    sim = simulation(boxes=2)
    with amontons.record(tmp_path / "a.h5", sim, contacts=False) as recorder:
        recorder.add(sim.step())
    with amontons.read_recording(tmp_path / "a.h5") as recording:
        assert len(recording.contacts(1)) == 0
        assert recording.reports["contacts"].tolist() == [8]


# Breaks when a recording that an exception ended loses what came before, or passes for complete.
def test_exception_keeps_what_was_recorded(tmp_path):
    sim = simulation(boxes=2)
    path = tmp_path / "a.h5"

    def fail():
        with amontons.record(path, sim) as recorder:
            recorder.add(sim.step())
            raise RuntimeError("power cut")

    with pytest.raises(RuntimeError, match="power cut"):
        fail()
    assert hidden(tmp_path) == []
    with amontons.read_recording(path) as recording:
        assert len(recording) == 2
        assert not recording.complete


# Breaks when a bad path or option is noticed late, or leaves a file behind.
def test_bad_input_of_the_writer(tmp_path):
    sim = simulation(boxes=1)
    with pytest.raises(amontons.FileError, match="does not exist"):
        amontons.record(tmp_path / "gone" / "a.h5", sim)
    with pytest.raises(amontons.FileError, match="is a directory"):
        amontons.record(tmp_path, sim)
    for every in (0, -1, 1.5, True):
        with pytest.raises(amontons.InputError, match="every = "):
            amontons.record(tmp_path / "a.h5", sim, every=every)
    assert os.listdir(tmp_path) == []
    recorder = amontons.record(tmp_path / "a.h5", sim)
    recorder.close()
    recorder.close()
    with pytest.raises(amontons.InputError, match="is closed"):
        recorder.add(sim.step())


# Breaks when files that are no recordings, or damaged ones, give anything but one sentence with their name.
def test_bad_files(tmp_path):
    sim = simulation(boxes=1)
    good, text, saved, damaged, newer, descends, beyond = (
        tmp_path / f"{n}.h5" for n in ("good", "text", "saved", "bad", "new", "descends", "beyond")
    )
    with amontons.record(good, sim) as recorder:
        recorder.add(sim.step())
    text.write_text("no HDF5")
    sim.save(saved)
    for path in (damaged, newer, descends, beyond):
        path.write_bytes(good.read_bytes())
    with h5py.File(damaged, "a") as file:
        del file["frames/positions"]
    with h5py.File(newer, "a") as file:
        file["version"][...] = 99
    with h5py.File(descends, "a") as file:
        offsets = file["contacts/offsets"][...]
        assert offsets[0] < offsets[-1]
        file["contacts/offsets"][...] = offsets[::-1]
    with h5py.File(beyond, "a") as file:
        file["contacts/offsets"][-1] = 10**6
    for path, message in (
        (text, "is no HDF5 file"),
        (saved, "is no recording"),
        (damaged, "/frames/positions is missing"),
        (newer, "version 99"),
        (descends, "/contacts/offsets must ascend"),
        (beyond, "ascend from 0 to at most 4, the rows"),
        (tmp_path, "is a directory"),
    ):
        with pytest.raises(amontons.FileError, match=message) as caught:
            amontons.read_recording(path)
        assert str(caught.value).startswith(str(path))
    with pytest.raises(FileNotFoundError, match="gone.h5: no such file"):
        amontons.read_recording(tmp_path / "gone.h5")


# Breaks when q, qd and controls of a frame are those of another one, rates are no columns, or a simulation
# from a frame goes elsewhere: without contacts its steps need no impulses, and follow the recorded ones to
# rounding.
def test_coordinates_of_frames(tmp_path):
    builder = amontons.ModelBuilder()
    builder.add_body("bob", shape=amontons.shapes.Sphere(0.05), mass=1.0, position=(0.3, 0, 0))
    builder.add_revolute_joint("bob", axis=(0, 1, 0), point=(0, 0, 0), name="pin",
                               motor=amontons.Motor("effort"))  # fmt: skip
    sim = amontons.Simulation(builder.build(), dt=2e-3)
    rows = [(sim.q, sim.qd, sim.controls.copy())]
    with amontons.record(tmp_path / "run.h5", sim) as recorder:
        for step in range(20):
            sim.controls = [0.1 * step]
            recorder.add(sim.step())
            rows.append((sim.q, sim.qd, sim.controls.copy()))
    with amontons.read_recording(tmp_path / "run.h5") as recording:
        for k, name in enumerate(("q", "qd", "controls")):
            np.testing.assert_array_equal(getattr(recording, name)[:], [row[k] for row in rows])
        rate = recording.column("pin.rate")
        np.testing.assert_array_equal(rate.values, recording.qd[:, 0])
        assert rate.unit == "rad/s"
        again = recording.simulation(12)
        assert again.time == pytest.approx(12 * 2e-3)
        assert again.steps == 12
        again.controls = recording.controls[13]
        again.step()
        # A frame has q and qd, and a step from it begins anew: within h^3 of the change of the acceleration,
        # w^2 of the rate and that of the torque over the inertia.
        change = 9.81 / 0.3 * abs(recording.qd[12, 0]) + 0.1 / 2e-3 / (0.3**2 + 0.4 * 0.05**2)
        np.testing.assert_allclose(again.q, recording.q[13], atol=2e-3**3 * change)
        assert recording.simulation(-1, dt=1e-3).dt == 1e-3
        with pytest.raises(amontons.InputError, match="there is no frame 30"):
            recording.simulation(30)


# Breaks when a run that nobody recorded ends without a word.
def test_a_run_that_was_not_recorded(tmp_path):
    sim = simulation()
    with (
        pytest.warns(amontons.StepWarning, match="none was recorded"),
        amontons.record(tmp_path / "a.h5", sim),
    ):
        sim.run(0.02)
    with amontons.record(tmp_path / "b.h5", sim) as recorder:
        sim.run(0.02, after_step=recorder)


# Breaks when a recording without q, as older versions wrote them, cannot be read, or says nothing of
# remedies.
def test_recordings_of_older_versions(tmp_path):
    sim, path = simulation(), tmp_path / "run.h5"
    with amontons.record(path, sim) as recorder:
        recorder.add(sim.step())
    with h5py.File(path, "a") as file:
        for name in ("q", "qd", "controls"):
            del file["frames"][name]
    with amontons.read_recording(path) as recording:
        assert len(recording.positions[:]) == 2
        assert not any(name.endswith(".rate") for name in recording.columns)
        with pytest.raises(amontons.InputError, match="has no q: an older version wrote it"):
            _ = recording.q
        assert recording.simulation(1).time == pytest.approx(sim.time)
