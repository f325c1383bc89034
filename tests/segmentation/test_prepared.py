# SPDX-License-Identifier: Apache-2.0
"""Samples that are prepared once."""

from dataclasses import replace

import numpy as np
import pytest
from training_data import record, squares

import segmentation.prepared as module
from segmentation.augment.bank import BankConfig
from segmentation.augment.sample import AugmentConfig, Bank
from segmentation.dataset import Batches, everything
from segmentation.errors import SegmentationError
from segmentation.labels import MIRRORED
from segmentation.pack import pack
from segmentation.prepared import PreparedBatches, prepare

BANK, DRAWN, AUGMENT = Bank(squares()), BankConfig(), AugmentConfig()


@pytest.fixture(scope="module")
def pictures(tmp_path_factory):
    root = tmp_path_factory.mktemp("prepared")
    for n in range(2):
        record(root / f"r{n}", frames=3, seed=n)
    pack(root, root / ".pack")
    return everything([root / ".pack"])


@pytest.fixture(autouse=True)
def small_chunks(monkeypatch):
    """Chunks of eight, written in this process."""
    monkeypatch.setattr(module, "CHUNK", 8)
    monkeypatch.setattr(module, "ProcessPoolExecutor", Here)


class Here:
    def __init__(self, workers, context, initializer, initargs):
        initializer(*initargs)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        pass

    def map(self, function, jobs):
        return map(function, jobs)

    def shutdown(self, cancel_futures=False):
        pass


def test_prepared_samples_are_those_that_training_would_make(pictures, tmp_path):
    samples = prepare(tmp_path, pictures, AUGMENT, BANK, DRAWN, 12, 5)
    assert len(samples) == 16
    images, labels = Batches(pictures, AUGMENT, BANK, 8, 5)[1]
    for n in range(8):
        image, label = samples.sample(8 + n)
        assert (label == labels[n]).all()
        np.testing.assert_allclose(image, images[n], atol=3e-3)


def test_a_stopped_preparation_goes_on_and_ends_the_same(pictures, tmp_path):
    whole = prepare(tmp_path / "whole", pictures, AUGMENT, BANK, DRAWN, 24, 5)
    files = sorted(whole.folder.iterdir())
    part = prepare(tmp_path / "part", pictures, AUGMENT, BANK, DRAWN, 8, 5)
    done: list[int] = []
    prepare(tmp_path / "part", pictures, AUGMENT, BANK, DRAWN, 24, 5,
            on_progress=lambda n, total: done.append(n))  # fmt: skip
    assert done == [16, 24]
    again = sorted(part.folder.iterdir())
    assert [p.read_bytes() for p in again] == [p.read_bytes() for p in files]


def test_other_changes_and_other_seeds_have_folders_of_their_own(pictures, tmp_path):
    folders = {
        prepare(tmp_path, pictures, augment, BANK, DRAWN, 8, seed).folder
        for augment, seed in ((AUGMENT, 0), (AUGMENT, 1), (replace(AUGMENT, inserted=0.0), 0))
    }
    assert len(folders) == 3


def test_an_epoch_shows_every_sample_once_some_of_them_mirrored(pictures, tmp_path):
    samples = prepare(tmp_path, pictures, AUGMENT, BANK, DRAWN, 16, 5)
    batches = PreparedBatches(samples, 4, seed=2)
    swapped = np.append(MIRRORED, np.arange(len(MIRRORED), 256, dtype=np.uint8))
    plain = {samples.sample(n)[0].tobytes(): n for n in range(16)}
    mirrored = {samples.sample(n)[0][:, :, ::-1].tobytes(): n for n in range(16)}
    seen, turned = [], 0
    for step in range(4):
        for image, labels in zip(*batches[step], strict=True):
            as_is = plain.get(image.tobytes())
            n = mirrored[image.tobytes()] if as_is is None else as_is
            own = samples.sample(n)[1]
            assert (labels == (own if as_is is not None else swapped[own[:, ::-1]])).all()
            turned += as_is is None
            seen.append(n)
    assert sorted(seen) == list(range(16)) and 0 < turned < 16


def test_a_batch_depends_on_its_number_alone(pictures, tmp_path):
    samples = prepare(tmp_path, pictures, AUGMENT, BANK, DRAWN, 16, 5)
    one, other = PreparedBatches(samples, 4, 2), PreparedBatches(samples, 4, 2)
    for step in (5, 1, 3):
        other[step]
    assert all((a == b).all() for a, b in zip(one[3], other[3], strict=True))


def test_a_place_that_cannot_be_written_is_named(pictures, tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(SegmentationError, match="cannot be prepared there"):
        prepare(tmp_path / "file", pictures, AUGMENT, BANK, DRAWN, 8, 5)
