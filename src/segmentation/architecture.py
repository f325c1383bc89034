# SPDX-License-Identifier: Apache-2.0
"""Fast-FCN and its two rivals, each written once as its diagram.

A diagram is a function over `Operations`. Whoever implements these draws the same network: torch
to train it (`networks.py`), OpenVINO to run it (`graph.py`), and `Plan` here to count it. Sizes in
the comments are channels, rows, columns for the input of 4 x 106 x 128.

Pooling halves and drops an odd row (106, 53, 26, 13). A deconvolution restores exactly the size of
the layer it is `like`: an odd row comes back because one row less is cropped at the bottom.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, fields
from typing import NamedTuple, Protocol, TypeVar

from segmentation.errors import SegmentationError
from segmentation.labels import INPUT_CHANNELS, INPUT_HEIGHT, INPUT_WIDTH, LABELS

T = TypeVar("T")

HEAD = "logits"
"""Name of the layer that yields one logit per label in every network."""


class Operations(Protocol[T]):
    """All that the networks are made of; every convolution and deconvolution has a bias."""

    def conv(self, name: str, x: T, width: int, relu: bool = True, reach: int = 1) -> T:
        """Convolution 3x3 to `width` channels, size kept, then ReLU; taps `reach` pixels apart."""
        ...

    def pool(self, x: T) -> T:
        """Max-pooling 2x2, stride 2."""
        ...

    def deconv(self, name: str, x: T, width: int, like: T, kernel: int = 4) -> T:
        """Transposed convolution, stride 2, to `width` channels and the size of `like`; linear."""
        ...

    def join(self, a: T, b: T) -> T:
        """Channels of both."""
        ...

    def add(self, name: str, a: T, b: T) -> T:
        """Sum, then ReLU."""
        ...


def fast_fcn(net: Operations[T], image: T, widths: tuple[int, ...], reach: int = 2) -> T:
    """Fast-FCN [Wan19]: 9 convolutions, 3 poolings, 3 deconvolutions, bottleneck 512 x 13 x 16.

    The paper gives the counts, the bottleneck and "U-Net inspired"; the joins are ours. So is
    `reach`: with 2, the two convolutions of the bottleneck have their taps 2 and 4 cells apart (Yu
    & Koltun 2016), and a logit sees 150 pixels of the image instead of 90, at no cost.
    """
    w1, w2, w3, w4 = widths
    a = net.conv("down1", image, w1)  # (64, 106, 128)
    b = net.conv("down2", net.pool(a), w2)  # (128, 53, 64)
    c = net.conv("down3", net.pool(b), w3)  # (256, 26, 32)
    x = net.conv("middle1", net.pool(c), w4, reach=reach)  # (512, 13, 16)
    x = net.conv("middle2", x, w4, reach=reach**2)  # (512, 13, 16)
    x = net.join(net.deconv("rise3", x, w3, like=c), c)  # (256 + 256, 26, 32)
    x = net.conv("up3", x, w3)  # (256, 26, 32)
    x = net.join(net.deconv("rise2", x, w2, like=b), b)  # (128 + 128, 53, 64)
    x = net.conv("up2", x, w2)  # (128, 53, 64)
    x = net.join(net.deconv("rise1", x, w1, like=a), a)  # (64 + 64, 106, 128)
    x = net.conv("up1", x, w1)  # (64, 106, 128)
    return net.conv(HEAD, x, len(LABELS), relu=False)  # (7, 106, 128)


def unet(net: Operations[T], image: T, widths: tuple[int, ...]) -> T:
    """U-Net (Ronneberger et al. 2015) with padding: 18 convolutions, 4 poolings, 4 deconvolutions.

    The last of the 18 yields the logits, where the original adds a 1x1 convolution.
    """
    w1, w2, w3, w4, w5 = widths
    a = net.conv("down1b", net.conv("down1a", image, w1), w1)  # (64, 106, 128)
    b = net.conv("down2b", net.conv("down2a", net.pool(a), w2), w2)  # (128, 53, 64)
    c = net.conv("down3b", net.conv("down3a", net.pool(b), w3), w3)  # (256, 26, 32)
    d = net.conv("down4b", net.conv("down4a", net.pool(c), w4), w4)  # (512, 13, 16)
    x = net.conv("middle2", net.conv("middle1", net.pool(d), w5), w5)  # (1024, 6, 8)
    x = net.join(net.deconv("rise4", x, w4, like=d, kernel=2), d)  # (512 + 512, 13, 16)
    x = net.conv("up4b", net.conv("up4a", x, w4), w4)  # (512, 13, 16)
    x = net.join(net.deconv("rise3", x, w3, like=c, kernel=2), c)  # (256 + 256, 26, 32)
    x = net.conv("up3b", net.conv("up3a", x, w3), w3)  # (256, 26, 32)
    x = net.join(net.deconv("rise2", x, w2, like=b, kernel=2), b)  # (128 + 128, 53, 64)
    x = net.conv("up2b", net.conv("up2a", x, w2), w2)  # (128, 53, 64)
    x = net.join(net.deconv("rise1", x, w1, like=a, kernel=2), a)  # (64 + 64, 106, 128)
    return net.conv(HEAD, net.conv("up1", x, w1), len(LABELS), relu=False)  # (7, 106, 128)


def vgg_fcn(net: Operations[T], image: T, widths: tuple[int, ...]) -> T:
    """VGG-16's trunk with deconvolutions (Oliveira et al. 2016): 15, 5 and 5 operations.

    13 convolutions are the trunk of Simonyan & Zisserman 2015, two stand for its first two
    fully connected layers. Each deconvolution but the last is added to the trunk's layer of that
    size, as in Long et al. 2015; the last one yields the logits.
    """
    w1, w2, w3, w4, w5 = widths
    a = net.conv("trunk1b", net.conv("trunk1a", image, w1), w1)  # (64, 106, 128)
    b = net.conv("trunk2b", net.conv("trunk2a", net.pool(a), w2), w2)  # (128, 53, 64)
    c = net.conv("trunk3b", net.conv("trunk3a", net.pool(b), w3), w3)  # (256, 26, 32)
    c = net.conv("trunk3c", c, w3)  # (256, 26, 32)
    d = net.conv("trunk4b", net.conv("trunk4a", net.pool(c), w4), w4)  # (512, 13, 16)
    d = net.conv("trunk4c", d, w4)  # (512, 13, 16)
    e = net.conv("trunk5b", net.conv("trunk5a", net.pool(d), w5), w5)  # (512, 6, 8)
    e = net.conv("trunk5c", e, w5)  # (512, 6, 8)
    x = net.conv("middle2", net.conv("middle1", net.pool(e), w5), w5)  # (512, 3, 4)
    x = net.add("sum5", net.deconv("rise5", x, w5, like=e), e)  # (512, 6, 8)
    x = net.add("sum4", net.deconv("rise4", x, w4, like=d), d)  # (512, 13, 16)
    x = net.add("sum3", net.deconv("rise3", x, w3, like=c), c)  # (256, 26, 32)
    x = net.add("sum2", net.deconv("rise2", x, w2, like=b), b)  # (128, 53, 64)
    return net.deconv(HEAD, x, len(LABELS), like=image)  # (7, 106, 128)


DIAGRAMS: dict[str, Callable] = {"fast_fcn": fast_fcn, "unet": unet, "vgg_fcn": vgg_fcn}
"""Networks by name."""
MOST_REACH = 4
"""Taps further apart would all lie outside of the bottleneck."""
DEFAULT_REACH = {"fast_fcn": 2, "unet": 1, "vgg_fcn": 1}
"""Distance of the bottleneck's taps [cells]."""
DEFAULT_WIDTHS = {
    "fast_fcn": (64, 128, 256, 512),
    "unet": (64, 128, 256, 512, 1024),
    "vgg_fcn": (64, 128, 256, 512, 512),
}
"""Channels from the finest to the coarsest level."""


