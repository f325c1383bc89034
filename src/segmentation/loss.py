# SPDX-License-Identifier: Apache-2.0
"""The training loss: cross entropy with the background modifier [Wan19]."""

from __future__ import annotations

import torch
import torch.nn.functional as F
from jaxtyping import Bool, Float, Int
from torch import Tensor

from segmentation.labels import BACKGROUND, IGNORED


def segmentation_loss(
    logits: Float[Tensor, "b 7 h w"],
    labels: Int[Tensor, "b h w"],
    background_weight: float,
    counted: Bool[Tensor, "b h w"] | None = None,
) -> Float[Tensor, ""]:
    """Mean over the counted pixels of H + lambda M.

    H_i = -log p'_iy with y the true label; M_i = -log p'_i0 where that is background, else
    -log(1 - p'_i0). With log p' = logits - logsumexp(logits), log(1 - p'_0) is the logsumexp of the
    others' log p', so nothing overflows or takes the logarithm of a rounded zero.

    Args:
        logits: Network output, shape (B, 7, H, W); computed with in float32 or better.
        labels: True labels, shape (B, H, W); `IGNORED` takes a pixel out.
        background_weight: lambda, 0 or above.
        counted: Further restricts the pixels; None counts all that are not `IGNORED`.

    Returns:
        The loss, a scalar; 0 if no pixel counts.
    """
    log_p = F.log_softmax(logits.to(torch.promote_types(logits.dtype, torch.float32)), dim=1)
    labels = labels.long()
    counts = labels != IGNORED
    if counted is not None:
        counts = counts & counted
    target = labels.where(counts, BACKGROUND)
    H = F.nll_loss(log_p, target, reduction="none")  # (B, H, W)
    log_background = log_p[:, BACKGROUND]
    log_person = torch.logsumexp(log_p[:, BACKGROUND + 1 :], dim=1)
    M = -torch.where(target == BACKGROUND, log_background, log_person)  # (B, H, W)
    per_pixel = (H + background_weight * M) * counts
    return per_pixel.sum() / counts.sum().clamp(min=1)
