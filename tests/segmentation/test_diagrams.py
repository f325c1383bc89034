# SPDX-License-Identifier: Apache-2.0
"""The networks on paper: counts and sizes as METHOD.md 3 gives them."""

import pytest

from segmentation.architecture import (
    DEFAULT_WIDTHS,
    DIAGRAMS,
    HEAD,
    NetworkConfig,
    count_flops,
    count_operations,
    count_parameters,
    plan,
)
from segmentation.errors import SegmentationError


@pytest.mark.parametrize(
    ("architecture", "counts"),
    [("fast_fcn", (9, 3, 3)), ("unet", (18, 4, 4)), ("vgg_fcn", (15, 5, 5))],
)
def test_a_network_has_the_papers_number_of_operations(architecture, counts):
    assert count_operations(NetworkConfig(architecture)) == counts


@pytest.mark.parametrize(
    ("architecture", "smallest"),
    [("fast_fcn", (512, 13, 16)), ("unet", (1024, 6, 8)), ("vgg_fcn", (512, 3, 4))],
)
def test_the_bottleneck_is_as_small_as_the_poolings_make_it(architecture, smallest):
    sizes = plan(NetworkConfig(architecture)).sizes
    assert min(sizes, key=lambda size: size.rows) == smallest


@pytest.mark.parametrize("architecture", DIAGRAMS)
def test_a_network_ends_with_a_logit_per_label_at_full_size(architecture):
    books = plan(NetworkConfig(architecture))
    assert books.layers[-1].name == HEAD
    assert books.sizes[-1] == (7, 106, 128)


@pytest.mark.parametrize("architecture", DIAGRAMS)
def test_all_layers_of_a_network_have_their_own_name(architecture):
    names = [layer.name for layer in plan(NetworkConfig(architecture)).layers]
    assert len(set(names)) == len(names)


def test_fast_fcn_of_the_usual_widths_has_8_million_parameters_and_11_gflop():
    config = NetworkConfig("fast_fcn", (64, 128, 256, 512))
    assert count_parameters(config) == pytest.approx(8.2e6, rel=0.01)
    assert count_flops(config) == pytest.approx(11.2e9, rel=0.01)


def test_no_widths_mean_the_usual_ones():
    assert NetworkConfig("unet") == NetworkConfig("unet", DEFAULT_WIDTHS["unet"])


def test_an_unknown_architecture_is_named_with_the_known_ones():
    with pytest.raises(SegmentationError, match="'segnet': fast_fcn, unet, vgg_fcn are known"):
        NetworkConfig("segnet")


@pytest.mark.parametrize("widths", [(8, 16, 32), (8, 16, 32, 0), (8, 16, 32, 1.5)])
def test_widths_that_make_no_network_are_named(widths):
    with pytest.raises(SegmentationError, match=r"widths = .*fast_fcn needs 4 whole numbers"):
        NetworkConfig("fast_fcn", widths)


@pytest.mark.parametrize("architecture, reach", [("fast_fcn", 5), ("fast_fcn", -1), ("unet", 2)])
def test_a_reach_that_makes_no_network_is_named(architecture, reach):
    with pytest.raises(SegmentationError, match=f"reach = {reach}: {architecture} takes 1 to"):
        NetworkConfig(architecture, reach=reach)


def test_only_the_bottleneck_of_fast_fcn_reaches_further():
    reaches = {layer.name: layer.reach for layer in plan(NetworkConfig("fast_fcn")).layers}
    assert (reaches.pop("middle1"), reaches.pop("middle2")) == (2, 4)
    assert set(reaches.values()) == {1}
    far, near = NetworkConfig("fast_fcn", reach=2), NetworkConfig("fast_fcn", reach=1)
    assert count_flops(far) == count_flops(near) and count_parameters(far) == count_parameters(near)
