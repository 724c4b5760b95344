"""Projections on the cones against Clarabel, which knows nothing of closed forms."""

import amontons
import numpy as np
import scipy.sparse as sp
from amontons.problem.cones import to_core
from hypothesis import given, reject, settings
from hypothesis import strategies as st
from reference import minimise

# Sizes at which an interior point has all its digits; the extremes are proved by Moreau's conditions in C++.
components = st.one_of(st.floats(-10, 10), st.sampled_from([0.0, -0.0, 1.0, -1.0, 1e-3, -1e-3]))
coefficients = st.one_of(st.just(0.0), st.floats(1e-3, 10), st.sampled_from([0.3, 1.0]))


def project(cones, x):
    return to_core(cones).project(np.ascontiguousarray(x, dtype=float))


def check(cones, x):
    p = project(cones, x)
    q, value = minimise(sp.eye_array(len(x)), -x, cones)
    size = 1 + x @ x
    assert abs(0.5 * p @ p - x @ p - value) <= 1e-7 * size
    # |p - q|^2 is at most twice what q loses in the objective: the points agree to half the digits only.
    assert np.sum((p - q) ** 2) <= 1e-6 * size
    assert np.isclose(to_core(cones).distance(x), np.linalg.norm(p - x), rtol=1e-12)


def frictional(kind, values, form):
    """Elliptic or rolling cones with coefficients (n, 5); form: 0 for three rows, 1 for four, 2 for six."""
    if kind == "rolling":
        return amontons.vi.RollingFriction(values[:, 0], values[:, 1])
    return amontons.vi.EllipticFriction(
        values[:, :2], values[:, 2] if form else None, values[:, 3:] if form == 2 else None
    )


@st.composite
def products(draw):
    """A product of sets of every kind, in any order, and a point."""
    cones = []
    for _ in range(draw(st.integers(1, 6))):
        kind = draw(
            st.sampled_from(
                ["friction", "elliptic", "elliptic", "rolling", "nonnegative", "bilateral", "interval"]
            )
        )
        if kind == "friction":
            cones.append(amontons.vi.Friction(draw(st.lists(coefficients, min_size=1, max_size=12))))
        elif kind in ("elliptic", "rolling"):
            values = np.array(draw(st.lists(st.tuples(*[coefficients] * 5), min_size=1, max_size=6)))
            cones.append(frictional(kind, values, draw(st.integers(0, 2))))
        elif kind == "interval":
            bounds = np.array(draw(st.lists(st.tuples(components, components), min_size=1, max_size=4)))
            bounds.sort(axis=1)
            bounds[draw(st.integers(0, len(bounds) - 1)), 1] = np.inf
            cones.append(amontons.vi.Interval(bounds[:, 0], bounds[:, 1]))
        else:
            cones.append(
                {"bilateral": amontons.vi.Bilateral, "nonnegative": amontons.vi.NonNegative}[kind](
                    draw(st.integers(1, 3))
                )
            )
    rows = sum(cone.rows for cone in cones)
    return cones, np.array(draw(st.lists(components, min_size=rows, max_size=rows)))


# min |p - x|^2 over K. Some 20 sets per example, so 400 examples are some 8000 projections.
@settings(max_examples=400)
@given(products())
def test_projection_is_the_nearest_point(case):
    try:
        check(*case)
    except ArithmeticError:
        reject()


# Points on the borders between the regions, where a wrong comparison shows: the boundary ray, its normal,
# the axis.
@settings(max_examples=300)
@given(
    mu=st.one_of(st.floats(0, 10), st.sampled_from([0.0, 1e-12, 1e8])),
    ray=st.floats(-5, 5),
    normal=st.floats(-5, 5),
    angle=st.floats(0, 6.2),
)
def test_friction_in_the_frame_of_its_boundary(mu, ray, normal, angle):
    c, s = 1 / np.hypot(1, mu), mu / np.hypot(1, mu)
    direction = np.array([np.cos(angle), np.sin(angle)])
    # x = ray * (c, s e) + normal * (-s, c e): for normal >= 0 and c, s >= 0 the foot is max(ray, 0) (c, s e).
    t = ray * s + abs(normal) * c
    if t < 0:
        return
    x = np.array([ray * c - abs(normal) * s, *(t * direction)])
    p = project([amontons.vi.Friction([mu])], x)
    assert np.allclose(
        p, max(ray, 0) * np.array([c, *(s * direction)]), rtol=0, atol=1e-14 * (1 + np.abs(x).sum())
    )


def test_thousands_of_random_projections_at_once():
    """A product of 3000 cones: breaks when a run or its parameters are indexed wrongly far from the start."""
    rng = np.random.default_rng(3)
    cones = [
        amontons.vi.Friction(rng.uniform(0.01, 3, 1500)),
        amontons.vi.NonNegative(700),
        amontons.vi.Friction(np.where(rng.random(500) < 0.2, 0, rng.uniform(0.01, 1, 500))),
        amontons.vi.Interval(-rng.random(300), rng.random(300)),
    ]
    x = rng.normal(size=sum(cone.rows for cone in cones))
    check(cones, x)


# The same for the sets with moments, 6000 at once. Breaks for a foot that is not the nearest point in any
# region: the multiplier of an ellipse, the four pieces of two discs, coefficients of zero.
def test_thousands_of_random_elliptic_and_rolling_projections():
    rng = np.random.default_rng(4)
    cones = []
    for kind, form in [("elliptic", 0), ("elliptic", 1), ("elliptic", 2), ("rolling", 0)]:
        values = 10 ** rng.uniform(-2, 1, (1500, 5))
        values[rng.random((1500, 5)) < 0.1] = 0
        cones.append(frictional(kind, values, form))
    for _ in range(2):
        x = rng.normal(size=sum(cone.rows for cone in cones))
        check(cones, x)


# The polar cone by its support function, the De Saxce term. Breaks when that is not the term of the set: with
# it missing or wrong the dual cone that a residual under coulomb assumes is not that of the projection.
def test_what_a_projection_leaves_is_in_the_polar_cone():
    rng = np.random.default_rng(5)
    for kind, form in [("elliptic", 0), ("elliptic", 1), ("elliptic", 2), ("rolling", 0)]:
        values = rng.uniform(0, 2, (2000, 5))
        cone = frictional(kind, values, form)
        x = rng.normal(size=cone.rows)
        rest = (x - project([cone], x)).reshape(cone.n, -1)
        if kind == "rolling":
            parts = np.hypot(rest[:, 1], rest[:, 2]), np.hypot(rest[:, 3], rest[:, 4])
            support = values[:, 0] * parts[0] + values[:, 1] * parts[1]
        else:
            support = np.linalg.norm(np.stack(cone.parameters, axis=1) * rest[:, 1:], axis=1)
        assert np.all(rest[:, 0] + support <= 1e-13)
