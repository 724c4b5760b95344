"""Runs batches of cases in workers side by side; counts what they tell, and keeps the failures."""

from __future__ import annotations

import json
import os
import selectors
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from .families import MODULES
from .family import Family

BATCH = 400
PROGRESS = 60.0
"""Seconds between two calls of what is told of a run."""
PATIENCE = 8.0
"""Wall clock of a case over its processor time at most: what waits and does not compute hangs, too."""


@dataclass(frozen=True)
class Found:
    """A failure."""

    family: str
    seed: int
    index: int
    kind: str
    where: str
    """alike failures have the same"""
    text: str
    parts: int = 0


@dataclass
class Tally:
    """What the cases of one family came to."""

    cases: int = 0
    outcomes: dict[str, int] = field(default_factory=dict)
    failures: dict[str, int] = field(default_factory=dict)
    largest: dict[str, float] = field(default_factory=dict)
    seconds: float = 0.0

    def add(self, told: dict[str, Any]) -> None:
        self.cases += 1
        measures = told.get("measures", {})
        for name, value in {**measures, "cpu_s": told.get("cpu_s"), "peak_mb": told.get("peak_mb")}.items():
            if isinstance(value, int | float) and not isinstance(value, bool):
                self.largest[name] = max(self.largest.get(name, value), value)
        if kind := told.get("kind"):
            self.failures[kind] = self.failures.get(kind, 0) + 1
        else:
            outcome = measures.get("outcome", "done")
            self.outcomes[outcome] = self.outcomes.get(outcome, 0) + 1


def environment() -> dict[str, str]:
    """Of a worker: one thread per library, so that memory and time do not depend on the machine."""
    single = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1")
    paths = [str(Path(__file__).resolve().parents[1]), os.environ.get("PYTHONPATH", "")]
    return os.environ | single | {"PYTHONPATH": os.pathsep.join(filter(None, paths)), "MPLBACKEND": "Agg"}


def run_worker(job: dict[str, Any], patience: float) -> tuple[list[dict[str, Any]], dict[str, Any] | None]:
    """What a worker tells, and how it ended if it did not end well: the case, kind and text."""
    folder = Path(job["folder"])
    folder.mkdir(parents=True, exist_ok=True)
    log = folder / "stderr.txt"
    told: list[dict[str, Any]] = []
    current, timed_out = job.get("first", 0), False
    with log.open("w") as errors:
        # Without the packages of the site where the soak itself runs so: another build is on the path then.
        plain = ["-S"] if sys.flags.no_site else []
        command = [sys.executable, *plain, "-X", "faulthandler", "-m", "soak.worker", json.dumps(job)]
        worker = subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=errors, env=environment(), text=True
        )
        assert worker.stdout is not None
        with selectors.DefaultSelector() as ready:
            ready.register(worker.stdout, selectors.EVENT_READ)
            while True:
                spent = processor_time(worker.pid)
                if not ready.select(patience):
                    if processor_time(worker.pid) > spent:  # on a busy machine it computes, and has a limit
                        continue
                    timed_out = True
                    worker.kill()
                    break
                line = worker.stdout.readline()
                if not line:
                    break
                values = json.loads(line)
                current = values.get("begin", current)
                told.append(values)
        code = worker.wait()
        worker.stdout.close()
    if told and (told[-1].get("done") or job.get("replay")) and code == 0:
        return told, None
    tail = "\n".join(log.read_text(errors="replace").splitlines()[:60])
    if not told and code == 1:
        raise RuntimeError(f"the worker of {job['family']} did not begin:\n{tail}")
    return told, {"index": current, **how_it_ended(code, timed_out, tail)}


def processor_time(pid: int) -> int:
    """In ticks of the clock, 0 where the system does not tell."""
    try:
        fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return 0
    return int(fields[11]) + int(fields[12])  # utime and stime, fields 14 and 15 of proc(5)


def how_it_ended(code: int, timed_out: bool, log: str) -> dict[str, str]:
    if timed_out or code == -signal.SIGPROF:
        return {"kind": "hang", "where": "hang", "text": log}
    reason = signal.Signals(-code).name if code < 0 else f"exit code {code}"
    report = next((line for line in log.splitlines() if "SUMMARY:" in line or "runtime error" in line), "")
    frame = next((line.strip() for line in log.splitlines() if line.startswith("  File ")), "")
    return {"kind": "crash", "where": f"crash {reason} {report or frame}".strip(), "text": log}


