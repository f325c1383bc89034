# SPDX-License-Identifier: Apache-2.0
import json
from dataclasses import replace

import numpy as np
import pytest

from kintrack.association.observation import Observation
from kintrack.body import run_kinematics
from kintrack.calibration.calibrator import Calibrator
from kintrack.calibration.config import CalibrationConfig
from kintrack.calibration.errors import CalibrationError
from kintrack.calibration.measures import height, limbs, measured
from kintrack.calibration.person import human_of, read_person, write_person
from kintrack.calibration.selection import spread, varied
from kintrack.geometry import T_LEVEL_WORLD_CAMERA, invert_rigid, transform_points
from kintrack.human import load_human
from kintrack.skin import skinned_vertices

from .people import POSES, scene_of

TALL = (0.9, -0.6, 0.5, 0.4)


def calibrated(scene, **options):
    calibrator = Calibrator(load_human(), **options)
    pairs = zip(scene.observations, scene.qs_template, strict=True)
    for n, (observation, q) in enumerate(pairs):
        calibrator.add(n, observation, q)
    return calibrator.result()


@pytest.fixture(scope="module")
def tall():
    return scene_of(TALL)


@pytest.fixture(scope="module")
def person(tall):
    return calibrated(tall)


def test_height_and_limbs_of_a_dressed_person_are_found(tall, person):
    assert person.problems == ()
    true_height = height(tall.shape)[0]
    assert abs(person.height.value_m - true_height) < 0.015
    assert abs(height(np.zeros(10))[0] - true_height) > 0.05  # where it began
    for name, (true_length, _) in limbs(tall.shape).items():
        assert abs(person.limbs[name].value_m / true_length - 1) < 0.04


def test_the_person_is_seen_where_she_is_once_she_is_known(tall, person):
    human = human_of(person)
    T = invert_rigid(T_LEVEL_WORLD_CAMERA)
    assert person.rms_m < 0.01
    worn = list(person.clothing_m.values())
    assert all(0.0 <= thickness <= 0.08 for thickness in worn)
    bare = human_of(person, dressed=False)
    state = run_kinematics(human.body, tall.qs_template[0])
    out = skinned_vertices(state, human.skin) - skinned_vertices(state, bare.skin)
    assert np.linalg.norm(out, axis=1).max() > 0.005
    assert np.isfinite(transform_points(T, out)).all()


def test_a_stated_height_is_met_and_makes_the_estimate_surer(tall, person):
    true_height = height(tall.shape)[0]
    told = calibrated(tall, stated_height_m=round(true_height, 2))
    assert abs(told.height.value_m - true_height) < 0.012
    assert told.height.sigma_m < person.height.sigma_m
    assert told.stated_height_m == round(true_height, 2)


def test_a_stated_height_that_the_frames_deny_is_named(tall):
    told = calibrated(tall, stated_height_m=1.5)
    assert told.is_template and not told.shape.any()
    assert "a stated height of 1.50 m, where the frames say 1.7" in " ".join(told.problems)


@pytest.mark.parametrize("stated_m", [0.5, 17.8, float("nan")])
def test_an_impossible_stated_height_is_refused_before_any_work(stated_m):
    with pytest.raises(CalibrationError, match=r"adults of 1.4 to 2.1 m"):
        Calibrator(load_human(), stated_height_m=stated_m)


def test_nobody_cannot_be_calibrated():
    with pytest.raises(CalibrationError, match="nobody was tracked"):
        Calibrator(load_human()).result()


def test_two_frames_are_too_few(tall):
    two = replace(tall, observations=tall.observations[:2], qs_template=tall.qs_template[:2])
    found = calibrated(two)
    assert found.is_template and "2 usable frames" in found.problems[0]
    assert "height 1." in found.describe() and "±" in found.describe()


def test_frames_that_are_all_alike_are_not_enough():
    same = scene_of(TALL, poses=POSES[:1] * 4, noise_rad=0.0)
    found = calibrated(same)
    assert found.is_template and "the frames differ by 0 mm" in found.problems[0]


