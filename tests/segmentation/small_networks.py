# SPDX-License-Identifier: Apache-2.0
"""Untrained networks, and pictures that resemble a room."""

import numpy as np
import pytest

torch = pytest.importorskip("torch")

from segmentation.architecture import NetworkConfig  # noqa: E402
from segmentation.networks import PartNetwork, tensors_of  # noqa: E402
from segmentation.preprocess import network_input  # noqa: E402
from segmentation.weights import Weights  # noqa: E402

SLIM = NetworkConfig("fast_fcn", (8, 16, 24, 32))
FOCAL_PX = 365.0


def room(seed):
    """Depth [m] of a wall, a floor and a box of a person's size, with holes, and colours."""
    rng = np.random.default_rng(seed)
    v, u = np.mgrid[:424, :512].astype(np.float32)
    depth = np.minimum(rng.uniform(3.0, 5.0), 400.0 / np.maximum(v - 150.0, 1.0))
    middle, near = rng.uniform(100, 400), rng.uniform(1.5, 2.5)
    box = (np.abs(u - middle) < 40) & (v > 90) & (v < 380)
    depth[box] = near + 0.1 * np.cos((u[box] - middle) / 25.0)
    depth[rng.random(depth.shape) < 0.05] = 0.0
    color = rng.integers(0, 256, (7, 8, 3), dtype=np.uint8).repeat(64, 0).repeat(64, 1)
    return depth.astype(np.float32), color[:424, :512]


def room_input(seed):
    depth, color = room(seed)
    return network_input(depth, FOCAL_PX, color if seed % 2 else None)


def random_weights(config, seed=0, bias_seed=1):
    """Weights of an untrained network whose labels differ from place to place."""
    network = PartNetwork(config, seed)
    generator = torch.Generator().manual_seed(bias_seed)
    with torch.no_grad():
        for name, tensor in network.named_parameters():
            if name.endswith("bias"):
                tensor.normal_(0.0, 0.05, generator=generator)
    return Weights(config, tensors_of(network))
