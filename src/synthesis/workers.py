# SPDX-License-Identifier: Apache-2.0
"""How a worker process behaves: Ctrl-C is its parent's business, and it never outlives it."""

from __future__ import annotations

import os
import signal
import threading
import time

WATCH_S = 0.5
"""How often a worker looks whether its parent is there [s]."""


def serve_parent() -> None:
    """Ignore Ctrl-C, and end at once when the parent has gone, however it went.

    Without this a killed build would leave workers that write into what the next build makes.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_watch, args=(os.getppid(),), daemon=True).start()


def _watch(parent: int) -> None:
    while os.getppid() == parent:
        time.sleep(WATCH_S)
    os._exit(1)
