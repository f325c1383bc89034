# SPDX-License-Identifier: Apache-2.0
"""The loss against the formula as METHOD.md 3 writes it."""

import pytest

torch = pytest.importorskip("torch")

from segmentation.labels import IGNORED  # noqa: E402
from segmentation.loss import segmentation_loss  # noqa: E402


def plain_loss(logits, labels, background_weight):
    """(1 / n_p) sum (H + lambda M), literally, in the given precision."""
    p = torch.softmax(logits, dim=1)
    true = torch.nn.functional.one_hot(labels, 7).movedim(-1, 1)
    H = -(true * torch.log(p)).sum(dim=1)
    M = torch.where(labels == 0, -torch.log(p[:, 0]), -torch.log(1 - p[:, 0]))
    return (H + background_weight * M).mean()


def example(spread=2.0):
    generator = torch.Generator().manual_seed(0)
    logits = spread * torch.randn(2, 7, 5, 6, dtype=torch.float64, generator=generator)
    return logits.requires_grad_(), torch.randint(0, 7, (2, 5, 6), generator=generator)


@pytest.mark.parametrize("background_weight", [0.0, 0.7, 3.0])
def test_value_and_gradient_are_those_of_the_plain_formula(background_weight):
    logits, labels = example()
    expected = plain_loss(logits, labels, background_weight)
    (expected_slope,) = torch.autograd.grad(expected, logits)
    loss = segmentation_loss(logits, labels, background_weight)
    (slope,) = torch.autograd.grad(loss, logits)
    assert loss.item() == pytest.approx(expected.item(), rel=1e-12)
    assert torch.allclose(slope, expected_slope, rtol=1e-10, atol=1e-14)


def test_the_gradient_is_that_of_finite_differences():
    logits, labels = example()
    labels = labels[:, :2, :2]
    few = logits.detach()[:, :, :2, :2].clone().requires_grad_()
    assert torch.autograd.gradcheck(lambda x: segmentation_loss(x, labels, 1.3), few)


def test_without_the_modifier_it_is_the_cross_entropy():
    logits, labels = example()
    cross_entropy = torch.nn.functional.cross_entropy(logits, labels)
    assert segmentation_loss(logits, labels, 0.0).item() == pytest.approx(cross_entropy.item())


@pytest.mark.parametrize("dtype", [torch.float32, torch.bfloat16])
@pytest.mark.parametrize("label", [0, 2])
@pytest.mark.parametrize("certain", [0, 2])
def test_certainty_of_right_or_wrong_stays_finite(dtype, label, certain):
    logits = torch.full((1, 7, 2, 2), -100.0, dtype=dtype)
    logits[:, certain] = 100.0
    logits.requires_grad_()
    loss = segmentation_loss(logits, torch.full((1, 2, 2), label), 1.0)
    loss.backward()
    assert torch.isfinite(logits.grad).all()
    assert loss.item() == pytest.approx(0.0 if label == certain else 400.0, abs=5.0)
    assert (logits.grad[:, label] < 0).all() == (label != certain)


def test_confusing_two_parts_costs_less_than_losing_the_person():
    labels = torch.full((1, 2, 2), 3)
    other_part, background = torch.zeros(2, 1, 7, 2, 2)
    other_part[:, 4] = background[:, 0] = 8.0
    costs = [segmentation_loss(x, labels, 1.0).item() for x in (other_part, background)]
    assert costs[0] < costs[1] - 5


def test_pixels_to_ignore_change_neither_value_nor_gradient():
    logits, labels = example()
    marked = labels.clone()
    marked[:, 0] = IGNORED
    loss = segmentation_loss(logits, marked, 1.0)
    (slope,) = torch.autograd.grad(loss, logits)
    assert loss.item() == pytest.approx(
        segmentation_loss(logits[:, :, 1:], labels[:, 1:], 1.0).item()
    )
    assert (slope[:, :, 0] == 0).all() and (slope[:, :, 1:] != 0).any()


def test_a_mask_does_what_ignored_labels_do():
    logits, labels = example()
    counted = torch.ones_like(labels, dtype=torch.bool)
    counted[:, 0] = False
    marked = labels.where(counted, IGNORED)
    masked = segmentation_loss(logits, labels, 1.0, counted)
    assert masked.item() == segmentation_loss(logits, marked, 1.0).item()


def test_labels_of_bytes_do_as_well():
    logits, labels = example()
    loss = segmentation_loss(logits, labels.to(torch.uint8), 1.0)
    assert loss.item() == segmentation_loss(logits, labels, 1.0).item()


def test_a_batch_without_a_pixel_that_counts_costs_nothing():
    logits, labels = example()
    loss = segmentation_loss(logits, torch.full_like(labels, IGNORED), 1.0)
    loss.backward()
    assert loss.item() == 0.0 and (logits.grad == 0).all()
