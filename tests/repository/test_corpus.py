"""The corpus and the performance profile that `auto` is judged by."""

import sys

import amontons
import numpy as np
import pytest


@pytest.fixture(scope="module")
def programs(root):
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(root / "benchmarks"))
        import corpus
        import performance_profile

        yield corpus, performance_profile
    for name in ("corpus", "performance_profile", "common"):
        sys.modules.pop(name, None)


@pytest.fixture(scope="module")
def corpus(programs):
    return programs[0]


@pytest.fixture(scope="module")
def profile(programs):
    return programs[1]


@pytest.fixture(scope="module")
def stack(corpus):
    """The first and the fifth step of three boxes at rest."""
    return list(corpus.steps_of(corpus.of_scene("stack", (1, 5), {}, boxes=3)))


# Breaks when the corpus depends on the clock, on memory, or on the choice of `auto`.
def test_a_sequence_gives_the_same_bits_twice(corpus, stack):
    again = list(corpus.steps_of(corpus.of_scene("stack", (1, 5), {}, boxes=3)))
    for a, b in zip(stack, again, strict=True):
        assert a.name == b.name
        assert np.array_equal(a.b, b.b)
        assert np.array_equal(a.x0, b.x0)


# Breaks when a stored step is another problem than that of the simulation: its warm start, the impulses of
# the step before, is a solution of a stack at rest up to what the heap still settles.
def test_the_warm_start_is_nearly_a_solution(stack):
    first, later = stack
    assert not first.x0.any()
    assert later.problem().residual(later.x0) < 1e-2


# Breaks when a robot's step has a matrix in place of bodies, which most methods of the profile need.
def test_steps_of_robots_have_bodies(corpus, root):
    dog = next(s for s in corpus.of_robots(root / "examples" / "models") if s.name.endswith("dog.urdf"))
    steps = list(corpus.steps_of(dog))
    assert steps
    assert all(step.problem().A.bodies == len(dog.make().bodies) for step in steps)


# Breaks when a contact of a pair takes the rows of another: matched to itself, every contact keeps its own.
def test_contacts_are_matched_with_themselves(corpus):
    sequence = corpus.of_scene("stack", (1,), {}, boxes=3)
    simulation = amontons.Simulation(sequence.make(), dt=sequence.dt)
    simulation.step()
    problem, x = simulation.problem(), simulation.forces.impulses.copy()
    assert np.array_equal(corpus.matched((simulation.contacts, x, problem), simulation.contacts, problem), x)


# Breaks when the halves follow anything but the name, or one of them is nearly empty.
def test_about_half_of_the_sequences_are_held_out(corpus):
    names = [sequence.name for sequence in corpus.sequences(None)]
    assert len(set(names)) == len(names)
    part = sum(map(corpus.held_out, names)) / len(names)
    assert 0.35 < part < 0.65


# Breaks when a law, a start or a tolerance is never tried.
def test_the_tasks_of_two_steps_cover_everything(profile, stack):
    tasks = list(profile.tasks([stack[1], stack[1], stack[1], stack[1]]))
    assert {t.law for t in tasks} == {"associated", "coulomb"}
    assert {t.warm for t in tasks} == {True, False}
    assert {t.tolerance for t in tasks} == set(profile.TOLERANCES)


# Breaks when the table counts a solve that `auto` misses as done, or compares with a method that failed.
def test_auto_is_compared_with_the_best_that_succeeds(profile, stack, monkeypatch):
    found = {"apgd": (2.0, 0.0, "converged", ""), "newton": (1.0, 0.1, "stalled", "")}
    rows = []
    for task, status in zip(profile.tasks(stack[1:]), ("converged", "stalled"), strict=False):
        given = found | {"auto": (3.0, 0.0, status, "")}
        monkeypatch.setattr(profile, "run", lambda problem, task, method, limit, given=given: given[method])
        rows += profile.measure(task, ["apgd", "newton"], 1.0)
    one, both = (profile.profile(rows[:n], rows[0]["half"]).splitlines()[2].split(" | ") for n in (3, 6))
    assert one[:3] == ["| `auto`", "1", "100"]
    assert one[5:] == ["1.50", "0 |"]
    assert both[:3] == ["| `auto`", "2", "50"]
    assert both[-1] == "1 |"


# Breaks when the program does not run as its first lines say.
def test_the_program_runs(profile, tmp_path, monkeypatch, capsys):
    words = ["p.py", "--only", "sliding_cube", "--corpus", str(tmp_path / "c"), "--out", str(tmp_path / "r")]
    monkeypatch.setattr(sys, "argv", [*words, "--quick"])
    profile.main()
    assert (tmp_path / "r" / "profile.csv").exists()
    assert "| method | solves |" in capsys.readouterr().out
