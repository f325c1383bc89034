# SPDX-License-Identifier: Apache-2.0
import os
import signal
import subprocess
import sys
import time

PARENT = """
import subprocess, sys
child = subprocess.Popen([sys.executable, "-c",
    "from synthesis.workers import serve_parent; import time; serve_parent(); "
    "print('ready', flush=True); time.sleep(60)"], stdout=subprocess.PIPE)
child.stdout.readline()
print(child.pid, flush=True)
child.wait()
"""


def alive(pid):
    try:
        with open(f"/proc/{pid}/stat") as file:
            return file.read().split()[2] != "Z"
    except FileNotFoundError:
        return False


def test_a_worker_ends_when_its_parent_is_killed_but_not_at_ctrl_c():
    parent = subprocess.Popen([sys.executable, "-c", PARENT], stdout=subprocess.PIPE)
    child = int(parent.stdout.readline())
    os.kill(child, signal.SIGINT)
    time.sleep(1.0)
    assert alive(child)
    parent.kill()
    parent.wait()
    deadline = time.monotonic() + 10.0
    while alive(child) and time.monotonic() < deadline:
        time.sleep(0.1)
    assert not alive(child)
