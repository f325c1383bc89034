# SPDX-License-Identifier: Apache-2.0
import cv2
import numpy as np
import pytest

from kintrack.bench.segmentation.cases import CLEAN, COMPOSITES, TEST, Case
from kintrack.bench.segmentation.judging import judge
from kintrack.bench.segmentation.samples import DEPTH, RGBD, samples
from kintrack.bench.segmentation.summary import Judged, summary
from kintrack.errors import DatasetError

from .small_bench import figure, network_labels, oracle, record, witnessed


def case_of(folder, group=TEST, bare=None):
    return Case(group, folder.name, CLEAN, folder, bare)


def judged(case, network, tmp_path, digest="code"):
    return judge(case, [network], tmp_path / "judged", digest)


def scores(case, found, modality=RGBD):
    rows = [Judged(case, name, m, plain) for (name, m), plain in found.items()]
    return summary(rows)["labels"][case.group]["oracle"][modality][CLEAN]


@pytest.fixture
def recording(tmp_path):
    return case_of(record(tmp_path / "boxes"))


def test_true_labels_score_full_marks_with_and_without_colour(recording, tmp_path):
    network = oracle([m for m in network_labels() for _ in range(2)])
    found = judged(recording, network, tmp_path)
    assert set(found) == {("oracle", RGBD), ("oracle", DEPTH)}
    for modality in (RGBD, DEPTH):
        one = scores(recording, found, modality)
        assert one["frames"] == 3 and one["non_background_iou"] == one["left_leg"] == 1.0
    shown, bare = network.segmenter.images[:2]
    assert shown[:3].any() and not bare[:3].any() and np.array_equal(shown[3], bare[3])


def test_swapped_arms_cost_the_arms_and_nothing_else(recording, tmp_path):
    swap = np.array([0, 1, 2, 4, 3, 5, 6], np.uint8)
    network = oracle([swap[m] for m in network_labels() for _ in range(2)])
    one = scores(recording, judged(recording, network, tmp_path))
    assert one["left_arm"] == one["right_arm"] == 0.0
    assert one["torso"] == one["person_iou"] == 1.0 and one["non_background_iou"] < 0.8


def test_what_was_judged_is_kept_until_weights_code_or_recording_change(recording, tmp_path):
    first = judged(recording, oracle(network_labels()), tmp_path)
    again = oracle(network_labels())
    assert judged(recording, again, tmp_path) == first and not again.segmenter.images
    other = oracle(network_labels(), digest="1" * 64)
    judged(recording, other, tmp_path)
    assert len(other.segmenter.images) == 6
    changed = oracle(network_labels())
    judged(recording, changed, tmp_path, digest="other code")
    assert len(changed.segmenter.images) == 6
    path = recording.sequence / "depth" / "000000.png"
    path.write_bytes(path.read_bytes() + b"\0")
    changed = oracle(network_labels())
    judged(recording, changed, tmp_path, digest="other code")
    assert len(changed.segmenter.images) == 6


def test_a_file_that_was_cut_off_is_judged_anew(recording, tmp_path):
    judged(recording, oracle(network_labels()), tmp_path)
    for path in (tmp_path / "judged").rglob("*.json"):
        path.write_text(path.read_text()[:50])
    again = oracle(network_labels())
    judged(recording, again, tmp_path)
    assert len(again.segmenter.images) == 6


def test_readings_that_nobody_labelled_count_only_where_they_are_said_to(tmp_path):
    bare = record(tmp_path / "bare", 1, colored=False, removed=True)
    depth, _, labels = figure()
    arms = np.isin(labels, (3, 4))
    cv2.imwrite(str(bare / "labels" / "000000.png"), np.where(arms, 0, labels))
    placed = record(tmp_path / "placed", 1, colored=False)
    cv2.imwrite(str(placed / "labels" / "000000.png"), np.where(arms, 0, labels))
    case = case_of(placed, COMPOSITES, bare)
    one = scores(case, judged(case, oracle(network_labels(1)), tmp_path), DEPTH)
    assert one["non_background_iou"] == 1.0 and one["left_arm"] is None
    assert 0.2 < one["unknown"] < 0.4
    assert one["strict_non_background_iou"] < 0.8


def test_a_mask_is_judged_by_any_part(tmp_path):
    folder = record(tmp_path / "turn", 1, labelled=False)
    (folder / "mask").mkdir()
    mask = (figure()[2] > 0).astype(np.uint8) * 255
    cv2.imwrite(str(folder / "mask" / "000000.png"), mask)
    labels = np.where(network_labels(1)[0] > 2, 1, 0).astype(np.uint8)
    case = case_of(folder, "uva_turn")
    rows = [Judged(case, *key, plain)
            for key, plain in judged(case, oracle([labels]), tmp_path).items()]  # fmt: skip
    found = summary(rows)["mask"]["uva_turn"]["oracle"][RGBD]
    person = network_labels(1)[0] > 0
    assert found["iou"] == pytest.approx((labels > 0).sum() / person.sum(), abs=1e-6)


def test_only_joints_that_the_witness_sees_are_asked_about(tmp_path):
    folder = record(tmp_path / "walk", 1, labelled=False)
    witnessed(folder, [(0, "l_wrist", 160, 80, 0.99), (0, "r_wrist", 90, 80, 0.5)])
    (sample,) = samples(case_of(folder, "sofa"))
    assert set(sample.joints) == {"l_wrist"}


def test_a_recording_without_anything_to_judge_by_is_named(tmp_path):
    case = case_of(record(tmp_path / "plain", 2, labelled=False))
    with pytest.raises(DatasetError, match="plain: none of its frames"):
        judged(case, oracle(network_labels()), tmp_path)


def test_labels_beyond_the_known_ones_make_a_frame_unusable(tmp_path):
    folder = record(tmp_path / "wrong", 2)
    for path in (folder / "labels").glob("*.png"):
        cv2.imwrite(str(path), np.full((212, 256), 9, np.uint8))
    with pytest.raises(DatasetError, match="wrong: none of its frames"):
        judged(case_of(folder), oracle(network_labels()), tmp_path)
