"""Models as JSON files: for programs in C++ (Model::from_json), and to read a large model fast."""

from __future__ import annotations

from pathlib import Path

from ... import _core
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
        _core.Model.from_json(str(path))  # whose messages name line or field
        return model_from_json(path.read_text(encoding="utf-8"))
    except InputError as error:
        text = str(error)
        raise FileError(text if text.startswith(str(path)) else f"{path}: {text}") from None
    except (ValueError, TypeError, LookupError, AttributeError, ArithmeticError, RecursionError) as error:
        reason = " ".join(str(error).split())[:300]
        if isinstance(error, KeyError):
            reason = f"a part has no {reason}"
        raise FileError(
            f"{path}: is no model that write_model wrote ({reason}); write it again by amontons.write_model"
        ) from None
