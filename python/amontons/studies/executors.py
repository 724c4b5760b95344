"""Where runs are carried out: processes of this machine, any executor with `submit`, or right here.

Each has `capacity` (runs in flight), `own` (whether its processes are ours: on this machine, and a death
concerns one run), `start(key, task)`, `wait(seconds)`, which gives what ended since, `alive()`, the number of
workers that live, None if nobody knows, and `close()`, which lets go of what is still running.
"""

from __future__ import annotations

import logging
import os
import queue
import re
import signal
import threading
import time
from collections.abc import Mapping
from concurrent.futures import CancelledError
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing.connection import wait as ready
from typing import Any, NamedTuple, Protocol

from ..errors import InputError
from ..io import system
from .task import Row, Task, overdue, perform

logger = logging.getLogger(__name__)


class Died(NamedTuple):
    """No row came back: the worker is gone."""

    reason: str


Ended = list[tuple[str, "Row | Died"]]
LOOK = 1.0
"""between two counts of the workers (s)"""
ANSWER = 5.0
"""limit for the answer of a scheduler (s)"""
AGAIN = 0.1
"""from a result that could not be had to the next attempt (s)"""


class Future(Protocol):
    """The result of `submit`, as that of concurrent.futures."""

    def result(self, timeout: float | None = ...) -> Any: ...
    def cancel(self) -> Any: ...
    def add_done_callback(self, function: Any, /) -> Any: ...


class Executor(Protocol):
    """Interface that `sweep` needs: executors of concurrent.futures and mpi4py have it, and Dask's Client."""

    def submit(self, function: Any, /, *args: Any) -> Future: ...


class Here:
    """One run after the other in this process."""

    capacity, own = 1, True

    def __init__(self) -> None:
        self._ended: Ended = []

    def start(self, key: str, task: Task) -> None:
        self._ended.append((key, perform(task)))

    def wait(self, seconds: float) -> Ended:
        ended, self._ended = self._ended, []
        return ended

    def alive(self) -> int | None:
        return 1

    def close(self) -> None:
        pass


class Submitted:
    """The executor of the user. Nothing of it is closed; a timeout acts between two steps of a simulation."""

    capacity, own = 256, False

    def __init__(self, executor: Any) -> None:
        self._executor = executor
        self._dask = type(executor).__module__.startswith("distributed")
        # Dask takes two calls with equal arguments for one, unless they are said to be impure.
        self._options = {"pure": False} if self._dask else {}
        self._futures: dict[str, Future] = {}
        self._done: queue.SimpleQueue[str] = queue.SimpleQueue()

    def start(self, key: str, task: Task) -> None:
        try:
            future = self._executor.submit(perform, task, **self._options)
        except Exception as error:
            raise _lost(f"{type(self._executor).__name__} takes no work ({error})") from error
        self._futures[key] = future  # Dask forgets what nobody holds
        future.add_done_callback(lambda _: self._done.put(key))

    def wait(self, seconds: float) -> Ended:
        ended: Ended = []
        for key in _all_of(self._done, seconds):
            future = self._futures.pop(key, None)
            if future is None:
                continue
            try:
                # Dask can lose the result of a run that is done with its worker, and waits for another one.
                ended.append((key, future.result(timeout=ANSWER) if self._dask else future.result()))
            except OSError as error:  # a timeout, or a connection that broke, is one
                if self._dask:
                    time.sleep(AGAIN)
                    self._futures[key] = future
                    self._done.put(key)
                else:
                    ended.append((key, _died(error)))
            except CancelledError as error:  # by whoever ended the executor, or as its scheduler is gone
                raise _lost(
                    f"{type(self._executor).__name__} dropped its runs ({_died(error).reason})"
                ) from error
            except Exception as error:  # the run itself raises nothing: the executor lost it
                ended.append((key, _died(error)))
        return ended

    def alive(self) -> int | None:
        if self._dask:
            client = getattr(self._executor, "_client", self._executor)  # of Client.get_executor()
            try:
                return len(client.sync(client.scheduler.ncores, callback_timeout=ANSWER))
            except Exception:  # whatever a client raises whose scheduler is silent, or which is closed
                return 0
        processes = getattr(self._executor, "_processes", None)  # of loky and concurrent.futures
        return _living(processes) if isinstance(processes, dict) else None

    def close(self) -> None:
        for future in self._futures.values():
            # A client whose scheduler is gone refuses to cancel what is lost anyway.
            with suppress(Exception):
                future.cancel()


@dataclass
class _Slot:
    """A process, and what runs in it."""

    pool: Any
    key: str = ""
    """of the run at hand, none if empty"""
    number: int = 0
    """of the run, to distinguish messages of an earlier one"""
    since: float = float("inf")
    """when the worker began (s, monotonic)"""
    timeout: float | None = None


