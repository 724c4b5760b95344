"""The search for pairs on a device, against that of the host: the same pairs, and the same bits of a step."""

from collections import Counter

import amontons
import numpy as np
import pytest
from amontons import _core
from amontons.device import pairs
from amontons.device.methods import tiles
from amontons.device.pairs import PairFinder, level_sizes
from amontons.simulation import options
from device_problems import DEVICE, open_groups, pocl

GROUPS = (1, 7, 64, 256)


def cloud(count, decades=0.0, *, seed=1, same=0, far=0.0, haste=0.0):
    """Balls in their boxes, of radii over so many powers of ten, every seventh fixed; the first `same` in one
    place, all of them that far away, with travels of so many radii."""
    rng = np.random.default_rng(seed)
    centre = rng.random((count, 3)) * max(count, 1) ** (1 / 3)
    centre[:same] = centre[:1]
    radius = 0.5 * 10 ** -(decades * rng.random(count))
    fixed, travels = np.arange(count) % 7 == 3, haste * radius[:, None] * rng.normal(size=(count, 3))
    travels[fixed] = 0
    return centre + far - radius[:, None], centre + far + radius[:, None], fixed, radius, travels


def with_huge():
    """Two balls that reach all of the others, the first and the last, and planes, which have no end."""
    lower, upper, fixed, radius, travels = cloud(700, 1, haste=0.3)
    for at in (0, 699):
        lower[at], upper[at], radius[at] = -40, 50, 45
    for at in (5, 6, 300):
        lower[at], upper[at], radius[at] = -np.inf, np.inf, np.inf
    return lower, upper, fixed, radius, travels


def mixed():
    """Balls among boxes, which have no ball."""
    lower, upper, fixed, radius, travels = cloud(900, 1, haste=0.5)
    radius[::3] = np.inf
    return lower, upper, fixed, radius, travels


def no_balls():
    lower, upper, fixed, _, travels = cloud(300)
    return lower, upper, fixed, np.full(300, np.inf), travels


CLOUDS = {
    **{f"{n} equal balls": (lambda n=n: cloud(n)) for n in (0, 1, 2, 8, 9, 64, 65, 511, 513, 4097)},
    "radii over four powers of ten": lambda: cloud(1500, 4),
    "300 balls in one place": lambda: cloud(1000, same=300),
    "a million radii away": lambda: cloud(600, 1, far=1e6),
    "1e12 radii away": lambda: cloud(600, 1, far=1e12),
    "at the end of floats": lambda: cloud(100, far=1e300),
    "all fixed": lambda: (*cloud(200)[:2], np.ones(200, dtype=bool), *cloud(200)[3:]),
    "few move": lambda: (*cloud(3000, 1)[:2], np.arange(3000) % 50 != 3, *cloud(3000, 1)[3:]),
    "travels of a radius": lambda: cloud(1000, haste=1.0),
    "travels of ten radii": lambda: cloud(500, 1, haste=10.0),
    "one huge ball and planes": with_huge,
    "balls and boxes": mixed,
    "no balls": no_balls,
}


@pytest.fixture(scope="module")
def finders():
    """By work-group size."""
    return {group: PairFinder(open_groups(group)) for group in GROUPS}


def compare(finder, name):
    given = CLOUDS[name]()
    expected = _core.broad_phase(*given)
    np.testing.assert_array_equal(_core.broad_phase(*given, _core.PairSearch(finder.find, 1)), expected)
    return expected


# Breaks when a pair is lost, is found twice or is none of the host's: by a level of the tree, by the end of a
# level, by rounding to float, by a ball, by the place where it is written; when that depends on work groups.
@pytest.mark.parametrize("name", CLOUDS)
def test_pairs_are_those_of_the_host(finders, name):
    for finder in finders.values():
        compare(finder, name)


# Breaks when the kernels are no CUDA C++, mean something else there, or read what nobody wrote.
@pytest.mark.parametrize("name", CLOUDS)
def test_cuda_dialect(host, name):
    compare(PairFinder(host), name)


# Breaks when buffers of a search are taken for those of one with more or fewer boxes.
def test_buffers_stay(host):
    finder = PairFinder(host)
    for name in ("513 equal balls", "4097 equal balls", "8 equal balls", "no balls", "balls and boxes"):
        compare(finder, name)
    assert len(finder._idle) == 1


class Counting:
    """A backend whose calls are counted by name."""

    def __init__(self, held):
        self.held, self.calls = held, Counter()

    def __getattr__(self, name):
        found = getattr(self.held, name)

        def call(*arguments):
            self.calls[name] += 1
            return found(*arguments)

        return call if callable(found) else found


# Breaks when a search launches or reads more often than docs/device.md says.
def test_round_trips(host):
    counting = Counting(host)
    given = cloud(4096)  # 512 = 8^3 groups
    _core.broad_phase(*given, _core.PairSearch(PairFinder(counting).find, 1))
    assert (counting.calls["launch"], counting.calls["download"]) == (4 + 3, 2)


