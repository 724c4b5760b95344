"""The process in which cases run; tells on its standard output, in lines of JSON, when one begins and ends.

A crash or a signal ends the process; the runner knows from the last line which case it was.
"""

from __future__ import annotations

import json
import os
import resource
import shutil
import signal
import sys
import time
import traceback
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any, TextIO

from .families import families
from .family import Case, Failure, Family, Measures


def main() -> int:
    job = json.loads(sys.argv[1])
    out = os.fdopen(os.dup(1), "w", buffering=1)
    os.dup2(2, 1)  # what libraries print is not for the runner
    sys.setrecursionlimit(1000)
    warnings.simplefilter("ignore")
    family = families(job["modules"])[job["family"]]
    if job["sanitized"]:
        family = family.sanitized()
    else:
        limit_memory(family.memory)
    if job.get("replay"):
        assert family.replay is not None
        tell(out, index=0, **judged(lambda: family.replay(Path(job["replay"])), family))
        return 0
    for index in range(job["first"], job["first"] + job["count"]):
        if time.time() > job["until"]:
            break
        run_case(family, job, index, out)
    tell(out, done=True)
    return 0


def run_case(family: Family, job: dict[str, Any], index: int, out: TextIO) -> None:
    folder = Path(job["folder"]) / "case"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    tell(out, begin=index)
    case = Case(family.name, job["seed"], index, folder, frozenset(job["dropped"]))
    told = judged(lambda: family.run(case), family)
    tell(out, index=index, parts=case.parts, **told)


def judged(run: Callable[[], Measures], family: Family) -> dict[str, Any]:
    """What a case came to: its measures, or how it failed."""
    signal.setitimer(signal.ITIMER_PROF, family.cpu_s)  # ends the process: no library can catch it
    start = time.process_time()
    told: dict[str, Any]
    try:
        told = {"measures": run()}
    except Failure as failure:
        told = {"kind": failure.kind, "text": str(failure), "where": failure.kind}
    except MemoryError as error:
        told = {"kind": "memory", "text": repr(error), "where": place(error)}
    except Exception as error:
        text = "".join(traceback.format_exception(error, limit=-12))
        told = {"kind": "internal error", "text": text, "where": place(error)}
    signal.setitimer(signal.ITIMER_PROF, 0)
    told["cpu_s"] = round(time.process_time() - start, 3)
    told["peak_mb"] = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024
    return told


def place(error: BaseException) -> str:
    """Type and the last place in the package: failures with the same one are alike."""
    frames = traceback.extract_tb(error.__traceback__)
    ours = [f for f in frames if "/amontons/" in f.filename] or frames
    at = f"{Path(ours[-1].filename).name}:{ours[-1].name}" if ours else "?"
    return f"{type(error).__name__} in {at}"


def limit_memory(more: int) -> None:
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    _, hard = resource.getrlimit(resource.RLIMIT_AS)
    resource.setrlimit(resource.RLIMIT_AS, (pages * resource.getpagesize() + more, hard))


def tell(out: TextIO, **values: Any) -> None:
    out.write(json.dumps(values, default=float) + "\n")


if __name__ == "__main__":
    sys.exit(main())
