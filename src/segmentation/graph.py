# SPDX-License-Identifier: Apache-2.0
"""The networks as OpenVINO graphs, built from a weights file alone, in float or in int8.

Int8 follows OpenVINO's rules: `FakeQuantize` behind a layer names the range that 256 levels share,
and one in front of the weights names theirs per output channel, symmetric; the CPU plugin turns
both into integer arithmetic. The first convolution stays in float: 256 levels over all depths
would be steps of some 4 cm at 2.5 m.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import openvino as ov
from openvino import opset13 as ops

from segmentation.architecture import draw
from segmentation.labels import INPUT_CHANNELS, INPUT_HEIGHT, INPUT_WIDTH
from segmentation.weights import Weights

WEIGHT_LEVELS = 255
"""Int8 without -128, so that a range is symmetric."""
ACTIVATION_LEVELS = 256
BOTH_WAYS = 2
"""A picture and its mirror image."""


class Node(NamedTuple):
    """A place in the graph."""

    output: ov.Output
    """What OpenVINO calls it."""
    small: bool
    """Whether its values lie on the levels of int8."""


class GraphOperations:
    """The diagram's operations as OpenVINO nodes, with the tensors of a weights file."""

    def __init__(self, weights: Weights, quantised: bool):
        """Build in int8 where the ranges allow it, or all in float."""
        self._tensors = weights.tensors
        self._ranges = weights.ranges if quantised else {}

    def conv(self, name: str, x: Node, width: int, relu: bool = True, reach: int = 1) -> Node:
        """See `Operations`."""
        weight = self._weight(name, x, channel=0)
        out = ops.convolution(x.output, weight, [1, 1], [reach] * 2, [reach] * 2, [reach] * 2)
        return self._finish(name, self._biased(name, out), relu)

    def pool(self, x: Node) -> Node:
        """See `Operations`."""
        pooled = ops.max_pool(x.output, [2, 2], [1, 1], [0, 0], [0, 0], [2, 2])
        return Node(pooled.output(0), x.small)

    def deconv(self, name: str, x: Node, width: int, like: Node, kernel: int = 4) -> Node:
        """See `Operations`."""
        weight = self._weight(name, x, channel=1)
        crop = (kernel - 2) // 2
        odd = [like.output.shape[axis] - 2 * x.output.shape[axis] for axis in (2, 3)]
        pads_end = [crop - extra for extra in odd]
        out = ops.convolution_backprop_data(
            x.output, weight, [2, 2], None, [crop, crop], pads_end, [1, 1]
        )
        return self._finish(name, self._biased(name, out), relu=False)

    def join(self, a: Node, b: Node) -> Node:
        """See `Operations`."""
        return Node(ops.concat([a.output, b.output], 1).output(0), a.small and b.small)

    def add(self, name: str, a: Node, b: Node) -> Node:
        """See `Operations`."""
        return self._finish(name, ops.add(a.output, b.output), relu=True)

    def _weight(self, name: str, x: Node, channel: int) -> ov.Node:
        weight = self._tensors[f"{name}.weight"]
        constant = ops.constant(weight)
        if not x.small:
            return constant
        others = tuple(axis for axis in range(4) if axis != channel)
        most = np.maximum(np.abs(weight).max(axis=others, keepdims=True), 1e-12)
        return ops.fake_quantize(constant, -most, most, -most, most, WEIGHT_LEVELS)

    def _biased(self, name: str, out: ov.Node) -> ov.Node:
        return ops.add(out, ops.constant(self._tensors[f"{name}.bias"][None, :, None, None]))

    def _finish(self, name: str, out: ov.Node, relu: bool) -> Node:
        out = ops.relu(out) if relu else out
        if name not in self._ranges:
            return Node(out.output(0), False)
        low, high = (np.float32(end) for end in self._ranges[name])
        return Node(ops.fake_quantize(out, low, high, low, high, ACTIVATION_LEVELS).output(0), True)


def openvino_model(weights: Weights, quantised: bool) -> ov.Model:
    """The network as an OpenVINO model, (2, 4, 106, 128) to (2, 7, 106, 128), both float32.

    Args:
        weights: Network, tensors and, for int8, ranges.
        quantised: Int8 inside, by the ranges of the weights file.
    """
    shape = [BOTH_WAYS, len(INPUT_CHANNELS), INPUT_HEIGHT, INPUT_WIDTH]
    image = ops.parameter(shape, np.float32, "image")
    logits = draw(weights.config, GraphOperations(weights, quantised), Node(image.output(0), False))
    return ov.Model([logits.output], [image], weights.config.architecture)


def precisions(compiled: ov.CompiledModel) -> dict[str, str]:
    """In which type each convolution and deconvolution really runs (`f32`, `bf16`, `u8`, `i8`)."""
    found = {}
    for node in compiled.get_runtime_model().get_ordered_ops():
        facts = node.get_rt_info()
        if facts["layerType"].value in ("Convolution", "Deconvolution"):
            found[node.get_friendly_name()] = facts["runtimePrecision"].value
    return found
