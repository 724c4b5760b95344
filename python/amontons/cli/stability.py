"""amontons stability: does an assembly of blocks stand, and by which margin?"""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ..errors import InputError
from . import completion
from .common import NOT_CONVERGED, AsJson, facts_table, note, notes, one_line_errors, print_json, working
from .options import Options, grouped
from .subject import Choices, open_subject

if TYPE_CHECKING:
    from ..model.assembly import Assembly
    from ..model.model import Model
    from ..studies.masonry.loads import Load
    from ..studies.masonry.settling import Settlement
    from ..studies.masonry.stability import Stability

DIRECTIONS = {"x": (1.0, 0.0), "-x": (-1.0, 0.0), "y": (0.0, 1.0), "-y": (0.0, -1.0)}


def _option(kind: Any, panel: str, help: str, metavar: str | None = None) -> Any:
    return Annotated[kind, typer.Option(metavar=metavar, help=help, rich_help_panel=panel)]


def _of_drawing(kind: Any, help: str) -> Any:
    return _option(kind, "Drawing", help)


def _of_load(metavar: str, help: str) -> Any:
    return _option(list[str] | None, "Loads that grow until collapse", help + " Repeatable.", metavar)


DRAWING: Options = {
    "unit": (_of_drawing(str | None, "Unit of the file: m, dm, cm, mm, in, ft."), None),
    "up": (_of_drawing(str | None, "Axis of the file that points up: x, y, z."), None),
    "supports": (_of_drawing(str | None, "Blocks that are supports, as A,B; or lowest, or ground."), None),
    "density": (_of_drawing(float | None, "Density of all blocks (kg/m^3)."), None),
    "friction": (_of_drawing(float | None, "Coefficient of friction of all faces."), None),
}
LOADS: Options = {
    "horizontal": (
        _of_load("X,Y", "Horizontal push along X,Y or x, -x, y, -y, as a share of the weight."),
        None,
    ),
    "tilt": (_of_load("X,Y", "Tilt of the ground, the side X,Y down."), None),
    "point": (_of_load("BLOCK,FX,FY,FZ", "Force (N) on the centre of a block."), None),
    "settle": (_of_load("BLOCK,X,Y,Z", "Movement of a support along X,Y,Z until blocks fall (m)."), None),
}
JOINTS: Options = {
    "gap": (_option(float | None, "Joints", "Largest distance of faces that touch (m)."), None),
    "tension": (
        _option(float, "Joints", "Tensile strength of mortar (Pa); the cohesion is friction times it."),
        0.0,
    ),
    "strength": (_option(float, "Joints", "Compressive strength (Pa)."), math.inf),
}
FILES: Options = {
    "picture": (_option(Path | None, "Files", "Picture of blocks, joints and forces (.png)."), None),
    "film": (
        _option(
            Path | None, "Files", "Film of the mechanism, of the first load if blocks stand (.gif, .webp)."
        ),
        None,
    ),
    "report": (_option(Path | None, "Files", "Report of one page (.html)."), None),
}


@grouped("drawing", DRAWING, dict)
@grouped("loads", LOADS, lambda **given: _loads(**given))
@grouped("joints", JOINTS, dict)
@grouped("files", FILES, dict)
def stability(
    subject: Annotated[
        str,
        typer.Argument(
            metavar="FILE",
            help="Blocks (.obj, .stl, .gltf, .glb, COMPAS .json, .ifc), a model or a scene.",
            show_default=False,
            autocompletion=completion.subjects,
        ),
    ],
    *,
    drawing: Any,
    joints: Any,
    loads: Any,
    margin: Annotated[
        bool, typer.Option("--margin", help="Also find the share of the friction that still suffices.")
    ] = False,
    files: Any,
    as_json: AsJson = False,
) -> None:
    """Say whether blocks stand under their weight, with a proof, and which loads make them fall.

    The exit code is 0 if they stand, 1 if they do not, 2 for input that could not be used.
    """
    from ..studies.masonry.stability import stability as judge

    with one_line_errors():
        with notes():
            blocks = _blocks(subject, drawing)
        with working("solving"):
            verdict = judge(blocks, loads=loads, friction_margin=margin, **joints)
        written = _write(verdict, Path(subject).stem, **files)
    _tell(verdict, written, as_json)
    if not verdict.stands:
        raise typer.Exit(NOT_CONVERGED)


