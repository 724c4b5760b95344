"""Arches, a dome, buttresses and flat arches against published values, closed forms and thrust lines."""

import math

import numpy as np
import pytest
from amontons.studies import Assembly, Block, horizontal, point_load, stability
from blocks import box, ground, ring
from scipy.optimize import linprog


def thrust_line(stones, half, inner, outer, *, lune=False):
    """The largest horizontal load over the weight for which a thrust line stays within the joints; None if
    there is none without load.

    The left support gives (H, V) and the moment M about the centre. At each joint the resultant has to cross
    between the radii: its moments about the inner and the outer end have opposite signs. All is linear in
    (H, V, M, load), for HiGHS.
    """
    fine = 40  # parts of a stone, of whose weights sums are taken
    step = 2 * half / stones
    rows, bounds = [], []
    weight = wx = wz = 0.0
    for k in range(stones + 1):
        angle = -half + k * step
        s, c = math.sin(angle), math.cos(angle)
        for r, sign in ((inner, 1.0), (outer, -1.0)):
            rows.append([sign * x for x in (r * c, -r * s, 1.0, r * c * weight - wz)])
            bounds.append(sign * (wx - r * s * weight))
        for j in range(fine):
            middle = angle + (j + 0.5) * step / fine
            share = (abs(math.sin(middle)) if lune else 1.0) * step / fine
            power = 3 if lune else 2
            weight += share * (outer**power - inner**power) / power
            lever = share * (outer ** (power + 1) - inner ** (power + 1)) / (power + 1)
            wx += lever * math.sin(middle)
            wz += lever * math.cos(middle)
    free = (None, None)
    found = linprog((0, 0, 0, -1), A_ub=rows, b_ub=bounds, bounds=[free, free, free, (0, None)])
    return found.x[3] if found.status == 0 else None


def least(stands, falls, enough, within):
    """The least value with which it stands, by halving."""
    while enough - falls > within:
        middle = (falls + enough) / 2
        falls, enough = (falls, middle) if stands(middle) else (middle, enough)
    return enough


# Milankovitch (1907): 0.1075 for radial cuts; Cocchetti and Rizzi (2020, Frattura ed Integrita Strutturale
# 51, table 3) compute 0.107426. The thrust line has it too. Breaks if weights or joints are wrong.
def test_the_thinnest_arch_by_a_thrust_line():
    thickness = least(
        lambda t: thrust_line(180, math.pi / 2, 1 - t / 2, 1 + t / 2) is not None, 0.05, 0.2, 1e-5
    )
    assert thickness == pytest.approx(0.1075, abs=1e-4)
    by_blocks = least(lambda t: stability(ring(60, math.pi / 2, 1.0, t)).stands, 0.10, 0.115, 1e-4)
    assert by_blocks == pytest.approx(thickness, rel=5e-3)


# Cocchetti and Rizzi (2020): below mu = 0.309215 no semicircular arch stands, whatever its thickness.
# Breaks if sliding at the springings and the haunches is not found.
def test_the_friction_below_which_no_arch_stands():
    thick = ring(60, math.pi / 2, 1.0, 0.35, mu=0.5)
    factor = stability(thick, friction_margin=True).factors[0]
    assert 0.5 * factor.upper == pytest.approx(0.309215, rel=5e-3)
    assert 0.5 * factor.lower <= 0.5 * factor.upper


# A dome that is cracked along its meridians is a row of lunes, with the weight of a lune.
# Breaks if blocks that taper have a wrong weight.
def test_the_thinnest_lune_of_a_dome():
    line = least(
        lambda t: thrust_line(60, math.pi / 2, 1 - t / 2, 1 + t / 2, lune=True) is not None, 0.02, 0.1, 1e-5
    )

    def lune(t):
        wide = math.tan(math.radians(5))
        return ring(60, math.pi / 2, 1.0, t, width=lambda r, angle: wide * (r * abs(math.sin(angle)) + 1e-3))

    by_blocks = least(lambda t: stability(lune(t)).stands, 0.03, 0.06, 1e-4)
    assert by_blocks == pytest.approx(line, rel=0.02)


