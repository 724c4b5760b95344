"""Contacts of MJCF files against MuJoCo: which geoms touch, and with what friction."""

from itertools import combinations, product

import amontons
import pytest
from amontons.io.models import load_model
from amontons.model.compiled import Parts
from mjcf import load, mujoco
from problems import silent

TOUCHING = """
<geom name="w0" size="1"/>
<body name="s"><geom name="s0" size="1"/><body name="t"><geom name="t0" size="1"/></body>
  <body name="arm"><joint/><geom name="arm0" size="1"/>
    <geom name="arm1" size="1" contype="2" conaffinity="4"/>
    <body name="tool"><geom name="tool0" size="1" contype="4" conaffinity="0"/>
      <body name="finger"><joint axis="1 0 0"/><geom name="finger0" size="1"/>
        <body name="nail"><joint axis="0 1 0"/>
          <geom name="nail0" size="1" contype="0" conaffinity="3"/></body>
      </body>
    </body>
  </body>
</body>
<body name="free"><freejoint/><geom name="free0" size="1" contype="5" conaffinity="2"/></body>
<body name="mocap" mocap="true"><geom name="mocap0" size="1"/>
  <body name="hung"><joint/><geom name="hung0" size="1"/></body></body>
<body name="hermit"><freejoint/><geom name="hermit0" size="1" contype="0" conaffinity="0"/></body>
"""
FILTERS = """<contact><exclude body1="free" body2="arm"/><exclude body1="world" body2="nail"/>
<pair geom1="hermit0" geom2="w0"/><pair geom1="hermit0" geom2="mocap0"/></contact>"""


def touching(model):
    """Names and materials of the pairs of geoms that may touch."""
    for a, b in combinations(range(len(model.geoms)), 2):
        if model.core.may_touch(a, b):
            yield (
                tuple(sorted((model.geom_names[a], model.geom_names[b]))),
                model.core.material(a, b, Parts().make),
            )


# Breaks when a filter lets other pairs touch than MuJoCo's: all geoms overlap, so every allowed pair has
# contacts there. The base, which is fixed, does not touch the link that a joint joins to
# it; there MuJoCo has contacts.
@pytest.mark.parametrize("flag", ["", '<option><flag filterparent="disable"/></option>'])
def test_contact_filters_are_those_of_mujoco(tmp_path, flag):
    model, m = load(tmp_path, TOUCHING, head=flag, tail=FILTERS, self_overlaps=True)
    d = mujoco.MjData(m)
    mujoco.mj_forward(m, d)
    expected = {tuple(sorted(m.geom(g).name for g in pair)) for pair in d.contact.geom}
    if not flag:
        expected -= set(product(("arm0", "arm1"), ("s0", "t0")))
    found = {names for names, _ in touching(model)}
    assert found == expected
    assert ("hermit0", "w0") in found


# Breaks when the friction of a pair is not the one MuJoCo combines from priority, condim and <pair>.
def test_friction_is_that_of_mujoco(tmp_path):
    kinds = [(0.3, 3, 0), (0.8, 3, 0), (0.5, 1, 0), (0.9, 1, 0), (0.2, 3, 1), (0.7, 1, 1), (0.6, 3, 2)]
    bodies = "".join(
        f'<body><freejoint/><geom name="g{i}" size="1" friction="{mu}" condim="{dim}" priority="{p}"/></body>'
        for i, (mu, dim, p) in enumerate(kinds)
    )
    tail = '<contact><pair geom1="g0" geom2="g1" friction="0.05"/>'
    tail += '<pair geom1="g1" geom2="g4" condim="1"/></contact>'
    model, m = load(tmp_path, bodies, tail=tail)
    d = mujoco.MjData(m)
    mujoco.mj_forward(m, d)
    expected = {}
    for contact in d.contact:
        key = tuple(sorted(m.geom(g).name for g in contact.geom))
        expected[key] = 0.0 if contact.dim == 1 else contact.friction[0]
    found = {names: material.friction for names, material in touching(model)}
    assert found == pytest.approx(expected)
    assert len(found) == 21


# Breaks when a crowd of frictionless geoms gets a material per pair, of which there are thousands, or another
# friction among each other or with the floor.
def test_a_crowd_without_friction_has_no_pairs(tmp_path):
    balls = "".join(
        f'<body pos="{i} 0 1"><freejoint/><geom size="0.1" condim="1"/></body>' for i in range(60)
    )
    model, _ = load(tmp_path, '<geom type="plane" size="1 1 1"/>' + balls)
    assert model.pair_materials == ()
    assert coefficients(model, 1, 2)[0] == 0.0
    assert coefficients(model, 0, 1)[0] == 1.0