class Processes:
    """Worker processes (loky), each an executor of its own: the death of one concerns its own run only, and
    one that takes too long can be killed."""

    own = True

    def __init__(self, count: int) -> None:
        self.capacity = count
        self._slots = [_Slot(None) for _ in range(count)]
        self._events: queue.SimpleQueue[tuple[_Slot, int, Any]] = queue.SimpleQueue()

    def start(self, key: str, task: Task) -> None:
        slot = next(slot for slot in self._slots if not slot.key)
        slot.key, slot.number, slot.timeout, slot.since = key, slot.number + 1, task.timeout, float("inf")
        number = slot.number

        def begun(_: Any) -> None:  # imports of a new process do not count
            if slot.number == number:
                slot.since = time.monotonic()

        if slot.pool is None:
            slot.pool = _process()
        slot.pool.submit(_nothing).add_done_callback(begun)
        slot.pool.submit(perform, task).add_done_callback(lambda f: self._events.put((slot, number, f)))

    def wait(self, seconds: float) -> Ended:
        ended: Ended = []
        for slot, number, future in _all_of(self._events, seconds):
            if number != slot.number or not slot.key:
                continue  # of a worker that was killed here
            try:
                ended.append((slot.key, future.result()))
                slot.key = ""
            except Exception as error:
                ended.append((slot.key, Died(_cause(error))))
                self._drop(slot)
        now = time.monotonic()
        for slot in self._slots:
            # The worker itself stops between two steps; what never comes to a step is killed a little later.
            if slot.key and slot.timeout is not None and now - slot.since > 1.1 * slot.timeout + 1:
                ended.append((slot.key, {**overdue(slot.timeout), "wall": now - slot.since}))
                self._drop(slot)
        return ended

    def alive(self) -> int | None:
        return sum(_living(slot.pool._processes or {}) for slot in self._slots if slot.pool is not None)

    def _drop(self, slot: _Slot) -> None:
        slot.pool.shutdown(wait=False, kill_workers=True)
        slot.pool, slot.key = None, ""

    def close(self) -> None:
        for slot in self._slots:
            if slot.pool is not None:
                slot.pool.shutdown(wait=True, kill_workers=True)
                slot.pool = None


def _died(error: BaseException) -> Died:
    return Died(" ".join(f"{type(error).__name__}: {error}".split()))


class Attendance:
    """Counts the workers that live, and ends the wait for runs that nobody carries out."""

    def __init__(self, workers: Here | Submitted | Processes, patience: float | None) -> None:
        self._workers, self._patience = workers, patience
        self.count: int | None = None
        self._nobody = False
        self._seen = self._looked = time.monotonic()

    def look(self, came: bool) -> None:
        """Counts, where it is time; came: a run has just ended."""
        now = time.monotonic()
        if came:
            self._seen = now
        if now - self._looked < LOOK:
            return
        before, self.count = self.count, self._workers.alive()
        self._looked = time.monotonic()
        if self.count != 0:
            self._seen = self._looked
        elif before != 0:
            logger.warning("no worker is alive; the study waits for one")
        self._nobody = self.count == before == 0

    def require(self) -> None:
        """InputError after `patience` seconds in which no run ended and no look found a worker."""
        late = self._patience is not None and time.monotonic() - self._seen >= self._patience
        if self._nobody and late:
            raise _lost(f"no worker of the cluster is alive for {self._patience:g} s (patience)")


def _lost(reason: str) -> InputError:
    return InputError(
        f"executor: {reason}; start a new one and call again: a study with out= goes on where it was"
    )


def _living(processes: Mapping[int, Any]) -> int:
    """How many of them have not ended."""
    sentinels = []
    for process in list(processes.values()):
        with suppress(ValueError):  # closed: it has ended
            sentinels.append(process.sentinel)
    return len(sentinels) - len(ready(sentinels, 0)) if sentinels else 0


def _all_of(events: queue.SimpleQueue[Any], seconds: float) -> list[Any]:
    """Everything in the queue, after waiting for the first."""
    found: list[Any] = []
    try:
        found.append(events.get(timeout=seconds))
        while True:
            found.append(events.get_nowait())
    except queue.Empty:
        return found


def _process() -> Any:
    from loky import ProcessPoolExecutor  # type: ignore[import-untyped]

    # Libraries of linear algebra start a thread per core in each process, unless environment variables limit
    # them.
    names = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
    threads = {name: os.environ.get(name, "1") for name in names}
    return ProcessPoolExecutor(max_workers=1, initializer=_begin, initargs=(os.getpid(),), env=threads)


def _nothing() -> None:
    pass


def _begin(parent: int) -> None:
    """Ctrl-C is for the study, which ends its workers; a worker whose study was killed ends by itself."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)

    def watch() -> None:
        system.end_with(parent)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


def _cause(error: Exception) -> str:
    """Only the signal of loky's advice."""
    codes = re.search(r"exit codes of the workers are \{(.*?)\}", str(error))
    if codes:
        return f"the worker process ended with {codes.group(1)}"
    return _died(error).reason
