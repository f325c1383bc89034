# SPDX-License-Identifier: Apache-2.0
import json

import numpy as np
import pytest

from kintrack.bench.cases import ABSENT, HIDDEN, Case
from kintrack.bench.gaps import Gap, empty_room, gap_of
from kintrack.errors import SceneError
from kintrack.joints import JOINT_NAMES
from kintrack.sequence import open_sequence
from kintrack.sequence.occlusion import read_occlusion
from kintrack.sequence.reference import read_reference_joints
from kintrack.sequence.write import SequenceWriter

from .small_bench import CAMERA, figure

FRAMES, RATE_HZ = 16, 4.0


@pytest.fixture(scope="module")
def clean(tmp_path_factory):
    """A figure that walks to the right before a wall at 4 m."""
    folder = tmp_path_factory.mktemp("gaps") / "clean"
    writer = SequenceWriter(folder, CAMERA)
    for n in range(FRAMES):
        depth, color, labels = figure(3 * n)
        joints = np.full((len(JOINT_NAMES), 3), [0.0, 0.0, 2.65])
        writer.write(n / RATE_HZ, depth, color=color, labels=labels, joint_positions_m=joints,
                     hidden_share=0.0)  # fmt: skip
    return Case("room", "boxes", "clean", folder)


def made(clean, condition, folder):
    case = Case("room", "boxes", condition, folder)
    gap = Gap(case, clean, 0)
    counted = []
    gap.run(lambda: counted.append(1))
    assert gap.is_made() and len(counted) == FRAMES
    return open_sequence(folder)


def test_a_gap_is_two_seconds_long_and_has_frames_on_both_sides(clean):
    gap = gap_of(open_sequence(clean.sequence))
    assert gap == range(4, 12)


def test_a_recording_too_short_for_a_gap_is_named(tmp_path):
    writer = SequenceWriter(tmp_path / "short", CAMERA)
    for n in range(3):
        depth, _, labels = figure()
        writer.write(n / 30, depth, labels=labels)
    with pytest.raises(SceneError, match="short: 3 frames are too few"):
        gap_of(open_sequence(tmp_path / "short"))


def test_who_is_gone_leaves_the_room_as_it_is_behind_him(clean, tmp_path):
    sequence = made(clean, ABSENT, tmp_path / "absent")
    for n in (4, 11):
        frame = sequence.frame(n)
        assert not frame.labels.any()
        # what the figure covers in every frame is filled in
        assert frame.depth_m.min() == pytest.approx(4.0, abs=2e-3)
    for n in (3, 12):
        assert np.array_equal(
            sequence.frame(n).depth_m, open_sequence(clean.sequence).frame(n).depth_m
        )
    _, joints = read_reference_joints(tmp_path / "absent" / "reference_joints.csv")
    known = np.isfinite(joints).all(axis=(1, 2))
    assert known.tolist() == [n < 4 or n >= 12 for n in range(FRAMES)]


def test_who_is_hidden_is_so_from_head_to_foot_and_is_still_there(clean, tmp_path):
    sequence = made(clean, HIDDEN, tmp_path / "hidden")
    whole = open_sequence(clean.sequence)
    for n in (4, 11):
        person = whole.frame(n).labels > 0
        frame = sequence.frame(n)
        assert not frame.labels.any()
        read = frame.depth_m[person & (frame.depth_m > 0)]
        assert read.size > 0.9 * person.sum() and 2.2 < read.min() and read.max() < 2.6
    shares, hidden = read_occlusion(tmp_path / "hidden" / "occlusion.csv")
    assert shares[4:12].tolist() == [1.0] * 8 and hidden[4:12].all()
    assert not hidden[:4].any() and not hidden[12:].any()
    _, joints = read_reference_joints(tmp_path / "hidden" / "reference_joints.csv")
    assert np.isfinite(joints).all()


def test_a_gap_is_made_again_when_its_recording_changes(clean, tmp_path):
    made(clean, ABSENT, tmp_path / "absent")
    gap = Gap(Case("room", "boxes", ABSENT, tmp_path / "absent"), clean, 0)
    assert gap.is_made() and not Gap(gap.case, clean, 1).is_made()
    (clean.sequence / "take.json").write_text(json.dumps({"T_world_camera": np.eye(4).tolist()}))
    assert not gap.is_made()
    (clean.sequence / "take.json").unlink()


def test_behind_the_person_lies_what_other_frames_show_or_what_lies_around(clean):
    depth, color = empty_room(open_sequence(clean.sequence))
    assert np.abs(depth - 4.0).max() < 1e-3
    assert np.abs(color.astype(int) - [0, 10, 20]).max() <= 12
