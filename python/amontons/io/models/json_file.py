"""Models as JSON files: for programs in C++ (Model::from_json), and to read a large model fast."""

from __future__ import annotations

from pathlib import Path

from ...errors import FileError, InputError
from ...limits import Limits, readable
from ...model.model import Model
from ..recordings.model_json import model_from_json


def read_model_json(path: Path, limits: Limits) -> Model:
    """The model of a file that `write_model` wrote; FileError that names the field where it is broken."""
    if (size := path.stat().st_size) > limits.memory:
        raise FileError(
            f"{path}: has {readable(size)}, more than limits.memory = {readable(limits.memory)}; "
            "give limits=amontons.Limits(memory=...) to read it"
        )
    try:
        return model_from_json(path.read_text(encoding="utf-8"), str(path))
    except InputError as error:
        text = str(error)
        raise FileError(text if text.startswith(str(path)) else f"{path}: {text}") from None
    except ValueError as error:  # bytes that are no text, a mesh that is cut off
        reason = " ".join(str(error).split())[:300]
        raise FileError(
            f"{path}: is no model that write_model wrote ({reason}); write it again by amontons.write_model"
        ) from None
