# SPDX-License-Identifier: Apache-2.0
"""Ctrl-C around a library that runs Python's signal handlers and drops what they raise."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

WAITING = tuple(
    getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGALRM") if hasattr(signal, name)
)
"""Signals whose handlers are put off."""


@contextmanager
def signals_put_off() -> Iterator[None]:
    """Run the handlers of signals that arrive in the block after it.

    CasADi asks for signals within a solve; a `KeyboardInterrupt` that the handler raises there ends
    the solve as a failure of its own and is lost. Does nothing outside of the main thread, where
    Python runs no handlers.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    arrived: list[tuple[Callable, int, FrameType | None]] = []
    put_off = {number: signal.getsignal(number) for number in WAITING}
    handlers = {number: handler for number, handler in put_off.items() if callable(handler)}
    for number in handlers:
        signal.signal(number, lambda n, frame: arrived.append((handlers[n], n, frame)))
    try:
        yield
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)
        for handler, number, frame in arrived:
            handler(number, frame)
