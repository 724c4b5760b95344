"""Verdicts on blocks against closed forms, conic programmes and the simulation."""

import math

import amontons
import clarabel
import numpy as np
import pytest
import scipy.sparse as sp
from amontons import InputError, scenes
from amontons.studies import Assembly, Block, horizontal, point_load, stability, tilt
from blocks import box, column, ground, wall
from scipy.optimize import linprog


def conic_factor(statics, load):
    """The largest factor with forces in the cones, by Clarabel on the same corners: an independent solver."""
    dead, live = load.parts(statics)
    D = statics.jacobian
    m = D.shape[0]
    balance = sp.hstack([D.T, sp.csc_matrix(live.reshape(-1, 1))])
    scale = np.tile([1.0, 0.0, 0.0], m // 3)
    scale[0::3] = statics.mu
    scale[1::3] = scale[2::3] = 1.0
    cones = sp.hstack([-sp.diags(scale), sp.csc_matrix((m, 1))])
    A = sp.vstack([balance, cones]).tocsc()
    b = np.concatenate([-dead.ravel(), np.zeros(m)])
    q = np.zeros(m + 1)
    q[-1] = -1.0
    kinds = [clarabel.ZeroConeT(dead.size)] + [clarabel.SecondOrderConeT(3)] * (m // 3)
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    return clarabel.DefaultSolver(sp.csc_matrix((m + 1, m + 1)), q, A, b, kinds, settings).solve().x[-1]


def pyramid_factor(statics, load, widen):
    """The same with pyramids of eight sides, by HiGHS: inside the cones, or around them with `widen`."""
    dead, live = load.parts(statics)
    c = len(statics.mu)
    limit = statics.mu * (1.0 if widen else math.cos(math.pi / 8))
    rows = []
    for k in range(8):
        angle = 2 * math.pi * k / 8
        side = sp.lil_matrix((c, 3 * c + 1))
        for i in range(c):
            side[i, 3 * i : 3 * i + 3] = (-limit[i], math.cos(angle), math.sin(angle))
        rows.append(side)
    A_eq = sp.hstack([statics.jacobian.T, sp.csc_matrix(live.reshape(-1, 1))])
    bounds = [(0, None), (None, None), (None, None)] * c + [(0, None)]
    cost = np.zeros(3 * c + 1)
    cost[-1] = -1.0
    found = linprog(
        cost, A_ub=sp.vstack(rows), b_ub=np.zeros(8 * c), A_eq=A_eq, b_eq=-dead.ravel(), bounds=bounds
    )
    return found.x[-1]


# A block tips at tan t = width / height, slides at tan t = mu. Breaks with a wrong cone or a wrong lever.
@pytest.mark.parametrize(("width", "height", "mu"), [(0.4, 1.0, 0.7), (1.0, 0.5, 0.3)])
def test_a_block_tips_or_slides_on_tilted_ground(width, height, mu):
    found = stability(column(width, height, mu), loads=[tilt(1), horizontal(1)])
    exact = min(width / height, mu)
    by_angle, by_push = found.factors
    assert found.stands
    assert by_push.lower <= exact * (1 + 1e-6)
    assert exact * (1 - 2e-3) <= by_push.lower <= by_push.upper <= exact * (1 + 2e-3)
    assert math.tan(math.radians(by_angle.upper)) == pytest.approx(exact, rel=2e-3)
    assert by_angle.placed == pytest.approx(by_angle.upper, rel=0.03)


# On a slope of angle t a block needs the share tan t / mu of its friction.
# Breaks if friction is scaled twice.
def test_the_friction_that_suffices_on_a_slope():
    angle, mu = math.radians(20), 0.8
    turn = np.array(
        [(math.cos(angle), 0, math.sin(angle)), (0, 1, 0), (-math.sin(angle), 0, math.cos(angle))]
    )
    blocks = [
        Block(b.name, b.vertices @ turn, b.triangles, friction=mu, fixed=b.fixed)
        for b in column(1.0, 0.5, mu).blocks
    ]
    factor = stability(Assembly(tuple(blocks)), friction_margin=True).factors[0]
    assert factor.lower <= math.tan(angle) / mu <= factor.upper * (1 + 1e-5)
    assert factor.upper == pytest.approx(math.tan(angle) / mu, rel=2e-3)


# A push P at half height tips a block of weight W and breadth b at P h / 2 = W b / 2.
# Breaks if the moment of the load about the centre of mass is lost.
def test_a_push_on_a_block_tips_it():
    blocks = column(0.4, 1.0)
    weight = 9.81 * blocks.blocks[1].mass.mass
    high = stability(blocks, loads=[point_load("block", (1.0, 0, 0), at=(0, 0.3, 1.0))]).factors[0]
    middle = stability(blocks, loads=[point_load("block", (1.0, 0, 0))]).factors[0]
    assert high.upper == pytest.approx(weight * 0.2, rel=2e-3)
    assert middle.upper == pytest.approx(weight * 0.4, rel=2e-3)


# Milankovitch (1907): the thinnest semicircular arch has 0.1075 of its mean radius. With 61 joints the limit
# is lower by at most the sagitta of half a stone. Breaks if faces, hinges or weights are wrong.
def test_the_thinnest_arch():
    def verdict(thickness):
        return stability(scenes.arch(stones=61, radius=1.0, thickness=thickness, mu=1.0)).verdict

    assert verdict(0.1068) == "falls"
    assert verdict(0.1078) == "stands"


# Coulomb (1773), as in examples/arch_friction.py: 15 stones need 0.309 to stand without sliding.
# Breaks if sliding is not part of the verdict.
def test_the_friction_of_an_arch():
    t = np.pi / 15 * np.arange(7.5, 0, -1)

    def surplus(mu):
        phi = np.arctan(mu)
        out = np.where(t > phi, t / np.tan(np.maximum(t - phi, 1e-9)), np.inf)
        return out.min() - (t / np.tan(t + phi)).max()

    low, high = 0.01, 1.0
    while high - low > 1e-6:
        low, high = (low, (low + high) / 2) if surplus((low + high) / 2) > 0 else ((low + high) / 2, high)
    factor = stability(scenes.arch(mu=0.6), friction_margin=True).factors[0]
    assert factor.upper * 0.6 == pytest.approx(high, rel=5e-3)


# Two solvers that know nothing of this package agree on the factor: Clarabel on the cones, HiGHS on pyramids
# inside and around them. Breaks with a wrong search, operator or cone.
@pytest.mark.parametrize("build", [lambda: wall(3, 4), lambda: wall(2, 3, mu=0.3)])
@pytest.mark.parametrize("load", [horizontal(1), horizontal(0, 1), horizontal(1, 1)])
def test_factors_agree_with_conic_and_linear_programmes(build, load):
    found = stability(build(), loads=[load])
    factor, statics = found.factors[0], found.statics
    exact = conic_factor(statics, load)
    assert factor.lower * (1 - 1e-5) <= exact <= factor.upper * (1 + 1e-5)
    assert factor.upper - factor.lower <= 1e-3 * factor.upper * (1 + 1e-9)
    assert pyramid_factor(statics, load, False) <= factor.upper * (1 + 1e-6)
    assert pyramid_factor(statics, load, True) >= factor.lower * (1 - 1e-6)


# The certificates are checked by plain loops, without the operator. Breaks if a verdict is not proved.
def test_both_ends_of_a_factor_are_proved():
    load = horizontal(1)
    found = stability(wall(2, 3), loads=[load])
    factor, statics = found.factors[0], found.statics
    blocks = found.assembly.blocks
    for forces, level in ((factor.forces.forces, factor.lower),):
        for k, i in enumerate(statics.free):
            force, moment = load.at(statics, level)[k, :3].copy(), np.zeros(3)
            for f, point, owner in zip(forces, *statics.corners, strict=True):
                joint = statics.joints[owner]
                sign = (joint.a == i) - (joint.b == i)
                push = sign * (f[0] * joint.normal + f[1] * joint.axes[0] + f[2] * joint.axes[1])
                force += push
                moment += np.cross(point - blocks[i].mass.centre_of_mass, push)
            weight = 9.81 * blocks[i].mass.mass
            assert np.linalg.norm(force) < 1e-4 * weight
            assert np.linalg.norm(moment) < 1e-4 * weight
    v = factor.mechanism.acceleration
    power, fastest, worst = 0.0, 0.0, 0.0
    for k in range(len(statics.free)):
        power += load.at(statics, factor.upper * (1 + 1e-6))[k] @ v[k]
    for point, owner in zip(*statics.corners, strict=True):
        joint = statics.joints[owner]
        apart = np.zeros(3)
        for block, sign in ((joint.a, 1), (joint.b, -1)):
            if block in statics.free:
                k = statics.free.index(block)
                apart += sign * (v[k, :3] + np.cross(v[k, 3:], point - blocks[block].mass.centre_of_mass))
        along = apart @ joint.normal
        worst = max(worst, joint.friction * np.linalg.norm(apart - along * joint.normal) - along)
        fastest = max(fastest, np.linalg.norm(apart))
    assert power > 0
    assert worst < 1e-4 * fastest


# A block between two walls has forces of equilibrium, but nothing squeezes it.
# Breaks if "stands" is said of it.
def test_a_block_that_only_squeezing_would_hold():
    walls = [
        box(f"wall {k}", (x, 0, 0), (1, 1, 1), fixed=True, friction=0.8) for k, x in enumerate((-1, 0.5))
    ]
    found = stability(Assembly((*walls, box("key", (0, 0.2, 0.2), (0.5, 0.5, 0.5), friction=0.8))))
    assert found.verdict == "needs prestress"
    assert found.mechanism[2, 2] == pytest.approx(-1)
    assert found.range_of(0).largest == math.inf


# A beam on three small pads: equilibrium leaves the middle one between nothing and all of the weight.
# Breaks if the two ends of a range are mixed up, or stop short.
def test_the_range_of_a_force_that_is_not_unique():
    pads = [
        box(f"pad {k}", (x, 0, -0.1), (0.02, 0.2, 0.1), fixed=True) for k, x in enumerate((0, 0.99, 1.98))
    ]
    beam = box("beam", (0, 0, 0), (2, 0.2, 0.2))
    found = stability(Assembly((*pads, beam)))
    middle = found.range_of(1)
    weight = 9.81 * beam.mass.mass
    assert middle.least == pytest.approx(0, abs=2e-3 * weight)
    assert middle.largest == pytest.approx(weight, rel=2e-3)
    assert not middle.unique
    assert found.joint_forces["compression"].sum() == pytest.approx(weight, rel=1e-4)
    two = stability(Assembly((pads[0], pads[2], beam)))
    least, largest = two.range_of(0)
    assert largest - least < 0.011 * weight  # where on its pad of 0.02 m the force acts
    assert stability(column(1.0, 0.5)).range_of(0).unique


# Mortar: a stone hangs by tension up to its strength times the area; a shear joint bears mu W + mu f A.
# Breaks if the strength is shared out over the corners wrongly.
def test_mortar_bears_tension_and_cohesion():
    hung = Assembly((box("slab", (0, 0, 1), (1, 1, 0.2), fixed=True), box("stone", (0, 0, 0.5), (1, 1, 0.5))))
    pull = 9.81 * hung.blocks[1].mass.mass
    assert stability(hung).verdict == "falls"
    assert stability(hung, tension=0.99 * pull).verdict == "falls"
    assert stability(hung, tension=1.01 * pull).stands
    flat, strength = column(2.0, 0.2, mu=0.5), 5e3
    weight, area = 9.81 * flat.blocks[1].mass.mass, 2.0 * 0.6
    factor = stability(flat, loads=[horizontal(1)], tension=strength).factors[0]
    assert factor.upper == pytest.approx(0.5 * (weight + strength * area) / weight, rel=2e-3)


# A column crushes where its stress exceeds the strength; eccentric load leaves 2 (b/2 - e) of its breadth b.
# Breaks if the face is reduced by the full depth of the stress block.
def test_the_strength_of_a_joint():
    blocks = column(0.4, 1.0)
    stress = 9.81 * blocks.blocks[1].mass.mass / (0.4 * 0.6)
    assert stability(blocks, strength=1.05 * stress).stands
    assert stability(blocks, strength=0.95 * stress).verdict == "crushes"
    # The upper block stands with its centre 0.1 m from the edge of the lower one: it bears on 0.2 m.
    step = box("upper", (0.3, 0, 1.0), (0.4 - 1e-9, 0.6, 0.5))
    shifted = Assembly((ground(), box("block", (0, 0, 0), (0.6, 0.6, 1.0), fixed=True), step))
    load = 9.81 * step.mass.mass / (0.2 * 0.6)
    assert stability(shifted, strength=1.05 * load).stands
    assert stability(shifted, strength=0.95 * load).verdict == "crushes"


# The simulation gives the same answer in time, on both sides of the limit. Breaks if one of them is wrong.
@pytest.mark.parametrize(("thickness", "stands"), [(0.35, True), (0.19, False)])
def test_the_simulation_agrees(thickness, stands):
    model = scenes.arch(stones=15, thickness=thickness, mu=0.8)
    assert stability(model).stands is stands
    simulation = amontons.Simulation(model, dt=5e-3)
    start = simulation.state.positions.copy()
    simulation.run(0.5)
    moved = np.linalg.norm(simulation.state.positions - start, axis=1).max()
    assert bool(moved < 0.01 * thickness) is stands


# Round bodies touch at points, which the engine finds. Breaks if such a pair is lost.
def test_models_with_round_bodies():
    builder = amontons.ModelBuilder()
    builder.add_floor()
    builder.add_body("ball", shape=amontons.shapes.Sphere(0.1), density=1000, position=(0, 0, 0.1))
    found = stability(builder.build(), loads=[horizontal(1)])
    assert found.stands
    assert found.factors[0].upper < 1e-3  # it rolls


# A verdict is not given for what it does not know. Each message names the thing.
def test_what_no_verdict_is_given_for():
    with pytest.raises(InputError, match="no block is a support.*'block'"):
        stability(Assembly((box("block", (0, 0, 0), (1, 1, 1)),)))
    with pytest.raises(InputError, match="'kite': no chain of joints"):
        stability(Assembly((ground(), box("kite", (0, 0, 5), (1, 1, 1)))))
    with pytest.raises(InputError, match="overlap: 'left' and 'right' by 0.1 m"):
        stability(
            Assembly((ground(), box("left", (0, 0, 0), (1, 1, 1)), box("right", (0.9, 0, 0), (1, 1, 1))))
        )
    with pytest.raises(InputError, match="'block': its surface is not closed: 3 edges"):
        Block("block", box("b", (0, 0, 0), (1, 1, 1)).vertices, box("b", (0, 0, 0), (1, 1, 1)).triangles[1:])
    with pytest.raises(InputError, match="2 blocks are named 'a'"):
        Assembly((box("a", (0, 0, 0), (1, 1, 1)), box("a", (2, 0, 0), (1, 1, 1))))
    with pytest.raises(InputError, match="all 1 blocks are supports"):
        stability(Assembly((ground(),)))
    with pytest.raises(InputError, match="no load"):
        stability(column(1, 1), loads=[1.0])
    with pytest.raises(InputError, match="is a support"):
        stability(column(1, 1), loads=[point_load("ground", (1, 0, 0))])


# A block whose triangles disagree about inside and outside is turned, not refused.
def test_triangles_that_disagree_are_turned():
    good = box("block", (0, 0, 0), (1, 1, 1))
    mixed = good.triangles.copy()
    mixed[::3] = mixed[::3, ::-1]
    assert Block("block", good.vertices, mixed).mass.mass == pytest.approx(good.mass.mass)
    assert Block("block", good.vertices, good.triangles[:, ::-1]).mass.mass == pytest.approx(good.mass.mass)


def finer(block, times):
    """The same block, with each triangle cut into four, so many times."""
    points, faces = block.vertices, block.triangles
    for _ in range(times):
        middles = [(points[faces[:, k]] + points[faces[:, (k + 1) % 3]]) / 2 for k in range(3)]
        first = len(points) + np.arange(len(faces))
        a, b, c = (first + k * len(faces) for k in range(3))
        points = np.concatenate([points, *middles])
        corners = [(faces[:, 0], a, c), (faces[:, 1], b, a), (faces[:, 2], c, b), (a, b, c)]
        faces = np.concatenate([np.stack(part, axis=1) for part in corners])
    return Block(block.name, points, faces, friction=block.friction, fixed=block.fixed)


# Faces of a thousand triangles are the faces that they make: same joints, no search over their pairs.
# Breaks if each pair of triangles is cut, which takes minutes.
def test_faces_of_many_triangles():
    plain = [box("base", (0, 0, 0), (1, 1, 0.5), fixed=True), box("top", (0.1, 0.2, 0.5), (1, 1, 0.5))]
    coarse = stability(Assembly(tuple(plain)), loads=[horizontal(1)])
    fine = stability(Assembly(tuple(finer(block, 4) for block in plain)), loads=[horizontal(1)])
    assert len(fine.statics.joints) == len(coarse.statics.joints) == 1
    assert fine.statics.joints[0].area == pytest.approx(0.9 * 0.8, rel=1e-6)
    assert len(fine.statics.joints[0].polygon) == 4
    assert fine.factors[0].upper == pytest.approx(coarse.factors[0].upper, rel=1e-6)


# A sheet is no solid, whichever way it lies: the message says so, and not that it is open.
def test_a_sheet_has_no_volume():
    flat = box("sheet", (0, 0, 0), (1, 1, 1)).vertices * (1, 1, 0)
    turn = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    for points in (flat, flat @ turn.T):
        with pytest.raises(InputError, match="'sheet': it has no volume"):
            Block("sheet", points, box("sheet", (0, 0, 0), (1, 1, 1)).triangles)
