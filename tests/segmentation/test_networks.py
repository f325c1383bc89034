# SPDX-License-Identifier: Apache-2.0
"""The networks in torch."""

import pytest

torch = pytest.importorskip("torch")

from segmentation.architecture import (  # noqa: E402
    DIAGRAMS,
    NetworkConfig,
    count_flops,
    count_parameters,
)
from segmentation.loss import segmentation_loss  # noqa: E402
from segmentation.networks import PartNetwork, network_of, tensors_of  # noqa: E402
from segmentation.weights import Weights  # noqa: E402

SLIM_WIDTHS = {"fast_fcn": (4, 6, 8, 10), "unet": (4, 6, 8, 10, 12), "vgg_fcn": (4, 6, 8, 10, 12)}


def slim(architecture, seed=0):
    return PartNetwork(NetworkConfig(architecture, SLIM_WIDTHS[architecture]), seed)


@pytest.mark.parametrize("architecture", DIAGRAMS)
def test_logits_have_the_size_of_the_input(architecture):
    assert slim(architecture)(torch.randn(2, 4, 106, 128)).shape == (2, 7, 106, 128)


@pytest.mark.parametrize("architecture", DIAGRAMS)
def test_the_counted_parameters_are_those_of_the_module(architecture):
    network = slim(architecture)
    count = sum(parameter.numel() for parameter in network.parameters())
    assert count == count_parameters(network.config)


@pytest.mark.parametrize("architecture", DIAGRAMS)
def test_the_counted_flops_are_those_that_torch_counts(architecture):
    from torch.utils.flop_counter import FlopCounterMode

    network = slim(architecture)
    with FlopCounterMode(display=False) as counter, torch.no_grad():
        network(torch.randn(1, 4, 106, 128))
    assert count_flops(network.config) == counter.get_total_flops()


@pytest.mark.parametrize("architecture", DIAGRAMS)
def test_random_weights_neither_quench_nor_blow_up_what_the_layers_pass_on(architecture):
    widths = (48,) * len(SLIM_WIDTHS[architecture])
    network = PartNetwork(NetworkConfig(architecture, widths), seed=0)
    moments = []
    for layer in network.children():
        layer.register_forward_hook(lambda _, given, __: moments.append(given[0].square().mean()))
    with torch.no_grad():
        logits = network(torch.randn(1, 4, 106, 128))
    assert all(0.5 < moment < 20 for moment in moments)
    assert logits.std() < 0.5


def test_a_logit_sees_further_where_the_bottleneck_reaches_further():
    """Width of what one logit in the middle depends on."""
    seen = {}
    for reach in (1, 2):
        network = PartNetwork(NetworkConfig("fast_fcn", SLIM_WIDTHS["fast_fcn"], reach), 0)
        image = torch.randn(1, 4, 106, 128, requires_grad=True)
        network(image)[0, :, 53, 64].sum().backward()
        columns = torch.nonzero(image.grad.abs().sum((0, 1, 2)))
        seen[reach] = int(columns.max() - columns.min()) + 1
    assert seen[1] < 100 < seen[2]


@pytest.mark.parametrize("architecture", DIAGRAMS)
def test_every_parameter_gets_a_gradient(architecture):
    network = slim(architecture)
    labels = torch.randint(0, 7, (1, 106, 128))
    segmentation_loss(network(torch.randn(1, 4, 106, 128)), labels, 1.0).backward()
    assert all(parameter.grad.abs().sum() > 0 for parameter in network.parameters())


def test_a_seed_repeats_the_weights_and_another_does_not():
    first, again, other = (tensors_of(slim("fast_fcn", seed)) for seed in (3, 3, 4))
    assert all((first[name] == again[name]).all() for name in first)
    assert (first["down1.weight"] != other["down1.weight"]).any()


def test_weights_out_of_a_network_make_the_same_network():
    network = slim("unet")
    image = torch.randn(1, 4, 106, 128)
    copy = network_of(Weights(network.config, tensors_of(network)))
    with torch.no_grad():
        assert torch.equal(copy(image), network(image))


def test_a_network_learns_two_frames_by_heart():
    torch.manual_seed(0)
    network = slim("fast_fcn")
    image = torch.randn(2, 4, 106, 128)
    labels = (image[:, 3] > 0).long() * 2
    optimiser = torch.optim.Adam(network.parameters(), 0.01)
    losses = []
    for _ in range(15):
        loss = segmentation_loss(network(image), labels, 0.5)
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()
        losses.append(loss.item())
    assert losses[-1] < 0.7 * losses[0]
