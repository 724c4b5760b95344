"""Ctrl-C in the middle of what another library computes for seconds."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import TypeVar

T = TypeVar("T")


def interruptible(work: Callable[[], T]) -> T:
    """Returns or raises the result of `work`, a call that checks no signals and releases Python's lock.

    It runs on a thread of its own, for which the main thread waits: KeyboardInterrupt ends the wait, and what
    the call comes to is thrown away. On other threads, which no signal reaches, it is called as it is.
    """
    if threading.current_thread() is not threading.main_thread():
        return work()
    results: list[T] = []
    errors: list[BaseException] = []
    done = threading.Event()

    def run() -> None:
        try:
            results.append(work())
        except BaseException as error:
            errors.append(error)
        finally:
            done.set()

    threading.Thread(target=run, name="amontons-compile", daemon=True).start()
    done.wait()
    if errors:
        raise errors[0]
    return results[0]