class Run:
    """A run over families, for a time or a number of cases of each."""

    def __init__(
        self,
        families: list[Family],
        seed: int,
        *,
        cases: int,
        seconds: float,
        sanitized: bool,
        work: Path,
        scratch: Path,
        modules: Sequence[str] = MODULES,
        progress: Callable[[Run], None] = lambda run: None,
    ) -> None:
        self.families = [f.sanitized() for f in families] if sanitized else families
        self.seed, self.sanitized = seed, sanitized
        self.work, self.scratch = work, scratch  # of what is kept, of what is not
        self.modules = modules
        self.cases, self.until = cases, time.time() + seconds
        self.next = dict.fromkeys((f.name for f in families), 0)
        self.tallies = {f.name: Tally() for f in families}
        self.found: list[Found] = []
        self.progress, self._told = progress, time.monotonic()
        self._lock = threading.Lock()

    def go(self, jobs: int) -> None:
        threads = [threading.Thread(target=self._work, args=(k,)) for k in range(jobs)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()

    def only(self, family: Family, index: int) -> None:
        """One case, whose files are kept whatever comes of it."""
        self._batch(family, index, 1, self.work)

    def job(self, family: Family, first: int, count: int, folder: Path) -> dict[str, Any]:
        return dict(
            family=family.name, seed=self.seed, first=first, count=count, folder=str(folder),
            dropped=[], until=self.until, sanitized=self.sanitized, modules=list(self.modules),
        )  # fmt: skip

    def _work(self, number: int) -> None:
        while (batch := self._take()) is not None:
            family, first, count = batch
            while count > 0 and time.time() < self.until:
                done = self._batch(family, first, count, self.scratch / f"worker-{number}")
                first, count = first + done, count - done

    def _take(self) -> tuple[Family, int, int] | None:
        """The next batch, of the family that had least of its share of the time."""
        with self._lock:
            open_ = [f for f in self.families if self.next[f.name] < self.cases]
            if not open_ or time.time() > self.until:
                return None
            family = min(open_, key=lambda f: (self.tallies[f.name].seconds / f.share, self.next[f.name]))
            first = self.next[family.name]
            # Small batches at first, so that a short run comes to every family.
            count = min(BATCH, self.cases - first, max(25, first))
            self.next[family.name] = first + count
            self.tallies[family.name].seconds += 1e-3  # taken, though it has not run yet
            return family, first, count

    def _batch(self, family: Family, first: int, count: int, folder: Path) -> int:
        """Runs cases from `first` on until one ends the worker; how many were run."""
        start = time.time()
        told, ended = run_worker(self.job(family, first, count, folder), PATIENCE * family.cpu_s)
        with self._lock:
            tally = self.tallies[family.name]
            tally.seconds += time.time() - start
            for values in (v for v in told if "index" in v):
                tally.add(values)
                if "kind" in values:
                    self._keep(family, values)
            if ended is not None:
                tally.add(ended)
                self._keep(family, ended, folder / "case")
            if time.monotonic() - self._told > PROGRESS:
                self._told = time.monotonic()
                self.progress(self)
        last = ended["index"] if ended else max((v["index"] for v in told if "index" in v), default=first)
        return count if told and told[-1].get("done") else int(last) + 1 - first

    def _keep(self, family: Family, values: dict[str, Any], folder: Path | None = None) -> None:
        found = Found(
            family.name, self.seed, int(values["index"]), values["kind"], values["where"], values["text"],
            int(values.get("parts", 0)),
        )  # fmt: skip
        alike = sum(f.family == found.family and f.where == found.where for f in self.found)
        self.found.append(found)
        if alike < 3:
            place = self.work / "failures" / found.family / str(found.index)
            shutil.rmtree(place, ignore_errors=True)
            place.mkdir(parents=True)
            (place / "failure.txt").write_text(f"{found}\n\n{found.text}\n")
            if folder is not None and folder.is_dir():
                shutil.copytree(folder, place / "files")
        if alike == 0:
            print(f"  {found.family} case {found.index}: {found.kind}: {found.where}", flush=True)
