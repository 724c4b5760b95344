"""The Parquet file of a study: one row per run, at every moment a whole file."""

from __future__ import annotations

import json
import time
from collections.abc import Iterable, Sequence
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import FileError, InputError
from ..io.files import locked, write_whole
from ..limits import DEFAULT, readable
from .points import MOST_RUNS, RESERVED, agree, kind, plain
from .task import STATUSES, Row

if TYPE_CHECKING:
    import pyarrow

META = b"amontons"
SHARE = 0.05
"""of the time of a study that writing may take: rows that come faster wait for each other"""
LEADING, TRAILING = ("repetition", "seed"), tuple(name for name in RESERVED[3:])


class Rows:
    """The rows of a study by key, in memory and, with a path, in a file that is replaced as they come.

    The file is read when there is one: of a study of the same run and parameters, else InputError.
    """

    def __init__(self, path: Path | None, run: str, parameters: Sequence[str]) -> None:
        self._path, self._about = path, {"run": run, "parameters": sorted(parameters)}
        self._parameters = list(parameters)
        self._rows: dict[str, Row] = {}
        self._kinds: dict[str, str] = {}
        self._stale = False
        self._written, self._cost = 0.0, 0.0
        if path is not None and path.exists():
            self._read(path)

    def __contains__(self, key: str) -> bool:
        return key in self._rows

    def __getitem__(self, key: str) -> Row:
        return self._rows[key]

    def add(self, key: str, row: Row) -> Row:
        """Enter a row, given back as entered; the file follows, at once if the last write was long ago."""
        for name, value in row.items():
            mine, theirs = kind(value), self._kinds.get(name, "")
            if name not in RESERVED and (not agree(mine, theirs) or " and " in mine):
                row = {known: row[known] for known in row if known in RESERVED or known in self._parameters}
                row["status"] = "failed"
                row["error"] = f"the result {name!r} is a {mine}, in other rows a {theirs}: return one kind"
                break
        for name, value in row.items():
            self._kinds[name] = self._kinds.get(name, "") or kind(value)
        self._rows[key], self._stale = row, True
        self.write_if_due()
        return row

    def write_if_due(self) -> None:
        """Write what is new, if that keeps to the share of time."""
        if self._stale and time.monotonic() - self._written > self._cost / SHARE:
            self.write()

    def write(self, first: Iterable[str] = ()) -> None:
        """Replace the file, the rows of the keys `first` at its head."""
        order = list(dict.fromkeys([*(key for key in first if key in self._rows), *self._rows]))
        if self._path is None or not (self._stale or order != list(self._rows)):
            return
        import pyarrow.parquet

        start = time.monotonic()
        self._rows = {key: self._rows[key] for key in order}
        stream = pyarrow.BufferOutputStream()
        pyarrow.parquet.write_table(self.table(order), stream)
        write_whole({self._path: memoryview(stream.getvalue())})
        self._stale = False
        self._written = time.monotonic()
        self._cost = self._written - start

    def table(self, keys: Iterable[str]) -> pyarrow.Table:
        """The rows of these keys: parameters, results, then what every study tells."""
        import pyarrow

        rows = [(key, self._rows[key]) for key in keys]
        names = dict.fromkeys(name for _, row in rows for name in row)
        results = [name for name in names if name not in RESERVED and name not in self._parameters]
        leading = [name for name in LEADING if name in names]
        columns: dict[str, Any] = {"key": pyarrow.array([key for key, _ in rows], pyarrow.string())}
        for name in [*self._parameters, *leading, *results, *TRAILING]:
            columns[name] = _column([row.get(name) for _, row in rows], _types().get(name))
        return pyarrow.table(columns).replace_schema_metadata({META: json.dumps(self._about)})

    def _read(self, path: Path) -> None:
        table, about = read_table(path)
        if about != self._about:
            what = "run" if about["run"] != self._about["run"] else "parameters"
            raise InputError(
                f"{path}: holds another study, of the {what} {about[what]}, not {self._about[what]}; "
                "give another out, or delete the file"
            )
        self._parameters = [name for name in table.column_names if name in self._parameters]
        for row in table.to_pylist():
            key = row.pop("key")
            self._rows[key] = {name: value for name, value in row.items() if value is not None}
            for name, value in row.items():
                self._kinds[name] = self._kinds.get(name, "") or kind(value)


