"""Runs one engine in the environment of its own: reads a JSON object per line, answers with one.

    python -m beside.worker in_mujoco

start (scene, dt, options), advance (steps), motion, contacts, save, restore, close; `where` tells which of
several scenes. Times are processor time of this process (s).
"""

from __future__ import annotations

import importlib
import re
import sys
from importlib import metadata
from time import process_time
from typing import Any

from .plain import Scene, serve


def version(adapter: Any) -> str:
    """Of the first package, or else what the module tells: MuJoCo comes in packages of two names."""
    name = re.split("[>=]", (*adapter.PACKAGES, adapter.IMPORT)[0])[0]
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return str(importlib.import_module(adapter.IMPORT).__version__)


def answer(adapter: Any, running: dict[int, Any], order: dict[str, Any]) -> dict[str, Any]:
    where, what = order["where"], order["do"]
    if what == "start":
        scene = Scene.from_dict(order["scene"])
        running[where] = adapter.start(scene, order["dt"], order["options"])
        return {"version": version(adapter)}
    scene = running[where]
    if what == "advance":
        begin = process_time()
        scene.advance(order["steps"])
        return {"time": process_time() - begin}
    found = getattr(scene, what)()  # motion, contacts, save, restore, close
    if what == "close":
        del running[where]
    return {key: v.tolist() for key, v in vars(found).items()} if what == "motion" else {what: found}


def main() -> None:
    adapter, running = importlib.import_module(f"beside.{sys.argv[1]}"), {}
    serve(lambda order: answer(adapter, running, order))


if __name__ == "__main__":
    main()