def coefficients(model, a, b):
    """Sliding, torsional and rolling friction of two geoms: those of the pair, or the larger ones."""
    for pair in model.pair_materials:
        if {pair.geom_a, pair.geom_b} == {a, b}:
            m = pair.material
            return m.friction, m.torsional_friction, m.rolling_friction
    both = [model.geoms[g].material for g in (a, b)]
    return tuple(max(getattr(m, f"{name}friction") for m in both) for name in ("", "torsional_", "rolling_"))


# Breaks when torsional or rolling friction of a pair is not the one that MuJoCo combines. MuJoCo names the
# contact of each pair when the two are put over each other; condim says which of the numbers count.
def test_moments_are_those_of_mujoco(root):
    path = root / "tests" / "python" / "io" / "models" / "condim.xml"
    model = silent(load_model, path)  # condim 4 and 6 are supported
    m = mujoco.MjModel.from_xml_path(str(path))
    d = mujoco.MjData(m)
    d.qpos[1::7] = 0  # all balls at one place
    mujoco.mj_forward(m, d)
    seen = set()
    for contact in d.contact:
        a, b = sorted(model.geom_index(m.geom(g).name) for g in contact.geom)
        slide, _, torsion, roll, _ = contact.friction
        expected = [0.0 if contact.dim < needed else x for x, needed in ((slide, 3), (torsion, 4), (roll, 6))]
        assert coefficients(model, a, b) == pytest.approx(expected), (a, b)
        seen.add((a, b))
    assert len(seen) == 7 + 21
    assert [g.material.rolling_friction for g in model.geoms] == [0, 0, 0, 0, 0.002, 0, 0, 0.002]


# Breaks when a moment has another unit, arm or direction than in MuJoCo, whose contacts are soft and whose
# friction creeps by some per cent. A rolling ball loses 5/7 g mu_r / R (the floor's mu_r = 0.003 counts), in
# the elliptic cone less by the force that it takes beside the moment: relative changes of the order of
# (mu_r / mu R)^2 = 3e-3. One that spins loses mu_t m g / I.
def test_ball_rolls_to_rest_as_in_mujoco(root):
    path = root / "tests" / "python" / "io" / "models" / "condim.xml"
    m = mujoco.MjModel.from_xml_path(str(path))
    d = mujoco.MjData(m)
    first = m.jnt_dofadr[m.body("rolls").jntadr[0]]
    spinning = m.jnt_dofadr[m.body("spins").jntadr[0]]
    sim = amontons.Simulation(load_model(path), dt=5e-3)
    roll, spin = (sim.model.body_index(name) for name in ("rolls", "spins"))
    d.qvel[first], d.qvel[first + 4], d.qvel[spinning + 5] = 1.0, 10.0, 20.0
    sim.state.linear_velocities[roll] = (1, 0, 0)
    sim.state.angular_velocities[roll], sim.state.angular_velocities[spin] = (0, 10, 0), (0, 0, 20)
    while d.time < 1.0:
        mujoco.mj_step(m, d)
    sim.run(1.0)
    ours = 1.0 - sim.state.linear_velocities[roll, 0], 20.0 - sim.state.angular_velocities[spin, 2]
    assert ours == pytest.approx((5 / 7 * 9.81 * 0.003 / 0.1, 0.004 * 9.81 / (0.4 * 0.01)), rel=3e-3)
    assert ours == pytest.approx((1.0 - d.qvel[first], 20.0 - d.qvel[spinning + 5]), rel=0.05)


# Breaks when each pair of a crowd of unlike priorities or softness gets a material for itself, whose making
# takes the time, or two kinds of pairs get one.
@pytest.mark.parametrize("unlike", ['friction="0.{} 0 0"', 'solref="0.{}1 1"'])
def test_pairs_of_a_crowd_share_materials(tmp_path, unlike):
    geom = '<body pos="{} 0 1"><freejoint/><geom size="0.1" mass="1" {}/></body>'
    bodies = "".join(geom.format(i, f'priority="{i % 3}" ' + unlike.format(3 - i % 3)) for i in range(30))
    model, m = load(tmp_path, '<geom type="plane" size="0 0 1" priority="1"/>' + bodies)
    assert len(model.pair_materials) > 100
    assert len({id(pair.material) for pair in model.pair_materials}) < 12
    for pair in model.pair_materials:
        a, b = (model.geoms[g].material for g in (pair.geom_a, pair.geom_b))
        first, second = (int(m.geom_priority[g]) for g in (pair.geom_a, pair.geom_b))
        if first != second:
            decides = pair.geom_a if first > second else pair.geom_b
            assert pair.material.friction == m.geom_friction[decides, 0]
        assert model.core.material(pair.geom_a, pair.geom_b, Parts().make).friction == pair.material.friction
        assert pair.material.friction <= max(a.friction, b.friction)
