# SPDX-License-Identifier: Apache-2.0
"""Muon: momentum whose singular values are made equal (Jordan et al. 2024, "Muon").

Adam scales every entry of a layer's gradient by itself; Muon turns the whole matrix into the
nearest one with orthogonal rows, so that rare directions are learnt as fast as common ones. What is
no such matrix (biases, normalisations, layers of few channels) is left to AdamW. Steps are scaled
as Liu et al. 2025 ("Muon is scalable for LLM training") do, so that both take one learning rate.
"""

from __future__ import annotations

from collections.abc import Iterable

import torch
from jaxtyping import Float
from torch import Tensor

COEFFICIENTS = (3.4445, -4.7750, 2.0315)
"""Of the quintic a x + b x^3 + c x^5, which drives singular values of 0 to 1 towards 1."""
ITERATIONS = 5
MIN_CHANNELS = 8
"""Layers with fewer inputs or outputs are no matrix worth the name."""
RMS = 0.2
"""Root mean square of a step's entries, in learning rates: what Adam's usually is."""


class Muon(torch.optim.Optimizer):
    """Muon for the weights of convolutions, AdamW for everything else."""

    def __init__(
        self,
        params: Iterable[Tensor],
        lr: float,
        weight_decay: float = 0.0,
        momentum: float = 0.95,
        betas: tuple[float, float] = (0.9, 0.999),
        eps: float = 1e-8,
        dtype: torch.dtype = torch.float32,
    ):
        """Take charge of parameters.

        Args:
            params: Weights (outputs, inputs, k, k), or inputs first where a layer is transposed,
                and vectors.
            lr: Learning rate.
            weight_decay: Decay times the learning rate, per step.
            momentum: Decay of Muon's mean gradient.
            betas: Decays of AdamW's moments.
            eps: Added to AdamW's root.
            dtype: What matrices are multiplied in.
        """
        defaults = {"lr": lr, "weight_decay": weight_decay, "momentum": momentum, "betas": betas,
                    "eps": eps}  # fmt: skip
        super().__init__(params, defaults)
        self._dtype = dtype

    @torch.no_grad()
    def step(self, closure: None = None) -> None:  # type: ignore[override]
        """Move every parameter that has a gradient."""
        for group in self.param_groups:
            for parameter in group["params"]:
                if parameter.grad is None:
                    continue
                parameter.mul_(1.0 - group["lr"] * group["weight_decay"])
                move = self._muon if is_matrix(parameter) else self._adamw
                parameter.add_(move(parameter, group), alpha=-group["lr"])

    def _muon(self, parameter: Tensor, group: dict) -> Tensor:
        state, gradient = self.state[parameter], parameter.grad
        assert gradient is not None
        if not state:
            state["exp_avg"] = torch.zeros_like(parameter)
        state["exp_avg"].lerp_(gradient, 1.0 - group["momentum"])
        ahead = gradient.lerp(state["exp_avg"], group["momentum"]).flatten(1)
        return (RMS * max(ahead.shape) ** 0.5 * orthogonal(ahead, self._dtype)).view_as(gradient)

    def _adamw(self, parameter: Tensor, group: dict) -> Tensor:
        state, gradient, (decay1, decay2) = self.state[parameter], parameter.grad, group["betas"]
        assert gradient is not None
        if not state:
            state["step"] = torch.zeros(())
            state["exp_avg"] = torch.zeros_like(parameter)
            state["exp_avg_sq"] = torch.zeros_like(parameter)
        state["step"] += 1
        state["exp_avg"].lerp_(gradient, 1.0 - decay1)
        state["exp_avg_sq"].lerp_(gradient.square(), 1.0 - decay2)
        steps = float(state["step"])
        mean = state["exp_avg"] / (1.0 - decay1**steps)
        square = state["exp_avg_sq"] / (1.0 - decay2**steps)
        return mean / (square.sqrt() + group["eps"])


def is_matrix(parameter: Tensor) -> bool:
    """Whether Muon moves a parameter."""
    return parameter.ndim == 4 and min(parameter.shape[:2]) >= MIN_CHANNELS


def orthogonal(
    matrix: Float[Tensor, "m n"], dtype: torch.dtype = torch.float32
) -> Float[Tensor, "m n"]:
    """A matrix with the same singular vectors whose singular values are all near 1.

    Args:
        matrix: Any.
        dtype: What is computed in; bfloat16 is enough for an optimiser.

    Returns:
        The matrix after `ITERATIONS` steps of a quintic Newton-Schulz iteration.
    """
    a, b, c = COEFFICIENTS
    tall = matrix.shape[0] > matrix.shape[1]
    x = (matrix.T if tall else matrix).to(dtype)
    x = x / (x.norm() + 1e-7)
    for _ in range(ITERATIONS):
        square = x @ x.T
        x = a * x + (b * square + c * square @ square) @ x
    return (x.T if tall else x).to(matrix.dtype)
