# SPDX-License-Identifier: Apache-2.0
import os

import pytest

from kintrack.bench.running import one_thread_for_children, run_all


def test_one_thread_for_workers_is_not_one_thread_for_who_starts_them(monkeypatch):
    monkeypatch.delenv("OMP_NUM_THREADS", raising=False)
    monkeypatch.setenv("MKL_NUM_THREADS", "3")
    with pytest.raises(KeyError), one_thread_for_children():
        assert os.environ["OMP_NUM_THREADS"] == os.environ["MKL_NUM_THREADS"] == "1"
        raise KeyError
    assert "OMP_NUM_THREADS" not in os.environ and os.environ["MKL_NUM_THREADS"] == "3"


def test_no_jobs_start_no_processes():
    assert run_all([], 2, pytest.fail) == {}
