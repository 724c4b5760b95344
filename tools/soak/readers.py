"""Files of every format, damaged: each is read or refused by a sentence that names it, and what is read makes
sense."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import amontons
import numpy as np

from . import samples
from .family import Case, Failure, Family, Measures
from .mutate import archives, hdf5, raw, trees
from .mutate.raw import Rng, pick

SAMPLES: dict[str, Callable[[], dict[str, samples.Files]]] = {}
"""The good files of each family."""
Damage = Callable[[Rng, Path], None]
PARTS = (1, 1, 1, 2, 3)
"""Damages of one file: one more often than several, which end at the first of them."""


def refused(path: Path, error: Exception) -> Measures:
    """A refusal is one sentence that begins with the file, or lists places in files line by line."""
    text = str(error)
    if not isinstance(error, FileNotFoundError | amontons.FileError):
        raise Failure("wrong error", f"{type(error).__name__} in place of FileError: {text[:300]}")
    if str(path.parent) not in text.split("\n")[0]:
        raise Failure("unnamed file", f"the message does not begin with the file: {text[:300]}")
    if len(text) > 20_000:
        raise Failure("endless message", f"{len(text)} characters: {text[:300]}")
    return {"outcome": "refused"}


def damaged(samples_: Callable[[], dict[str, dict[str, bytes]]], kinds: list[Damage], main: str) -> Callable:
    """A function that writes one of the samples (files by name) and damages the file `main` of it."""

    def make(case: Case) -> Path:
        files = samples_()
        for name, data in files[str(pick(case.rng(), list(files)))].items():
            (case.folder / name).parent.mkdir(exist_ok=True)
            (case.folder / name).write_bytes(data)
        path = case.folder / main
        for part in range(int(case.rng(100).choice(PARTS))):
            rng = case.rng(part)
            if case.kept(part):
                try:
                    pick(rng, kinds)(rng, path)
                except Exception:  # what was damaged before may no longer be read by the damaging library
                    data = raw.damage(rng, path.read_bytes(), raw.BINARY)
                    path.write_bytes(data)
        return path

    return make


def in_bytes(rng: Rng, path: Path) -> None:
    path.write_bytes(raw.damage(rng, path.read_bytes(), raw.BINARY))


def in_text(rng: Rng, path: Path) -> None:
    path.write_bytes(raw.damage(rng, path.read_bytes(), raw.TEXT))


def in_tree(rng: Rng, path: Path) -> None:
    path.write_text(trees.damage_xml(rng, path.read_text()))


def at_its_end(rng: Rng, path: Path) -> None:
    data = path.read_bytes()
    path.write_bytes(data[: int(rng.integers(12, len(data)))])


def in_columns(rng: Rng, path: Path) -> None:
    """A column is gone, another one's, of another type; or the metadata are other ones."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    table = pq.read_table(path)
    name = str(pick(rng, table.column_names))
    place, rows = table.column_names.index(name), table.num_rows
    meta = bytearray(table.schema.metadata[b"amontons"])
    raw.set_byte(rng, meta)
    ways: list[Callable[[], pa.Table]] = [
        lambda: table.drop_columns([name]),
        lambda: table.append_column(name, table[name]),
        lambda: table.set_column(place, name, table[str(pick(rng, table.column_names))]),
        lambda: table.set_column(place, name, pa.array([None] * rows, table[name].type)),
        lambda: table.set_column(place, name, pa.array([pick(rng, CELLS)] * rows)),
        lambda: table.replace_schema_metadata({b"amontons": bytes(meta)}),
        lambda: table.replace_schema_metadata({b"amontons": bytes(pick(rng, raw.WORDS))}),  # type: ignore[arg-type]
        lambda: table.take([0] * int(rng.integers(4))),
    ]
    pq.write_table(pick(rng, ways)(), path)  # type: ignore[operator]


CELLS = [
    "",
    "\x1b[2J",
    "x" * 100_000,
    -1,
    2**62,
    float("nan"),
    1e308,
    True,
    b"\xff",
    [1, "2"][:1],
    [[]],
    {"a": 1},
]


def in_json(rng: Rng, path: Path) -> None:
    """The text of the model or of the options in an HDF5 file."""
    import h5py

    with h5py.File(path, "a") as file:
        key = "model" if rng.random() < 0.85 else "options"
        text = trees.damage_json(rng, file[key][()].decode().rstrip("\0"))
        del file[key]
        file[key] = np.bytes_(text.encode() + b"\0")


def family(
    name: str, what: str, files: Callable, kinds: list[Damage], judge: Callable[[Path], None], main: str,
    **options: Any,
) -> Family:  # fmt: skip
    make = damaged(files, kinds, main)
    SAMPLES[name] = files

    def replay(path: Path) -> Measures:
        try:
            judge(path)
        except (amontons.InputError, FileNotFoundError) as error:
            return refused(path, error)
        return {"outcome": "accepted"}

    return Family(name, what, lambda case: replay(make(case)), replay, main, **options)


def require(holds: object, what: str) -> None:
    if not holds:
        raise Failure("accepted nonsense", what)


def judge_problem(path: Path) -> None:
    problem = amontons.vi.read_problem(path)
    m = problem.rows
    require(problem.b.shape == (m,) and np.isfinite(problem.b).all(), "b is not (m,) finite numbers")
    require(sum(cone.rows for cone in problem.cones) == m, "the cones do not have the rows of A")
    require(np.isfinite(problem.mu).all() and (problem.mu >= 0).all(), "mu is negative or not finite")
    for x in problem.guesses:
        require(x.shape == (m,) and np.isfinite(x).all(), "a guess is not (m,) finite numbers")
    if problem.f is not None:
        require(np.isfinite(problem.f).all(), "f is not finite")
    if path.suffix == ".npz":
        judge_archive(path)
    try:
        problem.solve(max_iterations=2, method="p-spg-fb")
    except amontons.InputError:  # indefinite, which only products show
        return