@dataclass(frozen=True)
class NetworkConfig:
    """Which network, and how wide."""

    architecture: str = "fast_fcn"
    """One of `DIAGRAMS`."""
    widths: tuple[int, ...] = ()
    """Channels per level, finest first; empty for `DEFAULT_WIDTHS`."""
    reach: int = 0
    """Distance of the taps in `fast_fcn`'s bottleneck [cells], 1 to 4; 0 for `DEFAULT_REACH`."""

    def __post_init__(self) -> None:
        if self.architecture not in DIAGRAMS:
            raise SegmentationError(
                f"architecture = {self.architecture!r}: {', '.join(DIAGRAMS)} are known"
            )
        usual = DEFAULT_WIDTHS[self.architecture]
        if not self.widths:
            object.__setattr__(self, "widths", usual)
        whole = all(type(w) is int and 1 <= w <= 4096 for w in self.widths)
        if len(self.widths) != len(usual) or not whole:
            raise SegmentationError(
                f"widths = {self.widths!r}: {self.architecture} needs {len(usual)} whole numbers "
                "from 1 to 4096"
            )
        if self.reach == 0:
            object.__setattr__(self, "reach", DEFAULT_REACH[self.architecture])
        most = MOST_REACH if self.architecture == "fast_fcn" else 1
        if type(self.reach) is not int or not 1 <= self.reach <= most:
            raise SegmentationError(
                f"reach = {self.reach!r}: {self.architecture} takes 1 to {most}, or 0"
            )

    @classmethod
    def left_open(cls) -> NetworkConfig:
        """A default for command lines: what is not given follows the architecture that is.

        It is no network until `replace` or a constructor has settled it.
        """
        made = cls()
        for entry in fields(cls):
            object.__setattr__(made, entry.name, entry.default)
        return made


