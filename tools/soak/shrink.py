"""Makes a failure small: leaves out parts of the case, then pieces of its file, as long as it fails alike."""

from __future__ import annotations

import hashlib
import shutil
from pathlib import Path

from .family import Family
from .runner import Found, Run, run_worker

TRIALS = 80
ENDLESS = {"until": 1e300}
"""The time of the run is over when its failures shrink."""


def shrink(family: Family, found: Found, into: Path, run: Run) -> Path:
    """The folder of the smallest case that was found, with failure.txt beside its files."""
    dropped: set[int] = set()
    for part in range(max(found.parts, 8 if found.kind in ("crash", "hang") else 0)):
        if _fails(family, found, run, dropped | {part}):
            dropped.add(part)
    again = _fails(family, found, run, dropped)  # once more, for its files
    made = run.scratch / "shrink" / "case"
    name = hashlib.sha256(f"{found.family} {found.where}".encode()).hexdigest()[:8]
    place = into / f"{found.family}-{name}"
    shutil.rmtree(place, ignore_errors=True)
    shutil.copytree(made, place)
    if family.main and family.replay and (place / family.main).is_file():
        _cut(family, found, place / family.main, run)
    words = f"{found.family} --seed {found.seed} --case {found.index} without the parts {sorted(dropped)}"
    words += "" if again else "; it did not fail a second time"
    (place / "failure.txt").write_text(f"{words}\n{found.kind}: {found.where}\n")
    return place


def _fails(family: Family, found: Found, run: Run, dropped: set[int]) -> bool:
    job = run.job(family, found.index, 1, run.scratch / "shrink") | {"dropped": sorted(dropped)} | ENDLESS
    return _alike(found, job, family)


def _alike(found: Found, job: dict, family: Family) -> bool:
    told, ended = run_worker(job, patience=8 * family.cpu_s)
    ends = [v for v in told if "kind" in v] + ([ended] if ended else [])
    return any(v["kind"] == found.kind and v["where"] == found.where for v in ends)


def _cut(family: Family, found: Found, path: Path, run: Run) -> None:
    """Delta debugging (Zeller, Hildebrandt 2002) over the lines of a file of text, the bytes of another."""
    job = run.job(family, 0, 1, run.scratch / "shrink") | {"replay": str(path)} | ENDLESS
    data = path.read_bytes()
    pieces = data.splitlines(keepends=True) if b"\0" not in data else [bytes([b]) for b in data]
    if not _alike(found, job, family):
        return
    size, trials = max(1, len(pieces) // 2), 0
    while size >= 1 and trials < TRIALS:
        start = 0
        while start < len(pieces) and trials < TRIALS:
            fewer = pieces[:start] + pieces[start + size :]
            path.write_bytes(b"".join(fewer))
            trials += 1
            if _alike(found, job, family):
                pieces = fewer
            else:
                start += size
        size //= 2
    path.write_bytes(b"".join(pieces))