def judge_archive(path: Path) -> None:
    """What the arrays say by themselves, read by other code."""
    with np.load(path) as file:
        if "cone_kinds" in file:  # counts without kinds say nothing, and are not read
            kinds, counts = file["cone_kinds"].tolist(), file["cone_counts"].tolist()
            require(
                len(kinds) == len(counts) and min(counts, default=0) >= 0,
                "cone_kinds and cone_counts do not fit",
            )
            of = {k: sum(n for kind, n in zip(kinds, counts, strict=True) if kind == k) for k in set(kinds)}
            contacts = sum(
                n for kind, n in of.items() if kind not in ("bilateral", "nonnegative", "interval")
            )
            require(len(file["mu"]) == contacts, "mu has entries of no contact")
            for key in ("lo", "hi"):
                require(key not in file or len(file[key]) == of.get("interval", 0), f"{key} is too long")
        if "A_indptr" in file and "A_data" in file:
            p = file["A_indptr"]
            require(p[0] == 0 and (np.diff(p) >= 0).all() and p[-1] == len(file["A_data"]), "A_indptr")


def judge_state(path: Path) -> None:
    simulation = amontons.Simulation.load(path)
    state = simulation.state
    for name in ("positions", "orientations", "linear_velocities", "angular_velocities"):
        require(np.isfinite(getattr(state, name)).all(), f"{name} is not finite")
    q = np.linalg.norm(state.orientations, axis=1)
    require(np.all(abs(q - 1) < 1e-3), "an orientation is no rotation")
    try:
        simulation.step()
    except (amontons.InputError, amontons.SimulationError):
        return
    require(np.isfinite(state.positions).all(), "the step from it is not finite")


def judge_recording(path: Path) -> None:
    with amontons.read_recording(path) as recording:
        frames, bodies = len(recording), len(recording.model.bodies)
        recording.options  # noqa: B018
        for name in ("positions", "linear_velocities", "angular_velocities"):
            require(np.shape(getattr(recording, name)[...]) == (frames, bodies, 3), f"shape of {name}")
        require(recording.orientations[...].shape == (frames, bodies, 4), "shape of orientations")
        require(np.isfinite(recording.times).all(), "times are not finite")
        for k in range(frames):
            require(np.isfinite(recording.contacts(k)["gap"]).all(), "a gap is not finite")
        recording.reports["residual"].sum()
        if frames:
            recording.frame_at(0.1)
            repr(recording)


def judge_table(path: Path) -> None:
    from amontons.studies.rows import read_table
    from amontons.studies.task import STATUSES

    table, about = read_table(path)
    keys, statuses = table["key"].to_pylist(), table["status"].to_pylist()
    require(all(isinstance(key, str) for key in keys) and len(set(keys)) == len(keys), "keys")
    require(set(statuses) <= set(STATUSES), "a status is none")
    require(isinstance(about["run"], str) and set(about["parameters"]) <= set(table.column_names), "about")


def judge_model(path: Path) -> None:
    model = amontons.load_model(path)
    for body in model.bodies:
        require(
            np.isfinite([body.mass, *body.pose.position, *body.pose.rotation]).all(), f"{body} is not finite"
        )
    simulation = amontons.Simulation(model)
    require(np.isfinite(simulation.state.positions).all(), "a position is not finite")


HDF5 = [in_bytes, in_bytes, hdf5.damage, hdf5.damage, hdf5.damage]
NPZ = [in_bytes, archives.damage_arrays, archives.damage_arrays, archives.damage_header, archives.damage_zip]
XML = [in_text, in_tree, in_tree, in_tree]

FAMILIES = [
    family("fclib", "FCLIB", samples.fclib, HDF5, judge_problem, "problem.hdf5", share=2),
    family("archive", "NumPy archives", samples.archives, NPZ, judge_problem, "problem.npz", share=2),
    family("matrix-market", "Matrix Market", samples.matrices, [in_text], judge_problem, "problem.mtx"),
    family("model-json", "models as JSON", samples.states, [in_json], judge_state, "state.h5"),
    family("saved-state", "saved simulations", samples.states, HDF5, judge_state, "state.h5"),
    family("recording", "recordings", samples.recordings, HDF5, judge_recording, "run.h5"),
    family(
        "unfinished",
        "recordings of killed processes",
        samples.unfinished,
        [in_bytes, at_its_end],
        judge_recording,
        "run.h5",
    ),
    family(
        "table",
        "tables of studies",
        samples.tables,
        [in_bytes, in_columns],
        judge_table,
        "rows.parquet",
        memory=2 << 30,
    ),
    family("mjcf", "MJCF", samples.mjcf, XML, judge_model, "model.xml", share=2),
    family("urdf", "URDF", samples.urdf, XML, judge_model, "model.urdf"),
]


def of_asset(suffix: str) -> Family:
    """Of a mesh or height field that a small model names; the damage is to the asset."""
    text = suffix in ("obj", "dae", "txt.stl")
    main = f"asset.{suffix.removeprefix('txt.')}"
    model = "model.urdf" if suffix in ("dae", "txt.stl") else "model.xml"

    def judge(path: Path) -> None:
        judge_model(path.with_name(model))

    kinds = [in_text if text else in_bytes, *([in_tree] if suffix == "dae" else [])]
    name = f"asset-{suffix.replace('txt.', 'text-')}"
    return family(name, f".{suffix} in a model", lambda: samples.asset(suffix), kinds, judge, main, share=0.5)


FAMILIES += [of_asset(suffix) for suffix in ("stl", "txt.stl", "obj", "dae", "msh", "png", "bin")]
