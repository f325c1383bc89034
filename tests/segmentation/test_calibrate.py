# SPDX-License-Identifier: Apache-2.0
"""Int8 ranges."""

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("torch")

from segmentation.architecture import HEAD, plan  # noqa: E402
from segmentation.calibrate import best_clip, calibrated  # noqa: E402
from segmentation.errors import SegmentationError  # noqa: E402


def rounding_cost(x, top, levels):
    step = top / levels
    return np.square(np.clip(np.round(x / step) * step, 0, top) - x).sum()


def test_the_clip_is_as_good_as_the_best_of_a_search():
    x = np.abs(np.random.default_rng(0).laplace(size=200_000))
    counts, _ = np.histogram(x, 2048, (0, x.max()))
    top = best_clip(counts, x.max(), 127)
    costs = [rounding_cost(x, t, 127) for t in np.linspace(0.2, 1.0, 60) * x.max()]
    assert top < 0.95 * x.max()
    assert rounding_cost(x, top, 127) < 1.02 * min(costs)


def test_values_that_all_matter_are_not_clipped():
    assert best_clip(np.ones(2048), 3.0, 255) == pytest.approx(3.0, rel=0.01)


def test_every_layer_but_the_last_has_a_range(slim):
    layers = {layer.name for layer in plan(slim.config).layers}
    assert slim.ranges.keys() == layers - {HEAD}


def test_layers_that_are_joined_share_one_range(slim):
    for level in "123":
        assert slim.ranges[f"rise{level}"] == slim.ranges[f"down{level}"]


def test_rectified_layers_that_stand_alone_spend_no_level_below_zero(slim):
    assert slim.ranges["up1"][0] == slim.ranges["middle2"][0] == 0.0
    assert slim.ranges["rise1"][0] < 0


def test_nothing_to_calibrate_on_is_an_error(slim):
    with pytest.raises(SegmentationError, match="at least one frame"):
        calibrated(replace(slim, ranges={}), [])
