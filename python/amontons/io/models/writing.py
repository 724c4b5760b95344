"""Models out: the one function that writes them, by the suffix of the file."""

from __future__ import annotations

from os import PathLike

from ...errors import FileError
from ...model.model import Model, no_model
from ..files import writable, write_whole
from ..recordings.model_json import model_to_json
from .losses import Lost, laws_lost, told
from .mjcf_out import mjcf_text
from .urdf_out import urdf_text
from .usd.writer import write_usd

USD = (".usd", ".usda", ".usdc")


def write_model(model: Model, path: str | PathLike[str]) -> tuple[Lost, ...]:
    """Write a model as JSON (.json), USD (.usda, .usdc, .usd), MJCF (.xml) or URDF; returns what is lost.

    .json: for `load_model` and C++ (`Model::from_json`). Nothing is lost. C++ passes over keyframes, sites,
    sensors and looks. Infinity is written as "Infinity", as JSON has no such number.
    USD: other programs read UsdPhysics; the list says what that does not hold. `load_model` reads all of it
    back, with every digit, from attributes that begin with "amontons:". Where somebody has edited a prim, the
    attributes of UsdPhysics count. USD needs usd-core (pip install amontons[usd]).

    MJCF and URDF: the list says what they have no element for. A joint with several degrees of freedom is a
    row of joints with massless links in URDF, whose meshes are .obj files beside it.

    One warning (UnsupportedWarning) lists losses that change the motion.
    Raises InputError or FileError.

    >>> write_model(scenes.make("pendulum"), "pendulum.json")
    ()
    """
    if not isinstance(model, Model):
        raise no_model("write_model: model", model)
    path = writable(path)
    suffix = path.suffix.lower()
    if suffix == ".json":
        write_whole({path: model_to_json(model).encode()})
        return ()
    if suffix in (".xml", ".mjcf"):
        text, lost = mjcf_text(model)
        write_whole({path: text.encode()})
        return told(path, [*lost, *laws_lost(model, static=False)], "MuJoCo")
    if suffix == ".urdf":
        text, meshes, lost = urdf_text(model, path)
        write_whole({**meshes, path: text.encode()})
        return told(path, [*lost, *laws_lost(model, static=False)], "readers of URDF")
    if suffix in USD:
        lost = [*write_usd(model, path), *laws_lost(model, static=True)]
        return told(path, lost, "other programs than amontons")
    raise FileError(
        f"{path}: unknown kind of file; models are written to .json, .xml, .urdf, {', '.join(USD)}"
    )
