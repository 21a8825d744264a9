"""SIGTERM ends a command as Ctrl-C does, so that no temporary files remain."""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager

PATIENCE = 2.0  # s that a call of the library may continue after SIGTERM


@contextmanager
def cleaned_up_at_sigterm() -> Iterator[None]:
    """Raises SystemExit at SIGTERM; a process that is still in a call of the library ends without cleaning up."""
    is_main = threading.current_thread() is threading.main_thread()
    if sys.platform == "win32" or not is_main or signal.getsignal(signal.SIGTERM) is not signal.SIG_DFL:
        yield
        return
    done = threading.Event()
    received, notice = os.pipe()
    os.set_blocking(notice, False)
    # Python's handlers wait for the end of a call of the library, the byte in the pipe does not
    threading.Thread(target=_wait, args=(received, done), daemon=True).start()
    before = signal.set_wakeup_fd(notice)
    signal.signal(signal.SIGTERM, _end)
    try:
        yield
    finally:
        done.set()
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
        signal.set_wakeup_fd(before)
        os.close(notice)


def _end(number: int, _frame: object) -> None:
    raise SystemExit(128 + number)


def _wait(received: int, done: threading.Event) -> None:
    number = b"\0"
    while number not in (b"", bytes([signal.SIGTERM])):
        number = os.read(received, 1)
    os.close(received)
    if number and not done.wait(PATIENCE):
        os._exit(128 + signal.SIGTERM)
