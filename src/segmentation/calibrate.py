# SPDX-License-Identifier: Apache-2.0
"""Int8 ranges of a trained network, from what its layers yield on training frames.

A range is the one with the least mean squared error of rounding and clipping together. Layers that
are joined share one, so that the joined picture is one integer tensor.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import torch
from jaxtyping import Float
from numpy import ndarray
from torch import Tensor

from segmentation.architecture import HEAD, draw
from segmentation.errors import SegmentationError
from segmentation.networks import PartNetwork, TorchOperations, network_of
from segmentation.weights import Weights

BINS = 2048
"""Resolution of a layer's histogram of magnitudes."""


class Named(NamedTuple):
    """A tensor and the layer whose range holds it."""

    value: Tensor
    """What the layer yields, perhaps pooled since."""
    layer: str
    """Name of that layer."""


@dataclass
class Observer:
    """The diagram's operations in torch; `see(layer, tensor)` meets all that they yield."""

    inner: TorchOperations
    """Does the work."""
    see: Callable[[str, Tensor], None]
    """Called with every layer's name and result."""
    joined: list[tuple[str, str]]
    """Layers that must share a range, as met."""

    def conv(self, name: str, x: Named, width: int, relu: bool = True, reach: int = 1) -> Named:
        """See `Operations`."""
        return self._note(name, self.inner.conv(name, x.value, width, relu, reach))

    def pool(self, x: Named) -> Named:
        """See `Operations`."""
        return Named(self.inner.pool(x.value), x.layer)

    def deconv(self, name: str, x: Named, width: int, like: Named, kernel: int = 4) -> Named:
        """See `Operations`."""
        return self._note(name, self.inner.deconv(name, x.value, width, like.value, kernel))

    def join(self, a: Named, b: Named) -> Named:
        """See `Operations`."""
        self.joined.append((a.layer, b.layer))
        return Named(self.inner.join(a.value, b.value), a.layer)

    def add(self, name: str, a: Named, b: Named) -> Named:
        """See `Operations`."""
        return self._note(name, self.inner.add(name, a.value, b.value))

    def _note(self, name: str, value: Tensor) -> Named:
        self.see(name, value)
        return Named(value, name)


def calibrated(
    weights: Weights,
    inputs: Iterable[Float[ndarray, "4 106 128"]],
    device: torch.device | None = None,
) -> Weights:
    """The same weights with int8 ranges.

    Args:
        weights: A trained network.
        inputs: Some hundred network inputs of training frames; they are gone through twice.
        device: What computes; the processor if None.

    Raises:
        SegmentationError: if there are no inputs.
    """
    device = device or torch.device("cpu")
    images = [torch.from_numpy(np.ascontiguousarray(x))[None].to(device) for x in inputs]
    if not images:
        raise SegmentationError("calibration needs at least one frame, there is none")
    network = network_of(weights).to(device)
    lows: dict[str, float] = {}
    highs: dict[str, float] = {}

    def see_ends(name: str, value: Tensor) -> None:
        lows[name] = min(lows.get(name, 0.0), float(value.min()))
        highs[name] = max(highs.get(name, 1e-6), float(value.abs().max()))

    group = _groups(_observe(network, images, see_ends))
    most: dict[str, float] = {}
    for name, high in highs.items():
        key = group.get(name, name)
        most[key] = max(most.get(key, 0.0), high)
    counts = {key: np.zeros(BINS) for key in most}

    def see_all(name: str, value: Tensor) -> None:
        key = group.get(name, name)
        magnitudes = value[value != 0].abs()
        counts[key] += torch.histc(magnitudes, BINS, 0.0, most[key]).cpu().numpy()

    _observe(network, images, see_all)
    signed = {group.get(name, name) for name, low in lows.items() if low < 0}
    ranges = {}
    for name in highs:
        key = group.get(name, name)
        if name != HEAD:
            top = best_clip(counts[key], most[key], 127 if key in signed else 255)
            ranges[name] = (-top * 128 / 127 if key in signed else 0.0, top)
    return replace(weights, ranges=ranges)


def best_clip(counts: Float[ndarray, " bins"], most: float, levels: int) -> float:
    """Where to clip magnitudes so that clipping and rounding cost least, in squares.

    cost(t) = sum_(x > t) n (x - t)^2 + sum_(x <= t) n (t / levels)^2 / 12.

    Args:
        counts: Histogram of magnitudes over 0 to `most`.
        most: The largest magnitude.
        levels: Steps between 0 and the clip.

    Returns:
        t, at most `most`.
    """
    width = most / len(counts)
    x = (np.arange(len(counts)) + 0.5) * width
    t = (np.arange(len(counts)) + 1.0) * width
    above = [np.append(np.cumsum((counts * x**p)[::-1])[::-1][1:], 0.0) for p in (0, 1, 2)]
    clipping = above[2] - 2 * t * above[1] + t**2 * above[0]
    rounding = (t / levels) ** 2 / 12 * (counts.sum() - above[0])
    return float(t[np.argmin(clipping + rounding)])


def _observe(
    network: PartNetwork, images: Sequence[Tensor], see: Callable[[str, Tensor], None]
) -> list[tuple[str, str]]:
    """Run the network on all images, showing every layer's result; returns the joined layers."""
    operations = TorchOperations(network)
    with torch.inference_mode():
        for image in images:
            observer = Observer(operations, see, [])
            draw(network.config, observer, Named(image, "image"))
    return observer.joined


def _groups(joined: Iterable[tuple[str, str]]) -> dict[str, str]:
    """One name for all layers that share a range."""
    group: dict[str, str] = {}
    for a, b in joined:
        old, new = group.get(a, a), group.get(b, b)
        group = {k: new if v == old else v for k, v in group.items()} | {a: new, b: new}
    return group