class Layer(NamedTuple):
    """One convolution or deconvolution."""

    name: str
    """Its name; its tensors are `name.weight` and `name.bias`."""
    kind: str
    """`conv` or `deconv`."""
    inputs: int
    """Channels that enter."""
    outputs: int
    """Channels that leave."""
    kernel: int
    """Side of the square kernel [px]."""
    relu: bool
    """Whether what leaves is rectified."""
    reach: int
    """Distance of neighbouring taps [px]."""
    macs: int
    """Multiplications with an addition, cropped border of a deconvolution included."""

    @property
    def weight_shape(self) -> tuple[int, int, int, int]:
        """As torch keeps it: (out, in, k, k), for a deconvolution (in, out, k, k)."""
        pair = (self.outputs, self.inputs) if self.kind == "conv" else (self.inputs, self.outputs)
        return (*pair, self.kernel, self.kernel)


class Size(NamedTuple):
    """What a layer yields."""

    channels: int
    """Planes."""
    rows: int
    """Height [px]."""
    columns: int
    """Width [px]."""


@dataclass
class Plan:
    """Operations that only keep the books."""

    layers: list[Layer] = field(default_factory=list)
    """Convolutions and deconvolutions in the order of the diagram."""
    sizes: list[Size] = field(default_factory=list)
    """What each of `layers` yields."""
    pools: int = 0
    """Max-poolings."""

    def conv(self, name: str, x: Size, width: int, relu: bool = True, reach: int = 1) -> Size:
        """See `Operations`."""
        out = Size(width, x.rows, x.columns)
        macs = 9 * x.channels * width * x.rows * x.columns
        self._note(Layer(name, "conv", x.channels, width, 3, relu, reach, macs), out)
        return out

    def pool(self, x: Size) -> Size:
        """See `Operations`."""
        self.pools += 1
        return Size(x.channels, x.rows // 2, x.columns // 2)

    def deconv(self, name: str, x: Size, width: int, like: Size, kernel: int = 4) -> Size:
        """See `Operations`."""
        out = Size(width, like.rows, like.columns)
        macs = kernel * kernel * x.channels * width * x.rows * x.columns
        self._note(Layer(name, "deconv", x.channels, width, kernel, False, 1, macs), out)
        return out

    def join(self, a: Size, b: Size) -> Size:
        """See `Operations`."""
        return Size(a.channels + b.channels, b.rows, b.columns)

    def add(self, name: str, a: Size, b: Size) -> Size:
        """See `Operations`."""
        return a

    def _note(self, layer: Layer, out: Size) -> None:
        self.layers.append(layer)
        self.sizes.append(out)


def plan(config: NetworkConfig) -> Plan:
    """The layers of a network and what they yield, without building it."""
    books = Plan()
    draw(config, books, Size(len(INPUT_CHANNELS), INPUT_HEIGHT, INPUT_WIDTH))
    return books


def draw(config: NetworkConfig, net: Operations[T], image: T) -> T:
    """Run the network's diagram with the given operations; returns the logits."""
    if config.architecture == "fast_fcn":
        return fast_fcn(net, image, config.widths, config.reach)
    return DIAGRAMS[config.architecture](net, image, config.widths)


def count_operations(config: NetworkConfig) -> tuple[int, int, int]:
    """Convolutions, max-poolings and deconvolutions of a network."""
    books = plan(config)
    convolutions = sum(layer.kind == "conv" for layer in books.layers)
    return convolutions, books.pools, len(books.layers) - convolutions


def count_parameters(config: NetworkConfig) -> int:
    """Weights and biases of a network."""
    return sum(
        layer.inputs * layer.outputs * layer.kernel**2 + layer.outputs
        for layer in plan(config).layers
    )


def count_flops(config: NetworkConfig) -> int:
    """Floating-point operations per frame, two for each multiplication with an addition."""
    return 2 * sum(layer.macs for layer in plan(config).layers)
