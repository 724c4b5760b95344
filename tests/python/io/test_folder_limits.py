"""Models that name files elsewhere: confined to a folder where `Limits` says so; pipes and devices never."""

import os
import subprocess
import sys

import amontons
import pytest
from amontons import Limits
from waiting import LONGEST

pytest.importorskip("mujoco")

MESH = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
BODY = "<body><freejoint/><geom type='mesh' mesh='m'/></body>"
LINK = (
    "<robot name='r'><link name='base'><inertial><mass value='1'/>"
    "<inertia ixx='1' iyy='1' izz='1' ixy='0' ixz='0' iyz='0'/></inertial>"
    "<{kind}><geometry><mesh filename='{name}'/></geometry></{kind}></link></robot>"
)


@pytest.fixture
def place(tmp_path):
    """A folder for a model, with a mesh within and one outside."""
    folder = tmp_path / "upload"
    (folder / "meshes").mkdir(parents=True)
    (folder / "meshes" / "m.obj").write_text(MESH)
    (tmp_path / "secret").mkdir()
    (tmp_path / "secret" / "m.obj").write_text(MESH)
    (tmp_path / "secret" / "part.xml").write_text("<mujoco><worldbody><geom size='1'/></worldbody></mujoco>")
    (tmp_path / "secret" / "m.png").write_bytes(b"")
    return folder


def mjcf(folder, head, body="", name="model.xml"):
    path = folder / name
    path.write_text(f"<mujoco>{head}<worldbody>{body}</worldbody></mujoco>")
    return path


def refused(path, folder, message="lies outside of"):
    with pytest.raises(amontons.FileError, match=message) as caught:
        amontons.load_model(path, limits=Limits(folder=folder), floating_base=None)
    assert str(caught.value).startswith(str(path.parent))


# Breaks when a model that is confined to a folder reads, or says whether there is, what lies outside: by
# "..", an absolute path, a folder of the compiler, a link, for every kind of file that MJCF names.
@pytest.mark.parametrize(
    "head",
    [
        "<asset><mesh name='m' file='../secret/m.obj'/></asset>",
        "<asset><mesh name='m' file='meshes/../../secret/m.obj'/></asset>",
        "<asset><mesh name='m' file='..\\secret\\m.obj'/></asset>",
        "<asset><mesh name='m' file='{outside}/m.obj'/></asset>",
        "<asset><mesh name='m' file='{outside}/none.obj'/></asset>",
        "<asset><mesh name='m' file='linked.obj'/></asset>",
        "<asset><mesh name='m' file='linked/m.obj'/></asset>",
        "<compiler meshdir='../secret'/><asset><mesh name='m' file='m.obj'/></asset>",
        "<compiler assetdir='{outside}'/><asset><mesh name='m' file='m.obj'/></asset>",
        "<compiler meshdir='linked'/><asset><mesh name='m' file='m.obj'/></asset>",
        "<compiler meshdir='..'/><asset><mesh name='m' file='secret/m.obj'/></asset>",
        "<asset><hfield name='h' file='../secret/m.png' size='1 1 1 1'/></asset>",
        "<asset><texture name='t' type='2d' file='../secret/m.png'/></asset>",
        "<asset><texture name='t' type='cube' fileup='../secret/m.png'/></asset>",
        "<asset><skin name='s' file='../secret/m.skn'/></asset>",
        "<asset><model name='p' file='../secret/part.xml'/></asset>",
        "<asset><model name='p' file='linked/part.xml'/></asset>",
        "<include file='../secret/part.xml'/>",
        "<include file='linked/part.xml'/>",
        "<include file='{outside}/none.xml'/>",
    ],
)
def test_mjcf_stays_in_its_folder(place, head):
    outside = place.parent / "secret"
    (place / "linked").symlink_to(outside)
    (place / "linked.obj").symlink_to(outside / "m.obj")
    refused(mjcf(place, head.format(outside=outside)), place)


# Breaks when what an attached or included file names is not held to the folder.
def test_files_of_files_stay_in_the_folder(place):
    mjcf(place, "<asset><mesh name='m' file='../secret/m.obj'/></asset>", BODY, name="inner.xml")
    refused(mjcf(place, "<include file='inner.xml'/>", name="a.xml"), place)
    attach = "<attach model='p' body='b' prefix='x'/>"
    refused(mjcf(place, "<asset><model name='p' file='inner.xml'/></asset>", attach, name="b.xml"), place)