def _write(
    verdict: Stability, title: str, picture: Path | None, film: Path | None, report: Path | None
) -> list[Path]:
    from ..studies.masonry.page import write_report
    from ..studies.masonry.picture import mechanism_of, write_film, write_picture

    files = []
    if picture is not None:
        files.append(write_picture(verdict, picture))
    if film is not None and mechanism_of(verdict) is None:
        note("the blocks stand: there is no mechanism to film; give a load, as --horizontal x")
    elif film is not None:
        files.append(write_film(verdict, film))
    if report is not None:
        files.append(write_report(verdict, report, title=title))
    return files


def _blocks(subject: str, drawing: dict[str, Any]) -> Model | Assembly:
    """The assembly of a drawing, or the model of anything else."""
    from ..io.assemblies import READERS, read_assembly

    path = Path(subject)
    suffix = path.suffix.lower()
    if suffix in READERS and not (suffix == ".json" and path.is_file() and _is_model(path)):
        given = drawing["supports"]
        if given is not None and given not in ("lowest", "ground"):
            drawing = drawing | {"supports": [name.strip() for name in given.split(",")]}
        return read_assembly(path, **drawing)
    if wrong := [key for key, value in drawing.items() if value is not None]:
        raise InputError(
            f"{subject}: --{wrong[0]} is for drawings ({', '.join(READERS)}); a model has its own"
        )
    return open_subject(subject, Choices()).simulation.model


def _is_model(path: Path) -> bool:
    with path.open(encoding="utf-8", errors="replace") as file:
        return '"bodies"' in file.read(100_000)


def _loads(horizontal: Any, tilt: Any, point: Any, settle: Any) -> list[Load | Settlement]:
    from ..studies.masonry import loads, settling

    made: list[Load | Settlement] = [
        loads.horizontal(*_direction("--horizontal", text)) for text in horizontal or ()
    ]
    made += [loads.tilt(*_direction("--tilt", text)) for text in tilt or ()]
    for text in point or ():
        made.append(
            loads.point_load(*_block_and_vector("--point", text, "BLOCK,FX,FY,FZ with the force in N"))
        )
    for text in settle or ():
        made.append(settling.settlement(*_block_and_vector("--settle", text, "BLOCK,X,Y,Z")))
    return made


def _block_and_vector(option: str, text: str, form: str) -> tuple[str, tuple[float, float, float]]:
    block, *values = text.rsplit(",", 3)
    try:
        x, y, z = map(float, values)
    except ValueError:
        raise InputError(f"{option} {text}: write {form}") from None
    return block, (x, y, z)


def _direction(option: str, text: str) -> tuple[float, float]:
    if text in DIRECTIONS:
        return DIRECTIONS[text]
    try:
        x, y = (float(part) for part in text.split(","))
    except ValueError:
        raise InputError(f"{option} {text}: write X,Y, or one of {', '.join(DIRECTIONS)}") from None
    return x, y


def _tell(verdict: Stability, files: list[Path], as_json: bool) -> None:
    facts = verdict.as_dict()
    if as_json:
        print_json(facts | {"files": [str(file) for file in files]})
        return
    for text in verdict.notes:
        note(text)
    shown: dict[str, object] = {
        "verdict": f"{verdict.verdict}: {verdict.meaning}",
        "blocks": f"{facts['blocks']}, supports {', '.join(facts['supports'][:5]) or 'none'}",
        "joints": facts["joints"],
        "weight": f"{facts['weight']:.4g} N",
    }
    for factor in verdict.factors:
        shown[factor.load] = str(factor).removeprefix(f"{factor.load}: ")
    for key in ("friction_used", "eccentricity"):
        if (worst := facts.get(f"largest_{key}")) is not None:
            shown[key.replace("_", " ")] = (
                f"{worst['value']:.2f} at most, joint {' on '.join(worst['joint'])}"
            )
    if "falling" in facts:
        shown["falling"] = ", ".join(facts["falling"])
    facts_table(shown.items())
    for file in files:
        facts_table([("file", file)])
