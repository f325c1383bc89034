# SPDX-License-Identifier: Apache-2.0
"""Muon against its definition and against torch's own, and what is left to AdamW."""

import pytest
import torch

from segmentation.muon import Muon, orthogonal


@pytest.mark.parametrize("shape", [(24, 60), (60, 24), (16, 16)])
def test_singular_values_are_made_equal_and_their_vectors_stay(shape):
    matrix = torch.randn(*shape, generator=torch.Generator().manual_seed(3))
    u, values, v = torch.linalg.svd(matrix, full_matrices=False)
    # The quintic leaves them between 0.68 and 1.14 where they were not almost 0.
    assert values.min() > 0.01 * values.norm()
    found = u.T @ orthogonal(matrix) @ v.T
    assert 0.65 < found.diagonal().min() < found.diagonal().max() < 1.2
    assert (found - found.diagonal().diag()).abs().max() < 1e-3


def test_steps_are_those_of_torch_and_of_adamw():
    generator = torch.Generator().manual_seed(0)
    weight, bias = (
        torch.randn(12, 8, 3, 3, generator=generator),
        torch.randn(12, generator=generator),
    )
    ours = [torch.nn.Parameter(weight.clone()), torch.nn.Parameter(bias.clone())]
    matrix, vector = torch.nn.Parameter(weight.flatten(1).clone()), torch.nn.Parameter(bias.clone())
    both = Muon(ours, 0.01, weight_decay=0.1, dtype=torch.bfloat16)
    muon = torch.optim.Muon([matrix], 0.01, 0.1, adjust_lr_fn="match_rms_adamw")
    adamw = torch.optim.AdamW([vector], 0.01, weight_decay=0.1)
    for _ in range(3):
        ours[0].grad = torch.randn(12, 8, 3, 3, generator=generator)
        ours[1].grad = torch.randn(12, generator=generator)
        matrix.grad, vector.grad = ours[0].grad.flatten(1), ours[1].grad.clone()
        for optimiser in (both, muon, adamw):
            optimiser.step()
    torch.testing.assert_close(ours[1], vector)
    # Rounding to bfloat16 in another order is all that may differ: 0.018 (0.042 with RMS 0.21).
    moved, beside = matrix - weight.flatten(1), ours[0].flatten(1) - matrix
    assert beside.norm() < 0.025 * moved.norm()


def test_layers_of_few_channels_are_left_to_adamw():
    narrow = torch.nn.Parameter(torch.ones(32, 4, 3, 3))
    optimiser = Muon([narrow], 0.01)
    narrow.grad = torch.full_like(narrow, 5.0)
    optimiser.step()
    torch.testing.assert_close(narrow.detach(), torch.full_like(narrow, 0.99))
