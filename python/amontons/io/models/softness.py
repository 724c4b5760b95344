"""solref and solimp of contacts as compliance, relaxation time and restitution.

MuJoCo's contacts are soft (its documentation, Modeling and Computation, Solver parameters).
With r < 0 the depth, v the normal velocity and A the inverse mass that the contact feels, its normal force f
fulfils

    a + R f = -b v - d k r,   R = (1 - d) / d A,   k = 1 / (dmax tc dr)^2,   b = 2 / (dmax tc),

or k = -solref[0] / dmax^2, b = -solref[1] / dmax, where d(r), the impedance, grows with the depth from d0 to
dmax. At rest f = d k |r| / R: a spring of the stiffness K = d k / R. The free motion of the inverse mass A is
a + d b v + d^2 k r = 0, with the damping ratio z = b / (2 sqrt(k)). A spring K with a damper of that ratio,
C = 2 z sqrt(K / A), has the relaxation time C / K = sqrt(1 - d) / d b / k.

d makes the spring stiffer under more load; here it is the one that carries the load at rest.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ...checks import Array
from .compiled import Compiled

DEFAULT_REFERENCE = np.array([0.02, 1.0])
DEFAULT_IMPEDANCE = np.array([0.9, 0.95, 0.001, 0.5, 2.0])
LEAST, MOST = 1e-4, 1 - 1e-4
"""MuJoCo's limits of the impedance"""
VISIBLE = 2.0
"""A contact that sinks in less than so many times as deep as one with MuJoCo's defaults is rigid."""
YIELDING = 10.0
BOUNCES = 0.05
"""Restitution below this is none."""
GRAVITY = 9.81
"""m/s^2, of files without any: contacts are as soft as they would be on earth"""
POINTS = {"mjGEOM_SPHERE": 1, "mjGEOM_ELLIPSOID": 1, "mjGEOM_CAPSULE": 2}
"""Contact points of a geom that stands; four of the others"""
SUPPORTS, PLANAR_SUPPORTS = 4, 2
"""Contact points that share the weight of a robot, at most, in space and in a plane"""


@dataclass(frozen=True)
class Softness:
    """Parameters of n contacts, arrays (n,)."""

    compliance: Array
    """m/N, 0 is rigid"""
    relaxation_time: Array
    """s"""
    restitution: Array


def impedance(solimp: Array) -> Callable[[Array], Array]:
    """A function of depths (...) that returns d for the parameters (..., 5): a sigmoid of the depth over the
    width."""
    start, end, width, middle, power = np.moveaxis(solimp, -1, 0)
    width, power = np.maximum(width, 1e-15), np.maximum(power, 1)
    start, end, middle = (_within(values) for values in (start, end, middle))
    rising, falling = middle ** (power - 1), (1 - middle) ** (power - 1)

    def d(depth: Array) -> Array:
        x = np.minimum(depth / width, 1)
        share = np.where(x <= middle, x**power / rising, 1 - (1 - x) ** power / falling)
        return _within(start + share * (end - start))

    return d


def _within(values: Array) -> Array:
    """As np.clip, which takes ten times as long for a few numbers."""
    return np.minimum(np.maximum(values, LEAST), MOST)


def _spring_and_damper(solref: Array, solimp: Array, shortest: float) -> tuple[Array, Array]:
    """k and b; MuJoCo takes no time constant below `shortest`, two of its steps."""
    end = _within(solimp[..., 1])
    first, second = solref[..., 0], solref[..., 1]
    with np.errstate(divide="ignore", invalid="ignore"):
        time = np.maximum(first, shortest)
        k = np.where(first > 0, 1 / (end * time * second) ** 2, -first / end**2)
        b = np.where(first > 0, 2 / (end * time), -second / end)
    return np.nan_to_num(k, posinf=0.0), np.nan_to_num(b, posinf=0.0)


def rest_depth(load: Array, weight: Array, k: Array, solimp: Array) -> Array:
    """Where k r d^2 / ((1 - d) weight) = load: the left grows with r. 60 bisections of the largest depth."""
    low = np.zeros(np.broadcast_shapes(load.shape, weight.shape, k.shape))
    start = _within(np.minimum(solimp[..., 0], solimp[..., 1]))
    with np.errstate(divide="ignore", invalid="ignore"):
        high = np.where(k > 0, load * weight * (1 - start) / (start**2 * k), 0.0)
    at = impedance(solimp)
    for _ in range(60):
        middle = 0.5 * (low + high)
        d = at(middle)
        deep = k * middle * d**2 >= load * weight * (1 - d)
        low, high = np.where(deep, low, middle), np.where(deep, middle, high)
    return high


def softness(compiled: Compiled, solref: Array, solimp: Array, weight: Array, load: Array) -> Softness:
    """Converts the parameters (n, 2) and (n, 5) for inverse masses (n,) under loads (n,)."""
    # Many contacts share few kinds of parameters.
    every = np.concatenate([solref, solimp, weight[:, None], load[:, None]], axis=1)
    kinds, kind = np.unique(every, axis=0, return_inverse=True)
    found = _softness(compiled, kinds[:, :2], kinds[:, 2:7], kinds[:, 7], kinds[:, 8])
    kind = kind.reshape(-1)
    return Softness(found.compliance[kind], found.relaxation_time[kind], found.restitution[kind])


