# SPDX-License-Identifier: Apache-2.0
from dataclasses import replace

import numpy as np
import pytest

from kintrack.errors import ConfigError
from kintrack.lifecycle import (
    GONE,
    HIDDEN,
    NOBODY,
    Life,
    LifecycleConfig,
    Limits,
    Reading,
    absent,
    judged,
    objection,
    unbegun,
)

CONFIG = LifecycleConfig()
GOOD = Reading(0.008, 0.95, 0.9, 0.9)
BETWEEN = Reading(0.028, 0.6, 0.35, 0.45)
"""Good enough to go on, not to begin."""
BAD = Reading(0.05, 0.95, 0.9, 0.9)


def run(life, *readings):
    for reading in readings:
        life = absent(life, CONFIG) if reading is None else judged(life, reading, CONFIG)
    return life


def test_it_begins_without_anybody():
    life = Life()
    assert (life.status, life.reason, life.tracks) == ("initialising", NOBODY, False)
    assert run(life, *[None] * 100) == life


def test_one_good_frame_begins_a_track_and_clears_the_reason():
    life = run(Life(), None, GOOD)
    assert (life.status, life.reason, life.good) == ("tracking", None, 1)


def test_to_begin_takes_a_better_frame_than_to_go_on():
    assert not run(Life(), BETWEEN).tracks
    going = run(Life(), GOOD, *[BETWEEN] * 50)
    assert going.tracks and going.bad == 0


def test_single_bad_frames_are_forgiven_and_a_row_of_them_is_not():
    old = run(Life(), *[GOOD] * 20)
    assert run(old, *[BAD, GOOD] * 20).tracks
    assert run(old, *[BAD] * (CONFIG.patience - 1)).tracks
    lost = run(old, *[BAD] * CONFIG.patience)
    assert lost.status == "lost" and "50 mm" in lost.reason


def test_a_body_that_slid_behind_a_wall_fits_well_and_is_not_seen():
    behind = replace(GOOD, seen=0.02)
    assert objection(behind, CONFIG.stay) == objection(behind, CONFIG.begin) == HIDDEN
    assert objection(replace(GOOD, seen=0.1), CONFIG.begin) is None


def test_a_young_track_is_given_up_sooner():
    young = run(Life(), GOOD, GOOD)
    assert run(young, *[BAD] * CONFIG.young_patience).status == "lost"
    assert CONFIG.young_patience < CONFIG.patience


def test_nobody_in_view_ends_a_track_with_that_reason():
    life = run(Life(), *[GOOD] * 20, *[None] * CONFIG.patience)
    assert (life.status, life.reason) == ("lost", NOBODY)


def test_while_no_first_pose_is_tried_the_reason_is_who_is_missing_or_the_last_objection():
    rejected = run(Life(), BAD)
    assert unbegun(rejected, CONFIG, in_view=True).reason == rejected.reason != NOBODY
    assert unbegun(rejected, CONFIG, in_view=False).reason == NOBODY
    lost = run(Life(), *[GOOD] * 20, *[BAD] * CONFIG.patience)
    assert unbegun(lost, CONFIG, in_view=False).reason == GONE
    assert unbegun(lost, CONFIG, in_view=True).status == "lost"


def test_from_lost_a_good_frame_leads_back():
    lost = run(Life(), *[GOOD] * 20, *[None] * 60)
    assert run(lost, GOOD).tracks
    assert run(lost, BETWEEN).status == "lost"


def test_after_a_rejected_first_pose_some_frames_pass():
    life = run(Life(), BAD)
    assert not life.may_begin
    for _ in range(CONFIG.retry):
        assert not life.may_begin
        life = absent(life, CONFIG)
    assert life.may_begin


def test_what_is_rejected_again_and_again_is_tried_less_and_less_until_it_leaves():
    life, waits = Life(), []
    for _ in range(CONFIG.keen + 6):
        life = judged(life, BAD, CONFIG)
        waits.append(life.wait)
        life = replace(life, wait=0)
    assert waits[: CONFIG.keen] == [CONFIG.retry] * CONFIG.keen
    assert waits[CONFIG.keen : CONFIG.keen + 2] == [2 * CONFIG.retry, 4 * CONFIG.retry]
    assert waits[-1] == CONFIG.most_retry
    assert judged(unbegun(life, CONFIG, in_view=False), BAD, CONFIG).wait == CONFIG.retry


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"rms_m": float("nan")}, HIDDEN),
        ({"rms_m": 0.04}, "residual 40 mm; 25 are allowed"),
        ({"explained": 0.2}, "20% of the person's points"),
        ({"supported": 0.1}, "10% of the skin is seen"),
        ({"labels": 0.3}, "30% of the skin lies on pixels of its own part; 50%"),
        ({"labels": float("nan")}, "of its own part"),
    ],
)
def test_what_speaks_against_a_frame_is_said(change, says):
    assert says in objection(replace(GOOD, **change), CONFIG.begin)
    assert objection(GOOD, CONFIG.begin) is None


def test_the_same_readings_give_the_same_states():
    rng = np.random.default_rng(0)
    readings = [
        None if rng.random() < 0.2 else Reading(*rng.uniform([0, 0.3, 0.1, 0.2], [0.05, 1, 1, 1]))
        for _ in range(300)
    ]
    first, second = [Life()], [Life()]
    for reading in readings:
        first.append(run(first[-1], reading))
        second.append(run(second[-1], reading))
    assert first == second
    assert {life.status for life in first} == {"initialising", "tracking", "lost"}


def test_numbers_without_sense_are_refused():
    with pytest.raises(ConfigError, match="patience = 0"):
        LifecycleConfig(patience=0)
    with pytest.raises(ConfigError, match="min_labels = 1.5"):
        Limits(0.03, 0.5, 0.5, 1.5)
