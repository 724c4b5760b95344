"""benchmarks/sensitivity.py: tuned numbers can be set by name, and what lies within the noise is flat."""

import sys

import amontons
import numpy as np
import pytest
from amontons import _core, scenes


@pytest.fixture(scope="module")
def sensitivity(root):
    with pytest.MonkeyPatch.context() as patch:
        for folder in (root / "benchmarks", root / "tools"):
            patch.syspath_prepend(str(folder))
        pytest.importorskip("mujoco", reason="the benchmarks need more packages than the tests")
        pytest.importorskip("PIL", reason="the benchmarks need more packages than the tests")
        import sensitivity

        before = list(sys.path)
        yield sensitivity
        sys.path[:] = before


def heights(steps=400):
    scene = scenes.get("newtons_cradle")
    simulation = amontons.Simulation(scene.make(), dt=scene.dt, **scene.options)
    for _ in range(steps):
        simulation.step()
    return simulation.state.positions.copy()


# Breaks when a number is read before it is set, as constants are, or when its value of today does not return.
def test_a_number_changes_what_later_steps_do():
    today = _core.policy()["step.most_repeats"]
    before = heights()
    try:
        _core.set_policy("step.most_repeats", 1)
        assert not np.array_equal(heights(), before)
    finally:
        _core.set_policy("step.most_repeats", today)
    assert np.array_equal(heights(), before)


# Breaks when a name that is wrong, or half of a count, is taken without a word.
@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("step.most_mistakes", 1.0, "no tuned number"),
        ("step.most_looks", 0.5, "whole number"),
        ("step.most_looks", -1.0, "whole number"),
        ("step.steps_of_slack", float("nan"), "must be a number"),
    ],
)
def test_what_is_no_number_is_refused(name, value, message):
    with pytest.raises(amontons.InputError, match=message):
        _core.set_policy(name, value)


# Breaks when a room is not varied, a neutral value of policy.hpp is lost, or a count is halved to a fraction.
def test_each_number_is_halved_doubled_and_switched_off(sensitivity):
    tried = {value.name: value.value for value in sensitivity.values()}
    numbers = _core.policy()
    assert {name.rsplit(" ", 1)[0] for name in tried} == set(numbers)
    assert tried["step.steps_of_slack off"] == 0
    assert tried["curve.most_bend half"] == 0.35
    assert tried["step.steps_of_slack twice"] == pytest.approx(2 * numbers["step.steps_of_slack"])
    assert all(name.startswith("step.") for name in (v.number for v in sensitivity.values(["step"], [])))


def results(missed, bits):
    rows = [{"missed": m, "products": 100, "bits": bits} for m in missed]
    return {"a pile": rows}


# Breaks when a difference within the noise of the starts is told as a loss, or a larger one is not.
@pytest.mark.parametrize(
    ("missed", "told"),
    [([24, 18, 21], "flat"), ([60, 58, 63], "twice is worse: scenes: missed +40"), ([20, 20, 20], "no run")],
)
def test_what_lies_within_the_noise_is_flat(sensitivity, missed, told):
    value = sensitivity.Value("step.steps_of_slack", "twice", 2e-3)
    base = results([20, 16, 24, 20, 17, 23, 20, 20], "as today")
    found = results(missed, "as today" if told == "no run" else "other")
    row = sensitivity.row_of(value, found, base, {"scenes": ["a pile"]})
    assert sensitivity.verdict([row]).startswith(told)
    assert row["missed_noise"] == pytest.approx(
        3 * np.sqrt(2 / 3 * np.var([20, 16, 24, 20, 17, 23, 20, 20], ddof=1)) if told != "no run" else 1.0
    )


# Breaks when a value with which a run does not end counts as flat.
def test_what_does_not_end_is_worse(sensitivity):
    value = sensitivity.Value("step.steps_of_slack", "off", 0.0)
    row = sensitivity.row_of(value, None, {}, {"scenes": []})
    assert sensitivity.verdict([row]) == "off is worse: does not end"