# Breaks when later searches of a step send the poses, or an order again, or take those of other poses.
def test_bytes_sent(host):
    finder, sent, found = PairFinder(host), [], []

    def find(leaves, number, boxes, balls, placed, travels, fixed, origin):
        assert placed == 0
        for poses, order, moved in (
            (7, 1, balls),
            (7, 1, balls),
            (8, 1, balls * (2, 2, 2, 1)),
            (0, 1, balls),
            (0, 2, balls),
        ):
            memory = finder._idle[0].memory if finder._idle else None
            before = memory.sent if memory else 0
            answer = finder.find(leaves, order, boxes, moved, poses, travels, fixed, origin)
            begins = 8 * tiles(len(leaves)) + 4 * len(level_sizes(len(leaves)))
            sent.append(finder._idle[0].memory.sent - before - begins)
            found.append(sorted(map(tuple, answer[1].tolist())))
        return answer

    _core.broad_phase(*cloud(512), _core.PairSearch(find, 1))
    per_geom = [sent[0] - 4 * 512, *sent[1:4], sent[4] - 4 * 512]
    assert per_geom == [512 * b for b in (57, 25, 57, 57, 57)]
    assert found[0] == found[1] == found[3] == found[4] != found[2]


# Breaks when more pairs than a kernel can count are written over each other, or a search that fails spoils
# the next one.
def test_too_many_pairs(host, monkeypatch):
    finder = PairFinder(host)
    with monkeypatch.context() as patch:
        patch.setattr(pairs, "MOST_PAIRS", 100)
        with pytest.raises(amontons.InputError, match=r'device "host" .* memory'):
            compare(finder, "513 equal balls")
    compare(finder, "513 equal balls")


# Breaks when the clouds above reach no tree of several levels, or no pair that a ball rejects.
def test_the_clouds_reach_everything():
    assert len(level_sizes(4104)) == 5
    lower, upper, fixed, radius, travels = cloud(4097, haste=1.0)
    boxes = _core.broad_phase(lower, upper, fixed, np.full(4097, np.inf), travels)
    still = _core.broad_phase(lower, upper, fixed, radius, np.zeros((4097, 3)))
    moving = _core.broad_phase(lower, upper, fixed, radius, travels)
    assert len(boxes) > 1.5 * len(still) > 1000
    assert len(moving) > 1.2 * len(still)


def dropped(count):
    """Grains of different radii over a plane, between walls, under one large ball."""
    rng = np.random.default_rng(5)
    builder = amontons.ModelBuilder()
    builder.add_geom(None, amontons.shapes.Plane())
    builder.add_geom(None, amontons.shapes.Box((0.02, 1, 1)), position=(-0.3, 0, 0))
    for k in range(count):
        at = np.array([k % 5, k // 5 % 5, k // 25])
        shape = (
            amontons.shapes.Box((0.03,) * 3)
            if k % 9 == 4
            else amontons.shapes.Sphere(rng.uniform(0.02, 0.05))
        )
        position = 0.11 * at + 0.01 * rng.random(3) + (-0.2, -0.2, 0.06)
        builder.add_body(position=tuple(position), shape=shape, density=1000)
    builder.add_body(position=(0, 0, 1.2), shape=amontons.shapes.Sphere(0.3), density=500)
    return builder.build()


SCENES = {
    "grains": (lambda: dropped(80), 100),
    "pile": (lambda: amontons.scenes.make("spheres_in_box", count=150), 100),
    "wall": (lambda: amontons.scenes.make("wall", columns=12, rows=10), 10),
    "tracked vehicle": (lambda: amontons.scenes.make("tracked_vehicle"), 3),
}


@pytest.fixture
def solves_on_the_host(monkeypatch):
    """The device searches alone."""
    monkeypatch.setattr(options, "source_of_device", lambda *_: None)


# Breaks when a search on the device gives a step another contact, in another order, or is not asked.
@pytest.mark.parametrize("name", SCENES)
def test_steps_have_the_bits_of_the_host(monkeypatch, solves_on_the_host, name):
    pocl()
    make, steps = SCENES[name]
    searches = []
    find = PairFinder.find
    monkeypatch.setattr(PairFinder, "find", lambda *given: searches.append(1) or find(*given))
    given = dict(tolerance=1e-3, on_failure="ignore")
    host = amontons.Simulation(make(), **given)
    there = amontons.Simulation(make(), **given, device=DEVICE, device_contacts=2)
    for _ in range(steps):
        expected, report = host.step(), there.step()
        assert report.contacts == expected.contacts
        assert report.residual == expected.residual
        for field in ("geom_a", "geom_b", "point", "normal", "gap"):
            np.testing.assert_array_equal(there.contacts[field], host.contacts[field])
        np.testing.assert_array_equal(there.state.positions, host.state.positions)
    assert len(host.contacts) > 20
    assert len(searches) > 1  # what one finds serves some steps


# Breaks when a small model is searched on the device, where launches take longer than its search.
def test_small_models_stay_on_the_host(monkeypatch):
    pocl()
    monkeypatch.setattr(PairFinder, "find", lambda *_: pytest.fail("searched"))
    make = SCENES["grains"][0]
    amontons.Simulation(make(), device=DEVICE, device_contacts=1000, on_failure="ignore").step()


# Breaks when an order that is out of date, or made by the host, gives a device other pairs.
def test_a_simulation_changes_its_device(solves_on_the_host):
    pocl()
    host = amontons.Simulation(dropped(80), tolerance=1e-3, on_failure="ignore")
    other = host.copy()
    for k in range(60):
        other.change_options(device=DEVICE if k // 7 % 2 else "cpu", device_contacts=2)
        host.step()
        other.step()
    np.testing.assert_array_equal(other.state.positions, host.state.positions)
