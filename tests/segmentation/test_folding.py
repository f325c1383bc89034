# SPDX-License-Identifier: Apache-2.0
"""Normalisation while training, and that nothing of it is left afterwards."""

import numpy as np
import pytest

torch = pytest.importorskip("torch")

from segmentation.architecture import DEFAULT_WIDTHS, NetworkConfig  # noqa: E402
from segmentation.networks import PartNetwork, folded, unfold  # noqa: E402

ARCHITECTURES = sorted(DEFAULT_WIDTHS)


def slim(architecture):
    return NetworkConfig(architecture, tuple(8 for _ in DEFAULT_WIDTHS[architecture]))


def trained(architecture):
    """A normalised network whose statistics and scales are far from the initial ones."""
    network = PartNetwork(slim(architecture), 0, normalised=True)
    torch.manual_seed(1)
    for module in network.modules():
        if isinstance(module, torch.nn.BatchNorm2d):
            module.running_mean.normal_()
            module.running_var.uniform_(0.3, 3.0)
            module.weight.data.normal_(1.0, 0.3)
            module.bias.data.normal_(0.0, 0.3)
    return network.eval()


@pytest.mark.parametrize("architecture", ARCHITECTURES)
def test_folding_changes_no_logit(architecture):
    network = trained(architecture)
    plain = PartNetwork(network.config)
    plain.load_state_dict({k: torch.from_numpy(v) for k, v in folded(network).items()})
    image = torch.from_numpy(np.random.default_rng(2).normal(size=(2, 4, 106, 128))).float()
    with torch.no_grad():
        expected, got = network(image), plain.eval()(image)
    assert torch.allclose(expected, got, atol=1e-5 * float(expected.abs().max()))


@pytest.mark.parametrize("architecture", ARCHITECTURES)
def test_a_folded_network_has_the_tensors_of_the_diagram_and_no_more(architecture):
    plain = PartNetwork(slim(architecture))
    assert {k: v.shape for k, v in folded(trained(architecture)).items()} == {
        k: tuple(v.shape) for k, v in plain.state_dict().items()
    }


def test_folding_a_network_without_normalisation_keeps_its_weights():
    plain = PartNetwork(slim("fast_fcn"), 3)
    for name, tensor in folded(plain).items():
        assert (tensor == plain.state_dict()[name].numpy()).all()


def test_every_layer_but_the_last_is_normalised():
    network = PartNetwork(slim("fast_fcn"), 0, normalised=True)
    norms = [m for m in network.modules() if isinstance(m, torch.nn.BatchNorm2d)]
    assert len(norms) == 9 + 3 - 1


@pytest.mark.parametrize("architecture", ARCHITECTURES)
def test_trained_weights_compute_the_same_once_they_are_normalised(architecture):
    config = slim(architecture)
    plain, network = PartNetwork(config, 4).eval(), PartNetwork(config, 5, normalised=True)
    network.load_state_dict(plain.state_dict(), strict=False)
    images = torch.from_numpy(np.random.default_rng(2).normal(size=(6, 4, 106, 128))).float()
    unfold(network, images)
    with torch.no_grad():
        expected, whole = plain(images), network.train()(images)
        again = network.eval()(images)
    limit = 1e-4 * float(expected.abs().max())
    assert torch.allclose(expected, whole, atol=limit)
    assert torch.allclose(expected, again, atol=0.05 * float(expected.abs().max()))


def test_statistics_are_those_of_the_batch_and_scales_undo_them():
    network = PartNetwork(slim("fast_fcn"), 5, normalised=True)
    unfold(network, torch.ones((2, 4, 106, 128)) * torch.arange(128.0))
    norm = network.get_submodule("down1_norm")
    assert torch.allclose(norm.bias, norm.running_mean)
    assert torch.allclose(norm.weight, torch.sqrt(norm.running_var + norm.eps))
    assert float(norm.running_var.max()) > 1.0
    assert network.training
