"""Model files that are too large, too deep or made to break MuJoCo's parser, and the limits that say so."""

import amontons
import pytest
from amontons import Limits

GEOM = "<geom size='.1'/>"


def model(tmp_path, body, before="", name="m.xml"):
    path = tmp_path / name
    path.write_text(f"<mujoco>{before}<worldbody>{body}</worldbody></mujoco>")
    return path


def refused(path, message, **options):
    with pytest.raises(amontons.FileError, match=message) as caught:
        amontons.load_model(path, **options)
    assert str(path.parent) in str(caught.value)


# Breaks when a large model is built before it is counted, or when its limit cannot be raised.
@pytest.mark.parametrize(
    ("body", "message", "raised"),
    [
        (GEOM * 30, "more than 20 elements", {"elements": 40}),
        (
            f'<replicate count="10" offset="1 0 0">{GEOM * 3}</replicate>',
            "makes 40 elements",
            {"elements": 50},
        ),
        (
            f'<replicate count="5" offset="1 0 0"><replicate count="5">{GEOM}</replicate></replicate>',
            "makes 55 elements",
            {"elements": 60},
        ),
    ],
)
def test_elements_are_counted(body, message, raised, tmp_path):
    path = model(tmp_path, body)
    refused(path, message, limits=Limits(elements=20))
    assert len(amontons.load_model(path, limits=Limits(**raised)).geoms) >= 25


# Breaks when what nobody waits for is begun: each of these ran for minutes or into the limit of recursion.
@pytest.mark.parametrize(
    ("body", "message"),
    [
        (f'<replicate count="100000">{GEOM}</replicate>', "<replicate> makes 2e.05 elements"),
        (f'<replicate count="1e300">{GEOM}</replicate>', "<replicate> makes 2e.300 elements"),
        ("<body>" * 5000 + "</body>" * 5000, "elements within elements, more than 400 of them"),
        ('<body><composite type="cable" count="1000000 1 1"/></body>', "<composite> makes 1e.06 elements"),
    ],
)
def test_default_limits_of_elements(body, message, tmp_path):
    refused(model(tmp_path, body), message)


# Breaks when a long chain is given to MuJoCo, whose time grows with its cube, or a loop of links has no end.
def test_chains(tmp_path):
    def robot(n, loop=False):
        ends = [(i, i + 1) for i in range(n - 1)] + ([(n - 1, 0)] if loop else [])
        links = "".join(f'<link name="l{i}"/>' for i in range(n))
        joints = "".join(
            f'<joint name="j{b}" type="fixed"><parent link="l{a}"/><child link="l{b}"/></joint>'
            for a, b in ends
        )
        path = tmp_path / "m.urdf"
        path.write_text(f'<robot name="r">{links}{joints}</robot>')
        return path

    refused(robot(1200), 'name="j1001">: links hang on each other, more than 1000 in a row')
    refused(robot(20), "more than 10 in a row", limits=Limits(chain=10), floating_base=False)
    amontons.load_model(robot(20), floating_base=False)
    refused(robot(5, loop=True), "m.urdf")
    refused(robot(20_000), "more than 20000 elements")


# Breaks when a file is read again and again: 2^30 times here.
def test_include_bomb(tmp_path):
    for k in range(30):
        (tmp_path / f"{k}.xml").write_text(
            f'<mujoco><include file="{k + 1}.xml"/><include file="{k + 1}.xml"/></mujoco>'
        )
    (tmp_path / "30.xml").write_text("<mujoco/>")
    refused(tmp_path / "0.xml", "more than 500 elements", limits=Limits(elements=500))


# Breaks when a height field or texture takes gigabytes, or when one that is allowed is refused.
def test_memory_of_a_model(tmp_path):
    field = '<geom type="hfield" hfield="h"/>'

    def asset(n):
        return f'<asset><hfield name="h" nrow="{n}" ncol="{n}" size="1 1 1 .1"/></asset>'

    refused(
        model(tmp_path, field, asset(10_000)),
        '<hfield name="h"> asks for 6.4 GB .nrow="10000", ncol="10000".',
    )
    refused(model(tmp_path, field, asset(100)), "more than 100 kB", limits=Limits(memory=10**5))
    texture = '<asset><texture name="t" type="2d" builtin="flat" width="100000" height="100000"/></asset>'
    refused(model(tmp_path, GEOM, texture), "asks for 80 GB")


# Breaks when what an entity stands for is dropped without a word (2 of 3 geoms), or entities multiply.
@pytest.mark.parametrize("rest", ["", '<geom size=".1" name="a & b"/>'])
def test_entities(rest, tmp_path):
    path = tmp_path / "m.xml"
    body = f"<worldbody>{rest}<geom size='.2'/>&g;</worldbody>"
    path.write_text(f'<!DOCTYPE mujoco [<!ENTITY g "{GEOM}">]><mujoco>{body}</mujoco>')
    refused(path, "the entity &g; is defined here, which MuJoCo does not read")


# Breaks when MuJoCo's parser, which takes the name of an unknown class for a format, ends the process.
def test_names_that_are_formats(tmp_path):
    refused(model(tmp_path, '<geom class="%s%n%x" size=".1"/>'), "which MuJoCo takes for a format; rename it")


# Breaks when a byte of zero hides the rest of a file from one of the two parsers.
def test_bytes_of_zero(tmp_path):
    path = model(tmp_path, GEOM)
    path.write_bytes(path.read_bytes() + b"\0<geom/>")
    refused(path, "is no text: it holds bytes of zero")
