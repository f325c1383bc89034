# SPDX-License-Identifier: Apache-2.0
import platform
import subprocess
import sys

import pytest

KEPT = """
import resource
from segmentation.heap import keep_memory
assert keep_memory()
faults = []
for _ in range(20):
    block = bytearray(1 << 26)
    del block
    faults.append(resource.getrusage(resource.RUSAGE_SELF).ru_minflt)
assert faults[-1] - faults[4] < 1000, faults
"""
"""64 MiB are 16,384 pages."""


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="needs glibc")
def test_large_blocks_are_fetched_from_the_kernel_once():
    subprocess.run([sys.executable, "-c", KEPT], check=True)
