"""A model of a few lines in MJCF, read by amontons and by MuJoCo."""

import pytest
from amontons.io.models import load_model

mujoco = pytest.importorskip("mujoco")


def load(tmp_path, body, *, head="", tail="", **options):
    path = tmp_path / "model.xml"
    path.write_text(f"<mujoco>\n{head}\n<worldbody>\n{body}\n</worldbody>\n{tail}\n</mujoco>\n")
    return load_model(path, **options), mujoco.MjModel.from_xml_path(str(path))


def index(model, name, kind="body"):
    return mujoco.mj_name2id(model, getattr(mujoco.mjtObj, f"mjOBJ_{kind.upper()}"), name)
