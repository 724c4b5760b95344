"""Work on a thread of its own, soon after it came in: what is recorded reaches the disk during a step."""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Callable
from typing import Generic, TypeVar

T = TypeVar("T")


class Background(Generic[T]):
    """Hands batches to a function: `delay` seconds after their first item came, or when they are large.

    No signal interrupts the function: Python raises KeyboardInterrupt on the main thread. An error ends its
    work. Every later `put` raises it, or else `close`.
    """

    def __init__(self, work: Callable[[list[T]], None], *, delay: float, enough: int) -> None:
        self._work, self._delay, self._enough = work, delay, enough
        self._changed = threading.Condition()
        self._items: list[T] = []
        self._size, self._due = 0, 0.0
        self._closing = False
        self._error: BaseException | None = None
        self._told = False
        self._process = os.getpid()
        self._thread = threading.Thread(target=self._run, name="amontons-recorder", daemon=True)
        self._thread.start()

    @property
    def ours(self) -> bool:
        """False in a process that was forked since: threads do not come along."""
        return self._process == os.getpid()

    def put(self, item: T, size: int) -> None:
        """Hand in an item of so many bytes; waits where the work is far behind."""
        with self._changed:
            if self._error is not None:
                self._told = True
                raise self._error
            if not self._items:
                self._due = time.monotonic() + self._delay
            self._items.append(item)
            self._size += size
            self._changed.notify_all()
            while self._size > 4 * self._enough and self._error is None:
                self._changed.wait()

    def close(self) -> None:
        """Wait until all is done."""
        if not self.ours:
            return
        with self._changed:
            self._closing = True
            self._changed.notify_all()
        self._thread.join()
        if self._error is not None and not self._told:
            self._told = True
            raise self._error

    def _run(self) -> None:
        while True:
            with self._changed:
                while not (self._closing or self._size > self._enough):
                    left = self._due - time.monotonic() if self._items else None
                    if left is not None and left <= 0:
                        break
                    self._changed.wait(left)
                items, self._items, self._size = self._items, [], 0
                if not items and self._closing:
                    return
                self._changed.notify_all()
            try:
                self._work(items)
            except BaseException as error:
                with self._changed:
                    self._error, self._items, self._closing = error, [], True
                    self._changed.notify_all()
                return