# Breaks when a confined model may not read what lies in its folder, or a model that is not confined may not
# go elsewhere, which is usual on a desktop; when the folder is taken as it is written and not where it is.
def test_what_is_allowed(place, tmp_path):
    path = mjcf(place, "<compiler meshdir='meshes'/><asset><mesh name='m' file='m.obj'/></asset>", BODY)
    (tmp_path / "way").symlink_to(place)
    for folder in (place, tmp_path, str(tmp_path / "way")):
        assert len(amontons.load_model(path, limits=Limits(folder=folder)).geoms) == 1
    outside = mjcf(place, "<asset><mesh name='m' file='../secret/m.obj'/></asset>", BODY, name="o.xml")
    assert len(amontons.load_model(outside).geoms) == 1
    assert len(amontons.load_model(outside, limits=Limits(folder=tmp_path)).geoms) == 1


# Breaks when a URDF that is confined finds meshes elsewhere, by any of its ways to name them.
@pytest.mark.parametrize(
    "name",
    [
        "../secret/m.obj",
        "{outside}/m.obj",
        "file://{outside}/m.obj",
        "package://secret/m.obj",
        "package://upload/../secret/m.obj",
        "model://secret/m.obj",
        "linked/m.obj",
    ],
)
def test_urdf_stays_in_its_folder(place, monkeypatch, name):
    outside = place.parent / "secret"
    (place / "linked").symlink_to(outside)
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(place.parent))
    path = place / "r.urdf"
    path.write_text(LINK.format(kind="collision", name=name.format(outside=outside)))
    assert len(amontons.load_model(path, floating_base=True).geoms) == 1  # on a desktop
    refused(path, place, "does not exist within")
    path.write_text(LINK.format(kind="visual", name=name.format(outside=outside)))
    assert len(amontons.load_model(path, floating_base=True).visuals) == 1
    limits = Limits(folder=place)
    assert len(amontons.load_model(path, floating_base=True, limits=limits).visuals) == 0
    path.write_text(LINK.format(kind="visual", name="package://upload/meshes/m.obj"))
    assert len(amontons.load_model(path, floating_base=True, limits=limits).visuals) == 1


LOADS = """
import sys, amontons
try:
    amontons.load_model(sys.argv[1])
except amontons.FileError as error:
    print(error)
"""


# Breaks when a pipe or a device is opened as a mesh, a texture, a height field or an included file: the pipe
# would wait for its writer, /dev/zero has no end. The process is killed after a minute.
@pytest.mark.parametrize(
    "head",
    [
        "<asset><mesh name='m' file='pipe.obj'/></asset>",
        "<compiler meshdir='x'/><asset><mesh name='m' file='../pipe.obj'/></asset>",
        "<asset><mesh name='m' file='/dev/zero' content_type='model/obj'/></asset>",
        "<asset><texture name='t' type='2d' file='pipe.png'/></asset>",
        "<asset><hfield name='h' file='pipe.png' size='1 1 1 1'/></asset>",
        "<include file='pipe.xml'/>",
        "<asset><model name='p' file='pipe.xml'/></asset>",
    ],
)
def test_pipes_and_devices(place, head):
    (place / "x").mkdir()
    for suffix in ("obj", "png", "xml"):
        os.mkfifo(place / f"pipe.{suffix}")
    path = mjcf(place, head, BODY if "mesh" in head else "<geom size='1'/>")
    told = subprocess.run(
        [sys.executable, "-c", LOADS, path], capture_output=True, text=True, timeout=LONGEST
    )
    assert told.returncode == 0, told.stderr
    assert "is no regular file" in told.stdout


# Breaks when an element of so many attributes that MuJoCo's parser takes minutes is given to it, or the limit
# cannot be raised.
def test_attributes_are_counted(place):
    many = " ".join(f"a{k}='1'" for k in range(100_000))
    path = mjcf(place, f"<option {many}/>", "<geom size='1'/>")
    with pytest.raises(amontons.FileError, match="100000 attributes, more than 1000; .*Limits.attributes="):
        amontons.load_model(path)
    few = " ".join(f"a{k}='1'" for k in range(1100))
    path = mjcf(place, f"<option {few}/>", "<geom size='1'/>")
    with pytest.raises(amontons.FileError, match="unrecognized attribute|not known|Schema"):
        amontons.load_model(path, limits=Limits(attributes=2000), strict=True)


# Breaks when a folder that is none is taken, and everything in it refused later.
@pytest.mark.parametrize("folder", ["/no/such/folder", 3, "a\0b", __file__])
def test_folder_is_checked(folder):
    with pytest.raises(amontons.InputError, match="limits: folder = "):
        Limits(folder=folder)
