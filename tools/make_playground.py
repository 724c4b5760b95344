"""Makes out/playground/index.html, a page with the engine in it: python tools/make_playground.py

emscripten compiles the core to WebAssembly in build/playground. The page is one file that loads nothing: the
engine, three.js, the scenes and the licences are in it, packed by gzip. `make docs` takes it into the site
where it is there. three.js comes from the npm registry once, and is compared with the hash below.
"""

from __future__ import annotations

import base64
import gzip
import hashlib
import json
import os
import shutil
import subprocess
import sys
import tarfile
import tempfile
from dataclasses import asdict, dataclass, field
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path
from typing import Any

import amontons

ROOT = Path(__file__).resolve().parent.parent
SOURCES = ROOT / "playground"
BUILD = ROOT / "build" / "playground"
PAGE = ROOT / "out" / "playground" / "index.html"
THREE = "three@0.187.0"
# SHA-512 in Base64, as the registry states it.
THREE_HASH = "Qiu7R+Cmh8CstZsY1uJOSWnVlfo7ZtNLV7mF8Jltk3LB3AtDu9cRZlcnRKkAk8Y4z6KKw35z7Y7Urd7jWY8etA=="
THREE_FILES = ("build/three.core.js", "build/three.module.js", "LICENSE")
SCRIPTS = ("world.js", "shapes.js", "stage.js", "curve.js", "page.js")
# Clang 14 joins scalars into wrong vectors of WebAssembly, where -fno-slp-vectorize does not forbid it: the
# interior point then ends nowhere. Without such vectors the bits are those of the native engine.
CODE = ("-msimd128", "-fexceptions", "-fno-slp-vectorize")
FLAGS = (*CODE, "-Wno-unused-command-line-argument", "-Wno-shadow")
NEEDS = ("emcmake", "cmake", "node", "npm")


@dataclass(frozen=True)
class Example:
    """A scene of the page: how it is made, and how the page begins with it."""

    scene: str
    title: str
    says: str
    parameters: dict[str, Any] = field(default_factory=dict)
    tolerance: float = 1e-6
    view: tuple[float, float] = (-60, 18)
    """of the eye, degrees about z from the x axis and above the horizon"""

    def model(self) -> amontons.Model:
        if self.scene.endswith(".xml"):
            return amontons.load_model(ROOT / "examples" / "models" / self.scene)
        return amontons.scenes.make(self.scene, **self.parameters)

    @property
    def dt(self) -> float:
        return 5e-3 if self.scene.endswith(".xml") else amontons.scenes.get(self.scene).dt


EXAMPLES = (
    Example(
        "wall",
        "Wall and wrecking ball",
        "Bricks laid dry, and a ball on a chain. Pull a brick out.",
        {"columns": 7, "rows": 6, "links": 5, "angle": 50.0},
        1e-3,
        (-55, 16),
    ),
    Example(
        "card_house",
        "House of cards",
        "It stands by friction alone. Lower the friction until it falls.",
        {"levels": 3},
        view=(-60, 14),
    ),
    Example(
        "stack",
        "Stack",
        "Boxes on a floor. Draw the lowest one out, or drop one with restitution.",
        {"boxes": 7},
    ),
    Example("arch", "Arch", "Wedges without mortar. Take a stone away.", view=(-75, 12)),
    Example(
        "domino_run", "Dominoes", "The first one falls against the others.", {"count": 20}, view=(-50, 22)
    ),
    Example(
        "newtons_cradle",
        "Newton's cradle",
        "Steel balls that touch. Raise two of them.",
        {"raised": 1},
        view=(-70, 10),
    ),
    Example(
        "hopper",
        "Hopper",
        "Grains through an outlet. More friction forms an arch over it.",
        {"count": 100},
        1e-4,
    ),
    Example(
        "chain",
        "Chain with a heavy end",
        "Links on joints, with an end of a thousand times their mass.",
        {"links": 20},
        view=(-80, 8),
    ),
    Example("slider_crank", "Slider crank", "A closed loop of joints, driven at the crank.", view=(-75, 14)),
    Example("quadruped.xml", "Quadruped", "A robot without control. Lift it by a leg."),
)


def scenes() -> list[dict[str, Any]]:
    """What the page knows of each example; `model` is the text that amontons.write_model writes."""
    made = []
    with tempfile.TemporaryDirectory() as folder:
        for example in EXAMPLES:
            file = Path(folder) / "model.json"
            amontons.write_model(example.model(), file)
            told = asdict(example)
            del told["parameters"]
            made.append({**told, "dt": example.dt, "model": file.read_text()})
    return made


def run(command: list[object], log: Path, **environment: str) -> None:
    """Runs a command with its words in a file; ends the program with the last of them where it fails."""
    with log.open("a") as out:
        words = [str(word) for word in command]
        done = subprocess.run(words, stdout=out, stderr=out, env={**os.environ, **environment})
    if done.returncode:
        tail = "\n".join(log.read_text(errors="replace").splitlines()[-20:])
        sys.exit(f"{tail}\namontons: {words[0]} failed; all of its output is in {log}")