def _softness(compiled: Compiled, solref: Array, solimp: Array, weight: Array, load: Array) -> Softness:
    m = compiled.model
    safe = not int(m.opt.disableflags) & compiled.mujoco.mjtDisableBit.mjDSBL_REFSAFE
    shortest = 2 * float(m.opt.timestep) if safe else 0.0
    k, b = _spring_and_damper(solref, solimp, shortest)
    plain = np.broadcast_to(DEFAULT_IMPEDANCE, solimp.shape)
    usual_k, _ = _spring_and_damper(np.broadcast_to(DEFAULT_REFERENCE, solref.shape), plain, shortest)
    depth = rest_depth(load, weight, k, solimp)
    soft = (k > 0) & (depth > VISIBLE * rest_depth(load, weight, usual_k, plain))
    d = impedance(solimp)(depth)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.nan_to_num(b / (2 * np.sqrt(k)), nan=np.inf)
        inside = np.minimum(ratio, 1 - 1e-9)
        bounce = np.where(k > 0, np.exp(-np.pi * inside / np.sqrt(1 - inside**2)), 0.0)
        # A contact with restitution bounces by it; its spring then only carries load.
        damping = np.where(bounce > BOUNCES, 2 * np.sqrt((1 - d) / k) / d, np.sqrt(1 - d) / d * b / k)
        compliance = np.where(soft, (1 - d) * weight / (k * d**2), 0.0)
    return Softness(
        compliance, np.where(soft, damping, 0.0), np.where(bounce > BOUNCES, np.minimum(bounce, 1.0), 0.0)
    )


def is_soft(solref: Array, solimp: Array) -> bool:
    """Whether a limit or equality with these parameters gives way YIELDING times as much as with MuJoCo's
    defaults: the stiffness at the largest impedance counts."""

    def stiffness(reference: Array, impedances: Array) -> float:
        k, _ = _spring_and_damper(reference, impedances, 0.0)
        d = min(max(float(impedances[1]), LEAST), MOST)
        return float(k) * d**2 / (1 - d)

    return YIELDING * stiffness(solref, solimp) < stiffness(DEFAULT_REFERENCE, DEFAULT_IMPEDANCE)


def inverse_weights(compiled: Compiled, bodies: Array, dim: Array, friction: Array) -> Array:
    """The inverse mass (1/kg) that MuJoCo gives the normal force of contacts of bodies (..., 2).

    In the pyramidal cone the force is that of 2 (condim - 1) edges n + mu t, each of which has
    R_edge = 2 mu^2 R (1 + mu^2) / impratio; the elliptic cone has a normal force of its own.
    """
    m = compiled.model
    weight = m.body_invweight0[bodies, 0].sum(axis=-1)
    if int(m.opt.cone) == compiled.mujoco.mjtCone.mjCONE_ELLIPTIC:
        return weight
    edges = np.maximum(2 * (dim - 1), 1)
    mu = friction
    return np.where(dim > 1, weight * 2 * mu**2 * (1 + mu**2) / (edges * float(m.opt.impratio)), weight)


def mixed(compiled: Compiled, geoms_a: Array, geoms_b: Array) -> tuple[Array, Array]:
    """solref (..., 2) and solimp (..., 5) of pairs: those of the higher priority, else the mean by solmix;
    of two references in the direct format the smaller numbers (MuJoCo, Modeling, Contact parameters)."""
    m = compiled.model
    mix_a, mix_b = m.geom_solmix[geoms_a], m.geom_solmix[geoms_b]
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.nan_to_num(mix_a / (mix_a + mix_b), nan=0.5)
    higher = m.geom_priority[geoms_a] - m.geom_priority[geoms_b]
    share = np.where(higher > 0, 1.0, np.where(higher < 0, 0.0, share))[..., None]
    ref_a, ref_b = m.geom_solref[geoms_a], m.geom_solref[geoms_b]
    mean = share * ref_a + (1 - share) * ref_b
    both = ((ref_a[..., 0] > 0) & (ref_b[..., 0] > 0))[..., None] | (share == 0) | (share == 1)
    solref = np.where(both, mean, np.minimum(ref_a, ref_b))
    return solref, share * m.geom_solimp[geoms_a] + (1 - share) * m.geom_solimp[geoms_b]


def loads(compiled: Compiled, touching: Array) -> Array:
    """The normal force (N) of one contact point at rest by geom: of what falls its share of the weight on
    at most SUPPORTS points, of a link of an arm the weight of the mass that the contact feels.

    touching: which geoms (ngeom,) collide at all.
    """
    m, kinds = compiled.model, compiled.mujoco.mjtGeom
    gravity = float(np.linalg.norm(m.opt.gravity)) or GRAVITY
    few = {int(getattr(kinds, name)): count for name, count in POINTS.items()}
    points = np.array([few.get(int(kind), SUPPORTS) for kind in m.geom_type]) * touching
    top = np.zeros(m.nbody, dtype=int)  # by body: the one below the world that carries it
    for body in range(1, m.nbody):
        parent = int(m.body_parentid[body])
        top[body] = body if parent == 0 else top[parent]
    of_tree = np.bincount(top[m.geom_bodyid], weights=points, minlength=m.nbody)
    joints = compiled.mujoco.mjtJoint
    supports = np.zeros(m.nbody)  # of what falls, by the body below the world
    supports[m.jnt_bodyid[m.jnt_type == int(joints.mjJNT_SLIDE)]] = PLANAR_SUPPORTS
    supports[m.jnt_bodyid[m.jnt_type == int(joints.mjJNT_FREE)]] = SUPPORTS
    tree = top[m.geom_bodyid]
    share = m.body_subtreemass[tree] / np.clip(of_tree[tree], 1, np.maximum(supports[tree], 1))
    weight = m.body_invweight0[m.geom_bodyid, 0]
    felt = np.divide(1.0, weight, out=np.zeros_like(weight), where=weight > 0)
    return gravity * np.where(supports[tree] > 0, share, felt)