def read_table(path: Path) -> tuple[pyarrow.Table, dict[str, Any]]:
    """The rows of a study in a file, and of what run and parameters they are.

    FileError for all that no study wrote: it may have been damaged, or forged.
    """
    import pyarrow.parquet

    try:
        file = pyarrow.parquet.ParquetFile(path)
        size = sum(file.metadata.row_group(k).total_byte_size for k in range(file.metadata.num_row_groups))
        if file.metadata.num_rows > MOST_RUNS or size > DEFAULT.memory:
            raise FileError(
                f"{path}: declares {file.metadata.num_rows} rows of {readable(size)}, more than a study has"
            )
        table = file.read()
        table.validate(full=True)
        about = json.loads((table.schema.metadata or {}).get(META, b"null"))
    except FileError:
        raise
    except Exception as error:  # of PyArrow, of any kind
        reason = " ".join(str(error).split())[:300]
        raise FileError(f"{path}: cannot be read as Parquet ({reason}); give another out") from None
    if about is None:
        raise FileError(f"{path}: was not written by a study; give another out")
    if what := _odd(table, about):
        raise FileError(f"{path}: {what}; the file is damaged: give another out")
    return table, about


def _odd(table: pyarrow.Table, about: Any) -> str:
    """Content of a table that no study writes; "" if there is none."""
    told = about if isinstance(about, dict) else {}
    parameters = told.get("parameters")
    named = isinstance(parameters, list) and all(isinstance(name, str) for name in parameters)
    if not named or not isinstance(told.get("run"), str):
        return "it does not say of which run and parameters it is"
    names = table.column_names
    if len(set(names)) < len(names):
        return "two columns have one name"
    for name in ("key", "status", *parameters):
        if name not in names:
            return f"the column {name!r} is missing"
    for name, kind_ in _types().items():
        if name in names and table.schema.field(name).type != kind_:
            return f"the column {name!r} holds {table.schema.field(name).type}, not {kind_}"
    return _odd_values(table)


def _odd_values(table: pyarrow.Table) -> str:
    try:
        rows = table.to_pylist()
        keys = [row["key"] for row in rows]
        for name, value in (
            (name, value) for row in rows for name, value in row.items() if name != "started"
        ):
            plain(name, value)
    except Exception as error:  # texts that are none, times that there are not, values of other kinds
        return f"a value cannot be read ({' '.join(str(error).split())[:200]})"
    if None in keys or len(set(keys)) < len(keys):
        return "keys are missing, or stand in it twice"
    odd = {row["status"] for row in rows} - set(STATUSES)
    return f"the status {min(map(repr, odd))} is none" if odd else ""


def _types() -> dict[str, Any]:
    """Types of the columns that every study has."""
    import pyarrow

    types = dict.fromkeys(RESERVED, pyarrow.string())
    types |= dict.fromkeys(("repetition", "seed", "attempts", "steps", "missed"), pyarrow.int64())
    types |= dict.fromkeys(("wall", "worst_residual"), pyarrow.float64())
    return types | {"started": pyarrow.timestamp("us", "UTC")}


def _column(values: list[Any], type: Any) -> Any:
    import pyarrow

    if type is None and {int, float} <= {value.__class__ for value in values}:
        type = pyarrow.float64()
    return pyarrow.array(values, type)


def alone(path: Path | None) -> AbstractContextManager[None]:
    """FileError if another study writes to this file."""
    if path is None:
        return nullcontext()
    return locked(path, "another study is writing to it; wait for it, or give another out")