def test_a_child_is_not_taken_for_an_adult():
    child = scene_of((-4.0, 0.0), worn_m=0.01)
    found = calibrated(child)
    assert found.is_template and "adults of 1.4 to 2.1 m" in " ".join(found.problems)
    assert not found.shape.any() and found.height.value_m < 1.4


def test_what_was_not_seen_raises_a_named_error(tall):
    empty = tall.observations[0]
    blind = Observation(empty.camera, np.zeros_like(empty.points_camera), empty.region & False)
    calibrator = Calibrator(load_human())
    calibrator.add(0, blind, tall.qs_template[0])
    with pytest.raises(CalibrationError, match="not where the track says"):
        calibrator.result()


def test_a_calibrator_keeps_the_frames_that_differ_most(tall):
    config = CalibrationConfig(frames=4, pool=6)
    calibrator = Calibrator(load_human(), config=config)
    for n in range(30):
        k = 0 if n < 24 else n % 6
        calibrator.add(n, tall.observations[k], tall.qs_template[k])
        assert len(calibrator.candidates) <= config.pool
        joints = np.stack([candidate.joints_m for candidate in calibrator.candidates])
        chosen = varied(joints, np.ones(len(joints)), config.frames)
        assert (spread(joints[chosen]) > 0.05) == (n >= 25)
    assert len({candidate.index for candidate in calibrator.candidates if candidate.index > 23}) > 2


def test_varied_frames_are_far_apart_and_well_seen():
    joints = np.zeros((5, 21, 3))
    joints[:, 8, 0] = [0.0, 0.01, 1.0, 2.0, 0.5]
    assert varied(joints, np.ones(5), 2).tolist() == [0, 3]
    assert varied(joints, np.array([1, 1, 1, 0.1, 1.0]), 2).tolist() == [0, 2]
    assert len(varied(joints, np.ones(5), 9)) == 5
    assert spread(joints[:1]) == 0.0
    assert spread(joints[[0, 3]]) == pytest.approx(2.0 / 21)


def test_measures_follow_their_gradients():
    b = np.random.default_rng(1).normal(size=10)
    step = 1e-5 * np.random.default_rng(2).normal(size=10)
    value, gradient = height(b)
    assert height(b + step)[0] - value == pytest.approx(gradient @ step, abs=1e-10)
    for name, (length, gradient) in limbs(b).items():
        assert limbs(b + step)[name][0] - length == pytest.approx(gradient @ step, abs=1e-8)
    tall, parts = measured(b, 0.01 * np.eye(10))
    assert tall.sigma_m == pytest.approx(0.1 * np.linalg.norm(height(b)[1]))
    assert parts["thigh"].value_m == limbs(b)["thigh"][0]


def test_a_person_comes_back_from_its_file(person, tmp_path):
    path = tmp_path / "person.json"
    write_person(person, path)
    again = read_person(path)
    assert np.array_equal(again.shape, person.shape)
    assert np.array_equal(again.covariance, person.covariance)
    assert replace(again, shape=person.shape, covariance=person.covariance) == person


@pytest.mark.parametrize(
    ("field", "value", "message"),
    [
        ("format", "person 0", "format is 'person 0'"),
        ("shape", [1.0], "1 coefficients, 10 are needed"),
        ("shape", [float("nan")] * 10, "finite numbers"),
        ("shape", [9.0] * 10, "-5 to 5 are allowed"),
        ("clothing_m", {}, "scalp"),
        ("height", [0.0, 0.1], "a positive value"),
    ],
)
def test_a_broken_file_is_named_with_its_field(person, tmp_path, field, value, message):
    path = tmp_path / "person.json"
    write_person(person, path)
    path.write_text(json.dumps(json.loads(path.read_text()) | {field: value}))
    with pytest.raises(CalibrationError, match=message):
        read_person(path)
    with pytest.raises(CalibrationError, match="missing.json"):
        read_person(tmp_path / "missing.json")


def test_the_same_frames_give_the_same_person(tall, person):
    again = calibrated(tall)
    assert np.array_equal(again.shape, person.shape)
    assert np.array_equal(again.covariance, person.covariance)
