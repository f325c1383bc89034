# SPDX-License-Identifier: Apache-2.0
"""The networks in torch: what training updates and `--runtime torch` runs."""

from __future__ import annotations

import math

import numpy as np
import torch
import torch.nn.functional as F
from jaxtyping import Float
from torch import Tensor, nn

from segmentation.architecture import HEAD, Layer, NetworkConfig, draw, plan
from segmentation.weights import Weights

NORM = "_norm"
"""Ends the name of the normalisation that follows a layer."""
HEAD_GAIN = 0.1
"""Spread of the first logits, so that training starts from nearly equal probabilities."""


class PartNetwork(nn.Module):
    """One of the three networks; its layers bear the names of the diagram.

    He's initialisation keeps the second moment of the input, which `preprocess.py` makes about 1,
    through all layers (He et al. 2015). A network that is trained normalises every layer but the
    last over the batch (Ioffe & Szegedy 2015); `folded` takes that out again, so that what is kept
    and run has no layer beyond the diagram's. `unfold` puts it into trained weights.
    """

    def __init__(self, config: NetworkConfig, seed: int | None = None, normalised: bool = False):
        """Build with random weights.

        Args:
            config: Which network.
            seed: Makes the weights repeatable; None takes torch's own state.
            normalised: Whether layers are followed by batch normalisation.
        """
        super().__init__()
        self.config = config
        generator = None if seed is None else torch.Generator().manual_seed(seed)
        for layer in plan(config).layers:
            self.add_module(layer.name, _module(layer, generator))
            if normalised and layer.name != HEAD:
                self.add_module(layer.name + NORM, nn.BatchNorm2d(layer.outputs))

    def forward(self, image: Float[Tensor, "b 4 106 128"]) -> Float[Tensor, "b 7 106 128"]:
        """Logits of every label at every pixel; `architecture.py` is the diagram."""
        return draw(self.config, TorchOperations(self), image)


def network_of(weights: Weights) -> PartNetwork:
    """The network of a weights file, set to inference."""
    network = PartNetwork(weights.config)
    network.load_state_dict({k: torch.from_numpy(np.array(v)) for k, v in weights.tensors.items()})
    return network.eval()


def tensors_of(network: PartNetwork) -> dict[str, np.ndarray]:
    """A copy of a network's weights as a weights file keeps them."""
    state = network.state_dict()
    return {name: tensor.detach().cpu().float().numpy().copy() for name, tensor in state.items()}


def folded(network: PartNetwork) -> dict[str, np.ndarray]:
    """Weights of the network without normalisation that computes the same in inference.

    With scale g, shift b, mean m and variance v of a channel, w' = w g / sqrt(v + eps) and
    c' = b + (c - m) g / sqrt(v + eps).
    """
    layers = dict(network.named_children())
    out: dict[str, np.ndarray] = {}
    for layer in plan(network.config).layers:
        module, norm = layers[layer.name], layers.get(layer.name + NORM)
        assert isinstance(module, nn.Conv2d | nn.ConvTranspose2d) and module.bias is not None
        weight, bias = (t.detach().cpu().double() for t in (module.weight, module.bias))
        if isinstance(norm, nn.BatchNorm2d):
            mean, var, scale, shift = (
                t.detach().cpu().double()
                for t in (norm.running_mean, norm.running_var, norm.weight, norm.bias)
                if t is not None
            )
            factor = scale / torch.sqrt(var + norm.eps)
            weight = weight * factor.reshape((-1, 1, 1, 1) if layer.kind == "conv" else (-1, 1, 1))
            bias = shift + (bias - mean) * factor
        out[f"{layer.name}.weight"] = weight.float().numpy()
        out[f"{layer.name}.bias"] = bias.float().numpy()
    return out


def unfold(network: PartNetwork, images: Float[Tensor, "b 4 106 128"]) -> None:
    """Let every normalisation begin where it changes nothing.

    Layer after layer takes mean and deviation of a batch as its statistics, and gives them back as
    shift and scale; training then goes on as if the network had been normalised from the start.

    Args:
        network: A normalised network whose layers have trained weights; it is changed.
        images: What its statistics are taken from.
    """

    def begin(norm: nn.Module, inputs: tuple[Tensor, ...]) -> None:
        assert isinstance(norm, nn.BatchNorm2d)
        var, mean = torch.var_mean(inputs[0].float(), (0, 2, 3), correction=0)
        statistics = {"running_mean": mean, "running_var": var}
        scales = {"weight": torch.sqrt(var + norm.eps), "bias": mean}
        norm.load_state_dict(statistics | scales, strict=False)

    norms = [module for module in network.modules() if isinstance(module, nn.BatchNorm2d)]
    hooks = [norm.register_forward_pre_hook(begin) for norm in norms]
    trains = network.training
    with torch.no_grad():
        network.eval()(images)
    network.train(trains)
    for hook in hooks:
        hook.remove()


class TorchOperations:
    """The diagram's operations on torch tensors, with a network's weights."""

    def __init__(self, network: nn.Module):
        """Use the layers of this network."""
        self._layers = dict(network.named_children())

    def conv(self, name: str, x: Tensor, width: int, relu: bool = True, reach: int = 1) -> Tensor:
        """See `Operations`."""
        out = self._normalised(name, self._layers[name](x))
        return F.relu(out) if relu else out

    def pool(self, x: Tensor) -> Tensor:
        """See `Operations`."""
        return F.max_pool2d(x, 2)

    def deconv(self, name: str, x: Tensor, width: int, like: Tensor, kernel: int = 4) -> Tensor:
        """See `Operations`."""
        return self._normalised(name, self._layers[name](x, output_size=like.shape[-2:]))

    def join(self, a: Tensor, b: Tensor) -> Tensor:
        """See `Operations`."""
        return torch.cat([a, b], dim=1)

    def add(self, name: str, a: Tensor, b: Tensor) -> Tensor:
        """See `Operations`."""
        return F.relu(a + b)

    def _normalised(self, name: str, x: Tensor) -> Tensor:
        norm = self._layers.get(name + NORM)
        return x if norm is None else norm(x)


def _module(layer: Layer, generator: torch.Generator | None) -> nn.Module:
    """A layer with weights of variance gain^2 / fan-in and no bias.

    An output pixel of a deconvolution sees kernel^2 / 4 inputs, since the stride is 2.
    """
    module: nn.Conv2d | nn.ConvTranspose2d
    if layer.kind == "conv":
        pad = layer.kernel // 2 * layer.reach
        module = nn.Conv2d(
            layer.inputs, layer.outputs, layer.kernel, padding=pad, dilation=layer.reach
        )
        fan_in = layer.inputs * layer.kernel**2
    else:
        crop = (layer.kernel - 2) // 2
        module = nn.ConvTranspose2d(layer.inputs, layer.outputs, layer.kernel, 2, crop)
        fan_in = layer.inputs * layer.kernel**2 // 4
    gain = HEAD_GAIN if layer.name == HEAD else math.sqrt(2.0) if layer.relu else 1.0
    nn.init.normal_(module.weight, std=gain / math.sqrt(fan_in), generator=generator)
    assert module.bias is not None
    nn.init.zeros_(module.bias)
    return module
