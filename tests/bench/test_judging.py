# SPDX-License-Identifier: Apache-2.0
import cv2
import numpy as np
import pytest

from kintrack.bench.cases import CLEAN
from kintrack.bench.segmentation.cases import COMPOSITES, TEST, Case
from kintrack.bench.segmentation.judging import judge
from kintrack.bench.segmentation.samples import (
    DEPTH_ONCE,
    MODALITIES,
    RGBD,
    RGBD_ONCE,
    samples,
)
from kintrack.bench.segmentation.summary import Judged, summary
from kintrack.errors import DatasetError
from segmentation.labels import IGNORED
from segmentation.preprocess import labels_to_network

from .small_bench import figure, oracle, record, witnessed

CALLS = 3 * (2 + 1 + 2 + 1)
"""Frames, times the looks of every modality."""


def case_of(folder, group=TEST, bare=None):
    return Case(group, folder.name, CLEAN, folder, bare)


def judged(case, network, tmp_path, digest="code"):
    return judge(case, [network], tmp_path / "judged", digest)


def scores(case, found, modality=RGBD):
    rows = [Judged(case, name, m, plain) for (name, m), plain in found.items()]
    return summary(rows)["labels"][case.group]["oracle"][modality][CLEAN]


@pytest.fixture(autouse=True)
def level(monkeypatch):
    """No relief, so that the oracle knows every part by its depth."""
    monkeypatch.setattr(
        "segmentation.preprocess.add_relief", lambda plane, farthest, out: np.copyto(out, plane)
    )


@pytest.fixture
def recording(tmp_path):
    return case_of(record(tmp_path / "boxes"))


def test_true_labels_score_full_marks_with_and_without_colour(recording, tmp_path):
    network = oracle()
    found = judged(recording, network, tmp_path)
    assert set(found) == {("oracle", modality) for modality in MODALITIES}
    for modality in MODALITIES:
        one = scores(recording, found, modality)
        assert one["frames"] == 3 and one["non_background_iou"] > 0.94 and one["left_leg"] > 0.88
    whole, closer, once, bare = network.segmenter.images[:4]
    assert np.array_equal(whole, once) and not np.array_equal(whole[3], closer[3])
    assert whole[:3].any() and not bare[:3].any() and np.array_equal(whole[3], bare[3])


def test_who_knows_what_every_cell_shows_errs_at_pixels_of_its_outline_alone(recording, tmp_path):
    found = judged(recording, oracle(), tmp_path)
    for modality in (RGBD, RGBD_ONCE):
        one = scores(recording, found, modality)
        assert one["non_background_iou"] > 0.98
        assert 0.94 < one["of_pixels"]["non_background_iou"] < 1.0


def test_pixels_without_a_reading_are_of_no_use_to_a_tracker_and_not_judged_there(tmp_path):
    case = case_of(record(tmp_path / "bare", removed=True))
    read = [sample.frame.depth_m > 0 for sample in samples(case)]
    assert not np.all(read)
    (sample,) = samples(case, [0])
    assert np.array_equal(sample.truth_of_pixels != IGNORED, read[0])
    counts = judged(case, oracle(), tmp_path)["oracle", RGBD]["counts_of_pixels"]
    assert np.sum(counts) == np.sum(read)


def test_swapped_arms_cost_the_arms_and_nothing_else(recording, tmp_path):
    found = judged(recording, oracle([0, 1, 2, 4, 3, 5, 6]), tmp_path)
    one = scores(recording, found, RGBD_ONCE)
    assert one["left_arm"] == one["right_arm"] == 0.0
    assert one["torso"] > 0.9 and one["person_iou"] > 0.94 and one["non_background_iou"] < 0.8


def test_what_was_judged_is_kept_until_weights_code_or_recording_change(recording, tmp_path):
    first = judged(recording, oracle(), tmp_path)
    again = oracle()
    assert judged(recording, again, tmp_path) == first and not again.segmenter.images
    other = oracle(digest="1" * 64)
    judged(recording, other, tmp_path)
    assert len(other.segmenter.images) == CALLS
    changed = oracle()
    judged(recording, changed, tmp_path, digest="other code")
    assert len(changed.segmenter.images) == CALLS
    path = recording.sequence / "depth" / "000000.png"
    path.write_bytes(path.read_bytes() + b"\0")
    changed = oracle()
    judged(recording, changed, tmp_path, digest="other code")
    assert len(changed.segmenter.images) == CALLS


def test_a_file_that_was_cut_off_is_judged_anew(recording, tmp_path):
    judged(recording, oracle(), tmp_path)
    for path in (tmp_path / "judged").rglob("*.json"):
        path.write_text(path.read_text()[:50])
    again = oracle()
    judged(recording, again, tmp_path)
    assert len(again.segmenter.images) == CALLS


def test_readings_that_nobody_labelled_count_only_where_they_are_said_to(tmp_path):
    bare = record(tmp_path / "bare", 1, colored=False, removed=True)
    depth, _, labels = figure()
    arms = np.isin(labels, (3, 4))
    cv2.imwrite(str(bare / "labels" / "000000.png"), np.where(arms, 0, labels))
    placed = record(tmp_path / "placed", 1, colored=False)
    cv2.imwrite(str(placed / "labels" / "000000.png"), np.where(arms, 0, labels))
    case = case_of(placed, COMPOSITES, bare)
    one = scores(case, judged(case, oracle(), tmp_path), DEPTH_ONCE)
    assert one["non_background_iou"] > 0.94 and one["left_arm"] is None
    assert 0.2 < one["unknown"] < 0.4
    assert one["strict_non_background_iou"] < 0.8


def test_a_mask_is_judged_by_any_part(tmp_path):
    folder = record(tmp_path / "turn", 1, labelled=False)
    (folder / "mask").mkdir()
    mask = (figure()[2] > 0).astype(np.uint8) * 255
    cv2.imwrite(str(folder / "mask" / "000000.png"), mask)
    case = case_of(folder, "uva_turn")
    found = judged(case, oracle([0, 0, 0, 1, 1, 1, 1]), tmp_path)
    rows = [Judged(case, *key, plain) for key, plain in found.items()]
    found = summary(rows)["mask"]["uva_turn"]["oracle"][RGBD_ONCE]
    truth = labels_to_network(figure()[2])
    limbs, person = (truth > 2) & (truth < 7), (truth > 0) & (truth < 7)
    assert found["iou"] == pytest.approx(limbs.sum() / person.sum(), abs=0.03)


def test_only_joints_that_the_witness_sees_are_asked_about(tmp_path):
    folder = record(tmp_path / "walk", 1, labelled=False)
    witnessed(folder, [(0, "l_wrist", 160, 80, 0.99), (0, "r_wrist", 90, 80, 0.5)])
    (sample,) = samples(case_of(folder, "sofa"))
    assert set(sample.joints) == {"l_wrist"}


def test_a_recording_without_anything_to_judge_by_is_named(tmp_path):
    case = case_of(record(tmp_path / "plain", 2, labelled=False))
    with pytest.raises(DatasetError, match="plain: none of its frames"):
        judged(case, oracle(), tmp_path)


def test_labels_beyond_the_known_ones_make_a_frame_unusable(tmp_path):
    folder = record(tmp_path / "wrong", 2)
    for path in (folder / "labels").glob("*.png"):
        cv2.imwrite(str(path), np.full((212, 256), 9, np.uint8))
    with pytest.raises(DatasetError, match="wrong: none of its frames"):
        judged(case_of(folder), oracle(), tmp_path)
