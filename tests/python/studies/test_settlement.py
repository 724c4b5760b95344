"""How far a support may move, against closed forms."""

import math

import pytest
from amontons import InputError
from amontons.studies import Assembly, settlement, stability
from blocks import box, ring


def beam(mu):
    """A beam over two supports, 1 m between their right edges, which overhangs both."""
    left = box("left", (-0.1, 0, -0.5), (0.1, 0.3, 0.5), fixed=True, friction=mu)
    right = box("right", (0.9, 0, -0.5), (0.1, 0.3, 0.5), fixed=True, friction=mu)
    return Assembly((left, right, box("beam", (-0.4, 0.0, 0), (1.8, 0.3, 0.1), friction=mu)))


# The right support of a beam goes down: the beam turns about the right edges of both, and slides once its
# slope is mu, at a movement of mu times 1 m. Breaks if geometry, contacts or the search are wrong.
def test_a_beam_slides_off_a_support_that_goes_down():
    mu = 0.2
    factor = stability(beam(mu), loads=[settlement("right", (0, 0, -1))]).factors[0]
    assert factor.unit == "m"
    assert factor.lower <= mu * (1 + 0.01)
    assert factor.lower == pytest.approx(mu, rel=0.03)
    assert factor.upper == pytest.approx(mu, rel=0.03)
    assert factor.upper - factor.lower <= 0.011 * factor.upper
    assert factor.mechanism.status == "falls"


# The support below the overhanging half of a block goes aside: the block tips once its centre is unsupported.
def test_a_block_tips_when_its_support_leaves():
    low = box("low", (0, 0, -0.5), (0.4, 0.3, 0.5), fixed=True, friction=0.0)
    wall = box("wall", (0.4, 0, 0.0), (0.2, 0.3, 0.2), fixed=True, friction=0.0)
    block = box("block", (0, 0, 0), (0.4, 0.3, 0.2), friction=0.0)
    # The wall holds the block in place while the smooth support leaves it.
    found = stability(Assembly((low, wall, block)), loads=[settlement("low", (-1, 0, 0), largest=0.3)])
    assert found.factors[0].lower == pytest.approx(0.2, rel=0.02)
    assert found.factors[0].upper == pytest.approx(0.2, rel=0.02)


# A movement that does not harm has no upper end. Breaks if the last look counts as a collapse.
def test_a_movement_without_collapse():
    low = box("low", (0, 0, -0.5), (0.4, 0.3, 0.5), fixed=True)
    found = stability(
        Assembly((low, box("block", (0, 0, 0), (0.4, 0.3, 0.2)))),
        loads=[settlement("low", (1, 0, -1), largest=0.01)],
    )
    assert found.factors[0].upper == math.inf
    assert found.factors[0].lower >= 0.01


def test_what_cannot_settle():
    with pytest.raises(InputError, match="'beam' is no support"):
        stability(beam(0.2), loads=[settlement("beam", (0, 0, -1))])
    with pytest.raises(InputError, match="no block 'lefft'"):
        stability(beam(0.2), loads=[settlement("lefft", (0, 0, -1))])
    with pytest.raises(InputError, match="direction"):
        settlement("left", (0, 0, 0))


def stone(k, inner, outer, stones=15):
    """(area, centroid) of a voussoir of straight edges, in (x, z) about the centre of a semicircle."""
    a, b = (math.pi * (k + j) / stones - math.pi / 2 for j in (0, 1))
    corners = [
        (r * math.sin(t), r * math.cos(t)) for r, t in ((inner, a), (outer, a), (outer, b), (inner, b))
    ]
    area = cx = cz = 0.0
    for (x0, z0), (x1, z1) in zip(corners, corners[1:] + corners[:1], strict=True):
        part = x0 * z1 - x1 * z0
        area, cx, cz = area + part / 2, cx + (x0 + x1) * part / 6, cz + (z0 + z1) * part / 6
    return abs(area), (cx / area, cz / area)


def thrust_at_the_springing(spread, inner, outer):
    """Where the thrust line of an arch of 15 stones crosses its right springing, over the outer radius.

    Its support went aside by `spread`. Hinges are at the intrados at -54 and 54 degrees, and at the extrados
    right of the key at 6 degrees; the parts between them turn as rigid bodies.
    """
    at = {t: (math.sin(math.radians(t)), math.cos(math.radians(t))) for t in (-54, 6, 54)}
    left, crown = [inner * x for x in at[-54]], [outer * x for x in at[6]]
    right = [inner * x for x in at[54]]
    moved = [right[0] + spread, right[1]]
    one, two = math.dist(left, crown), math.dist(right, crown)
    # The crown where circles about both lower hinges meet.
    apart = math.dist(left, moved)
    along = (one**2 - two**2 + apart**2) / (2 * apart)
    high = math.sqrt(one**2 - along**2)
    ex, ez = (moved[0] - left[0]) / apart, (moved[1] - left[1]) / apart
    top = [left[0] + along * ex - high * ez, left[1] + along * ez + high * ex]

    def turned(point, old, new, old_end, new_end):
        turn = math.atan2(new_end[1] - new[1], new_end[0] - new[0])
        turn -= math.atan2(old_end[1] - old[1], old_end[0] - old[0])
        dx, dz = point[0] - old[0], point[1] - old[1]
        return new[0] + math.cos(turn) * dx - math.sin(turn) * dz, new[1] + math.sin(turn) * dx + math.cos(
            turn
        ) * dz

    weights = {True: [], False: []}
    for k in range(3, 12):
        area, middle = stone(k, inner, outer)
        ends = (left, left, crown, top) if k < 8 else (right, moved, crown, top)
        weights[k < 8].append((area, turned(middle, *ends)))
    # Moments about the lower hinges give the thrust and the shear at the crown.
    lever_left = sum(w * (x - left[0]) for w, (x, _) in weights[True])
    lever_right = sum(w * (moved[0] - x) for w, (x, _) in weights[False])
    # The right part pushes the left one by (-h, v): h z1 + v x1 = lever_left, h z2 - v x2 = lever_right.
    x1, z1 = top[0] - left[0], top[1] - left[1]
    x2, z2 = moved[0] - top[0], top[1] - moved[1]
    h = (lever_left * x2 + lever_right * x1) / (z1 * x2 + z2 * x1)
    v = (lever_left - h * z1) / x1
    down = v + sum(w for w, _ in weights[False])
    # The lower right part hangs on its support: (h, -down) acts at the hinge, the resultant crosses z = 0.
    below = [stone(k, inner, outer) for k in range(12, 15)]
    total = down + sum(w for w, _ in below)
    moment = right[0] * down + right[1] * h + sum(w * x for w, (x, _) in below)
    return moment / total / outer


# An arch whose right support goes aside falls once the thrust line reaches the extrados of that springing, as
# a plane chain of rigid parts says. Breaks if blocks on moved supports have wrong poses.
def test_an_arch_on_spreading_supports():
    inner, outer = 0.925, 1.075
    low, high = 0.01, 0.2
    while high - low > 1e-6:
        middle = (low + high) / 2
        low, high = (middle, high) if thrust_at_the_springing(middle, inner, outer) < 1 else (low, middle)
    arch = ring(15, math.pi / 2, 1.0, 0.15, mu=0.9)
    factor = stability(arch, loads=[settlement("right", (1, 0, 0))]).factors[0]
    assert factor.lower == pytest.approx(low, rel=0.02)
    assert factor.upper == pytest.approx(low, rel=0.02)