def engine() -> tuple[Path, Path]:
    """engine.js and engine.wasm, compiled where a source has changed."""
    BUILD.mkdir(parents=True, exist_ok=True)
    log = BUILD / "build.log"
    log.write_text("")
    # Debian's emscripten looks for its packages of node where Debian puts them.
    debian = {"NODE_PATH": "/usr/share/nodejs"} if Path("/usr/share/nodejs/acorn").exists() else {}
    places = [f"-DAMONTONS_{name}_INCLUDE_DIR={path}" for name, path in headers().items()]
    flags = f"-DCMAKE_CXX_FLAGS={' '.join(FLAGS)}"
    configure = ["emcmake", "cmake", "-S", ROOT, "-B", BUILD, "-DCMAKE_BUILD_TYPE=Release", flags, *places]
    # ccache would take em++ for the compiler of the last call.
    run(configure, log, CMAKE_CXX_COMPILER_LAUNCHER="", **debian)
    run(["cmake", "--build", BUILD, "--target", "engine"], log, **debian)
    return BUILD / "engine.js", BUILD / "engine.wasm"


def headers() -> dict[str, Path]:
    """The folders of Eigen and nlohmann/json in the environment of this Python; else CMake looks for them."""
    found = {}
    for name, package, folder in (
        ("EIGEN", "cmeel-eigen", "cmeel.prefix/include/eigen3"),
        ("JSON", "nlohmann-json", "nlohmann_json/include"),
    ):
        try:
            found[name] = Path(str(distribution(package).locate_file(folder)))
        except PackageNotFoundError:
            continue
    return found


def three() -> tuple[str, str, str]:
    """The two modules and the licence of three.js."""
    archive = BUILD / f"{THREE.replace('@', '-')}.tgz"
    if not archive.exists():
        run(["npm", "pack", "--silent", "--pack-destination", BUILD, THREE], BUILD / "npm.log")
    if base64.b64encode(hashlib.sha512(archive.read_bytes()).digest()).decode() != THREE_HASH:
        archive.unlink()
        sys.exit(f"amontons: {THREE} has another hash than tools/make_playground.py states")
    with tarfile.open(archive) as files:
        core, module, licence = (files.extractfile(f"package/{name}") for name in THREE_FILES)
        assert core
        assert module
        assert licence
        return core.read().decode(), module.read().decode(), licence.read().decode()


def licences(of_three: str) -> str:
    root = subprocess.run(["em-config", "EMSCRIPTEN_ROOT"], capture_output=True, text=True, check=True)
    musl = Path(root.stdout.strip()) / "system" / "lib" / "libc" / "musl" / "COPYRIGHT"
    texts = {
        "amontons": (ROOT / "LICENSE").read_text(),
        "three.js": of_three,
        "Eigen (https://gitlab.com/libeigen/eigen)": (ROOT / "licenses" / "eigen.txt").read_text(),
        "nlohmann/json": (ROOT / "licenses" / "nlohmann-json.txt").read_text(),
        "Emscripten": (SOURCES / "emscripten.txt").read_text(),
        "libc++ of LLVM": (ROOT / "licenses" / "llvm-runtime.txt").read_text(),
        "musl": musl.read_text() if musl.exists() else "MIT, Copyright 2005-2020 Rich Felker, et al.",
    }
    return "\n\n".join(f"{name}\n{'=' * len(name)}\n\n{text.strip()}" for name, text in texts.items())


def packed(name: str, data: bytes | str) -> str:
    """An element of the page with the data; the same data give the same bytes."""
    raw = data.encode() if isinstance(data, str) else data
    text = base64.b64encode(gzip.compress(raw, 9, mtime=0)).decode()
    return f'<script type="text/plain" id="{name}">{text}</script>'


def page(script: Path, wasm: Path) -> str:
    core, module, licence = three()
    data = {
        "three-core": core,
        "three": module,
        "engine": script.read_text(),
        "engine-wasm": wasm.read_bytes(),
        "scenes": json.dumps(scenes()),
        "licence-texts": licences(licence),
    }
    parts = {
        "/*page.css*/": (SOURCES / "page.css").read_text(),
        "<!--data-->": "\n".join(packed(name, text) for name, text in data.items()),
        "/*scripts*/": "\n".join((SOURCES / name).read_text() for name in SCRIPTS),
    }
    text = (SOURCES / "index.html").read_text()
    for mark, part in parts.items():
        text = text.replace(mark, part)
    return text


def main() -> None:
    missing = [name for name in NEEDS if not shutil.which(name)]
    if missing:
        sys.exit(
            f"amontons: make playground needs emscripten, cmake and npm; not found: {', '.join(missing)} "
            "(Debian: apt-get install emscripten npm, as root)"
        )
    text = page(*engine())
    PAGE.parent.mkdir(parents=True, exist_ok=True)
    PAGE.write_text(text)
    print(f"{PAGE.relative_to(ROOT)}: {len(text) / 1e6:.1f} MB")


if __name__ == "__main__":
    main()
