# SPDX-License-Identifier: Apache-2.0
import numpy as np

from kintrack.people import Somebody
from kintrack.whereabouts import (
    Whereabouts,
    WhereaboutsConfig,
    follow,
    mine,
    seek,
)

CONFIG = WhereaboutsConfig()
DT = 1.0 / 30.0


def body(x, y, area=0.4):
    """Somebody at a place of the floor."""
    parts = np.zeros(7)
    parts[2] = area
    return Somebody(np.zeros((2, 2), bool), np.array([x, y, 1.0]), float(np.hypot(x, y)), parts)


def watch(frames, where=None, start_s=0.0):
    """Follow the first of the people of each frame."""
    where = Whereabouts() if where is None else where
    for n, people in enumerate(frames):
        where = follow(where, people[0], tuple(people), start_s + n * DT, CONFIG)
    return where


def test_at_first_whoever_is_nearest_is_sought():
    near, far = body(2, 0), body(4, 0)
    _, found = seek(Whereabouts(), (far, near), 0.0, CONFIG)
    assert found is near
    assert seek(Whereabouts(), (), 0.0, CONFIG)[1] is None


def test_the_person_stays_himself_while_another_crosses_behind_him():
    where = Whereabouts()
    for n in range(60):
        own, other = body(2.0, 0.0), body(3.0, 1.5 - 0.05 * n)
        people = (other, own)
        who = own if n == 0 else mine(where, people, n * DT, CONFIG)
        assert who is own
        where = follow(where, who, people, n * DT, CONFIG)
    assert len(where.others) == 1


def test_while_the_lost_one_may_be_hidden_nobody_who_was_seen_beside_him_is_taken():
    where = watch([(body(2, 0), body(3, 0.8))] * 10)
    t = 10 * DT
    for n in range(60):
        where, found = seek(where, (body(3, 0.8 - 0.01 * n),), t + n * DT, CONFIG)
        assert found is None


def test_he_is_found_again_where_he_was_lost_though_the_other_stands_by():
    where = watch([(body(2, 0), body(3, 0.8))] * 10)
    t, other, back = 10 * DT, body(3, 0.7), body(2.1, 0.1)
    for n in range(60):
        where, found = seek(where, (other,), t + n * DT, CONFIG)
    where, found = seek(where, (other, back), t + 60 * DT, CONFIG)
    assert found is back


def test_after_two_seconds_away_he_is_found_a_step_further():
    where = watch([(body(2, 0),)] * 10)
    for n in range(60):
        where, found = seek(where, (), 1 / 3 + n * DT, CONFIG)
        assert found is None
    _, found = seek(where, (body(2.5, 1.2),), 1 / 3 + 2.0, CONFIG)
    assert found is not None


def test_a_stranger_far_from_where_he_was_lost_is_taken_only_after_the_wait():
    where = watch([(body(2, 0),)] * 10)
    stranger = (body(5, 3),)
    where, found = seek(where, stranger, 1.0, CONFIG)
    assert found is None
    where, found = seek(where, stranger, 1.0 + CONFIG.hold_s, CONFIG)
    assert found is stranger[0]


def test_after_the_wait_the_one_nearest_to_the_last_place_is_taken():
    where = watch([(body(2, 0),)] * 3)
    near, far = body(3, 0), body(2, 3)
    _, found = seek(where, (far, near, body(2, 0.1, area=0.05)), 20.0, CONFIG)
    assert found is near


def test_somebody_who_walks_is_expected_further_on():
    where = watch([(body(2.0, 0.05 * n),) for n in range(20)])
    expected = where.own.expected(where.own.seen_s + 0.4, CONFIG.carry_s)
    assert 1.3 < expected[1] < 1.6
    assert np.allclose(where.own.expected(100.0, CONFIG.carry_s)[0], 2.0)


def test_others_who_left_are_forgotten():
    where = watch([(body(2, 0), body(3, 1))] * 3)
    assert len(where.others) == 1
    where = watch([(body(2, 0),)] * 3, where, start_s=CONFIG.forget_s + 1.0)
    assert where.others == ()


def test_a_piece_of_him_that_looked_like_somebody_for_a_moment_does_not_take_his_place():
    where = watch([(body(2, 0),)] * 10)
    where = follow(where, None, (body(2.3, 0.3, area=0.06),), 10 * DT, CONFIG)
    assert len(where.others) == 1
    for n in range(60):
        where, _ = seek(where, (), (11 + n) * DT, CONFIG)
    back = body(2.1, 0.1)
    where, found = seek(where, (back,), 71 * DT, CONFIG)
    assert found is back


def test_somebody_is_known_once_he_was_seen_for_some_frames():
    for frames, taken in ((CONFIG.known_frames - 1, True), (CONFIG.known_frames, False)):
        where = watch([(body(2, 0), body(2.3, 0.5))] * frames)
        _, found = seek(where, (body(2.3, 0.5),), (frames + 5) * DT, CONFIG)
        assert (found is not None) == taken