# The arch of Oppenheim (1992): 157.5 degrees, seven stones, 0.15 of its radius thick.
# Breaks if the load does not act at the centres of the stones.
def test_the_horizontal_load_of_an_arch():
    half = math.radians(157.5) / 2
    line = thrust_line(7, half, 10 * 0.925, 10 * 1.075)
    factor = stability(ring(7, half, 10.0, 1.5, width=lambda r, angle: 1.0), loads=[horizontal(1)]).factors[0]
    assert factor.lower == pytest.approx(line, rel=0.01)


# A buttress of four courses, pushed at half of the height of the top one, turns about its base:
# H = w b^2 / 2 h / (h - c / 2), w the weight per area of its side. Breaks if another joint is decisive.
def test_a_buttress():
    b, c, courses = 0.8, 0.5, 4
    blocks = [box(f"course {k}", (0, 0, c * k), (b, 0.6, c), friction=1.5) for k in range(courses)]
    push = point_load("course 3", (1, 0, 0))
    factor = stability(Assembly((ground(friction=1.5), *blocks)), loads=[push]).factors[0]
    h, weight = c * courses, 2400 * 9.81 * 0.6
    assert factor.upper == pytest.approx(weight * b**2 / 2 * h / (h - c / 2), rel=2e-3)


# A wall out of plane turns about its base as one block: b / h, whatever its bond (its stones do not slide).
def test_a_wall_out_of_plane():
    stones = [
        box(f"{row}.{k}", (x, 0, 0.2 * row), (wide, 0.25, 0.2), friction=0.7)
        for row in range(6)
        for k, (x, wide) in enumerate(
            ((0, 0.4), (0.4, 0.4)) if row % 2 else ((0, 0.2), (0.2, 0.4), (0.6, 0.2))
        )
    ]
    factor = stability(Assembly((ground(friction=0.7), *stones)), loads=[horizontal(0, 1)]).factors[0]
    assert factor.upper == pytest.approx(0.25 / 1.2, rel=2e-3)


def prism(name, outline, **options):
    """A block of an outline (x, z), counter-clockwise seen from -y, 1 m deep."""
    n = len(outline)
    points = [(x, y, z) for y in (0.0, 1.0) for x, z in outline]
    triangles = [(0, k, k + 1) for k in range(1, n - 1)] + [(n, n + k + 1, n + k) for k in range(1, n - 1)]
    triangles += [
        t for k in range(n) for t in ((k, k + n, (k + 1) % n), ((k + 1) % n, k + n, (k + 1) % n + n))
    ]
    return Block(name, np.array(points), np.array(triangles), **options)


# A flat arch: a key between two piers on the ground, whose joints lean by t from the vertical. Loaded by P it
# slides down and pushes the piers aside: (P + W) / 2 cot(t + phi) = mu (W_pier + (P + W) / 2), tan phi = mu.
# Breaks if friction in leaning joints, or a load on one block, is wrong.
def test_a_flat_arch_fails_by_friction():
    mu, lean, low, high, half, wide = 0.3, math.radians(15), 0.1, 1.0, 0.3, 3.0
    inner = [half + z * math.tan(lean) for z in (0.0, high)]
    key_at = [half + low * math.tan(lean), inner[1]]
    right = prism("right", [(inner[0], 0), (wide, 0), (wide, high), (inner[1], high)], friction=mu)
    left = prism("left", [(-wide, 0), (-inner[0], 0), (-inner[1], high), (-wide, high)], friction=mu)
    key = prism(
        "key", [(-key_at[0], low), (key_at[0], low), (key_at[1], high), (-key_at[1], high)], friction=mu
    )
    blocks = Assembly((ground(friction=mu), left, right, key))
    factor = stability(blocks, loads=[point_load("key", (0, 0, -1))]).factors[0]
    spread = 1 / math.tan(lean + math.atan(mu))
    pier, weight = (9.81 * block.mass.mass for block in (right, key))
    half_load = mu * pier / (spread - mu)
    assert factor.upper == pytest.approx(2 * half_load - weight, rel=2e-3)
