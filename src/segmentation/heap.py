# SPDX-License-Identifier: Apache-2.0
"""What is freed is kept while training on a CPU: giving it back takes half of the time."""

from __future__ import annotations

import ctypes

TRIM_THRESHOLD, TOP_PAD, MMAP_MAX = -1, -2, -4
"""Parameters of glibc's mallopt."""
KEPT_BYTES = 2**31 - 1
"""Free memory at the heap's end that is not given back, as much as can be said [bytes]."""
AHEAD_BYTES = 2**28
"""What the heap grows by [bytes]."""


def keep_memory() -> bool:
    """Let the C library keep what is freed, and take large blocks from its heap, too.

    Every step of a training needs the same large blocks. Usually each is fetched from the kernel,
    which fills it with zeros page by page, and given back.

    Returns:
        True if the C library knows how to (glibc does).
    """
    try:
        mallopt = ctypes.CDLL(None).mallopt
    except (AttributeError, OSError, TypeError):
        return False
    settings = ((MMAP_MAX, 0), (TRIM_THRESHOLD, KEPT_BYTES), (TOP_PAD, AHEAD_BYTES))
    return all(mallopt(name, value) == 1 for name, value in settings)
