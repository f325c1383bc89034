# SPDX-License-Identifier: Apache-2.0
"""A small network with calibrated random weights."""

from dataclasses import replace
from importlib.util import find_spec

import pytest


@pytest.fixture(scope="session", autouse=True)
def one_thread():
    """Small networks gain nothing from threads that wait for each other on a busy machine."""
    if find_spec("torch") is None:
        yield
        return
    import torch

    before = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(before)


@pytest.fixture(scope="session")
def slim():
    """Calibrated weights of a slim Fast-FCN."""
    pytest.importorskip("torch")
    from small_networks import SLIM, random_weights, room_input

    from segmentation.calibrate import calibrated

    weights = calibrated(random_weights(SLIM), [room_input(seed) for seed in range(6)])
    return replace(weights, training={"seed": 0, "data": ["none"]})
