"""amontons sweep: a study of many runs."""

from __future__ import annotations

import os
from collections import Counter
from pathlib import Path
from typing import Annotated, Any

import typer

from ..errors import InputError
from ..io.files import writable
from .common import NOT_CONVERGED, AsJson, complain, facts_table, one_line_errors, print_json
from .completion import studies

SHOWN = 5
"""errors told one by one"""


def sweep(
    study: Annotated[
        Path,
        typer.Argument(
            metavar="STUDY",
            help="Study file (TOML), with the keys of docs/studies.md.",
            autocompletion=studies,
        ),
    ],
    output: Annotated[
        Path | None,
        typer.Option(
            "--out", "--output", "-o", help="Parquet file to write; default: the one that the study names."
        ),
    ] = None,
    processes: Annotated[
        int | None,
        typer.Option(
            help="Number of worker processes; default: one per core. 0: no workers, runs one after another."
        ),
    ] = None,
    dask: Annotated[
        str | None, typer.Option(metavar="ADDRESS", help="Address of the Dask scheduler that does the runs.")
    ] = None,
    redo: Annotated[
        list[str] | None,
        typer.Option(help="Repeat the runs with this status: failed, timeout or died. Repeatable."),
    ] = None,
    module: Annotated[
        str | None,
        typer.Option(help="Allow only scenes and functions of this module (for a study of somebody else)."),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Run a study: one row per run in a Parquet file. The same command goes on where a stopped study was.

    The exit code is 0 if all runs are done, 1 if some failed or the study was interrupted, 2 for input that
    could not be used.
    """
    from ..studies.files import read_study
    from ..studies.sweep import require_parts
    from ..studies.sweep import sweep as run_study

    with one_line_errors():
        require_parts("pyarrow")
        chosen = read_study(study, module)
        out = writable(chosen.out, own=True) if output is None else output
        options = dict(chosen.options)
        if processes is not None and dask is not None:
            raise InputError("give one of --processes and --dask")
        if processes is not None:
            options["executor"] = processes
        client = None if dask is None else _client(dask)
        if client is not None:
            options["executor"] = client
        try:
            table = run_study(chosen.run, chosen.grid, out=out, redo=redo or (), **options)
        except KeyboardInterrupt:
            complain(f"interrupted; what was done is in {out}, and the same command goes on from there")
            raise typer.Exit(NOT_CONVERGED) from None
        finally:
            if client is not None:
                client.close()
    rows = table.select(["key", "status", "error", "wall", "missed", "worst_residual"]).to_pylist()
    _tell(rows, out, as_json)
    if any(row["status"] != "done" for row in rows):
        raise typer.Exit(NOT_CONVERGED)


def _client(address: str) -> Any:
    from ..studies.sweep import require_parts

    require_parts("distributed")
    from distributed import Client  # type: ignore[import-untyped]

    try:
        return Client(address, timeout="10s")
    except (OSError, ValueError) as error:
        raise InputError(f"--dask {address}: no scheduler answers there ({error})") from None


def _tell(rows: list[dict[str, Any]], out: Path, as_json: bool) -> None:
    counts = Counter(row["status"] for row in rows)
    residuals = [row["worst_residual"] for row in rows if row["worst_residual"] is not None]
    facts: dict[str, Any] = {
        "runs": len(rows),
        **{status: counts[status] for status in ("done", "failed", "timeout", "died") if counts[status]},
        "wall": sum(row["wall"] or 0.0 for row in rows),
        "missed": sum(row["missed"] or 0 for row in rows),
        "worst_residual": max(residuals, default=None),
        "out": os.fspath(out),
    }
    if as_json:
        print_json(facts)
        return
    shown = facts | {"wall": f"{facts['wall']:.3g} s in all runs", "missed": f"{facts['missed']} steps"}
    if residuals:
        shown["worst_residual"] = f"{max(residuals):.1e}"
    facts_table(shown.items())
    bad = [row for row in rows if row["status"] != "done"]
    for row in bad[:SHOWN]:
        complain(f"run {row['key']} {row['status']}: {row['error']}")
    if len(bad) > SHOWN:
        complain(f"and {len(bad) - SHOWN} more: they are rows, look at the column error")
