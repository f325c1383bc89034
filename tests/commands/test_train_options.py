# SPDX-License-Identifier: Apache-2.0
from pathlib import Path

import pytest
import tyro

from kintrack.commands.train import Train
from segmentation.architecture import DIAGRAMS, NetworkConfig


def asked(*words):
    return tyro.cli(Train, args=["data", "-o", "run", *words]).config.network


@pytest.mark.parametrize("architecture", sorted(DIAGRAMS))
def test_what_is_not_given_follows_the_architecture(architecture):
    assert asked("--network.architecture", architecture) == NetworkConfig(architecture)


def test_what_is_given_stays():
    network = asked("--network.widths", "4", "4", "8", "8", "--network.reach", "1")
    assert network == NetworkConfig("fast_fcn", (4, 4, 8, 8), 1)


def test_without_a_command_line_the_network_is_settled_too():
    assert Train((Path("data"),), Path("run")).config.network == NetworkConfig()
