"""Links of one tree that overlap from the start do not touch; scenery does."""

import warnings

import amontons
import pytest
from amontons import load_model

pytest.importorskip("mujoco")

# A chain of three links; the third lies in the first one and in the fixed base.
CHAIN = """<mujoco><worldbody>
<geom name="floor" type="plane" size="5 5 .1"/>
<body name="base"><geom name="base0" size=".1"/>
  <body name="a" pos=".05 0 0"><joint axis="0 1 0"/><geom name="a0" size=".1"/>
    <body name="b" pos=".3 0 0"><joint axis="0 1 0"/><geom name="b0" size=".05"/>
      <body name="c" pos="-.2 0 0"><joint axis="0 1 0"/><geom name="c0" size=".1"/></body>
    </body>
  </body>
</body>
<body name="sunk" pos="2 0 .05"><freejoint/><geom name="sunk0" size=".1"/></body>
</worldbody></mujoco>"""


def pairs(model):
    names = model.geom_names
    return {tuple(sorted((names[a], names[b]))) for a, b in model.excluded_geoms}


def loaded(tmp_path, **options):
    path = tmp_path / "chain.xml"
    path.write_text(CHAIN)
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        return load_model(path, **options), "".join(str(w.message) for w in said)


# Breaks when links that overlap push against each other for ever, when a body that starts in the floor falls
# through it, or when nobody is told.
def test_links_of_one_tree_that_overlap_do_not_touch(tmp_path):
    model, said = loaded(tmp_path)
    found = pairs(model)
    assert ("a0", "c0") in found  # one tree, no joint between them
    assert ("a0", "base0") in found  # the base is fixed
    assert ("base0", "c0") in found
    assert ("floor", "sunk0") not in found
    assert '"a" and "c"' in said
    assert "self_overlaps=True" in said


# Breaks when the exclusion cannot be turned off; a joint still keeps its two links apart.
def test_self_overlaps_lets_them_touch(tmp_path):
    model, said = loaded(tmp_path, self_overlaps=True)
    assert pairs(model) == {("a0", "base0")}
    assert "overlap" not in said
    sim = amontons.Simulation(model, on_failure="ignore")
    sim.step()
    names = model.geom_names
    touching = {tuple(sorted((names[c["geom_a"]], names[c["geom_b"]]))) for c in sim.contacts}
    assert ("a0", "c0") in touching


# Breaks when a model that was put into another one, or saved, forgets which of its geoms do not touch.
def test_exclusions_come_along(tmp_path):
    model, _ = loaded(tmp_path)
    builder = amontons.ModelBuilder()
    builder.add_model(model, prefix="m_")
    assert len(builder.build().excluded_geoms) == len(model.excluded_geoms)
    amontons.Simulation(model).save(tmp_path / "saved.h5")
    assert amontons.Simulation.load(tmp_path / "saved.h5").model.excluded_geoms == model.excluded_geoms


# Breaks when a pair that does not exist is taken.
def test_a_pair_that_does_not_exist(tmp_path):
    model, _ = loaded(tmp_path)
    with pytest.raises(amontons.InputError, match="geom"):
        amontons.Model(bodies=model.bodies, excluded_geoms=((0, 99),))
