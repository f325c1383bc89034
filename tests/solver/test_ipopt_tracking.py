# SPDX-License-Identifier: Apache-2.0
"""The whole tracker with the other solver."""

from dataclasses import replace

import numpy as np
import pytest

from kintrack.tracker import Tracker

pytest.importorskip("casadi")


@pytest.fixture(scope="module")
def tracks(scene, unsized):
    """Solver -> results of five frames of a person who raises an arm."""
    poses = [scene.place({"l_shoulder_elevation": 10.0 + 8 * k}) for k in range(5)]
    frames = [scene.frame(scene.depth(q), k) for k, q in enumerate(poses)]
    found = {}
    for method in ("gauss-newton", "ipopt", "ipopt again"):
        config = replace(unsized, solver=replace(unsized.solver, method=method.split()[0]))
        tracker = Tracker(config, scene.human)
        tracker.begin(frames[0], scene.joints(poses[0]))
        found[method] = [tracker.step(frame) for frame in frames[1:]]
    return poses[1:], found


def test_ipopt_tracks_as_gauss_newton_does(scene, tracks):
    poses, found = tracks
    pairs = zip(poses, found["ipopt"], found["gauss-newton"], strict=True)
    for q, ours, theirs in pairs:
        assert ours.status == theirs.status == "tracking"
        errors = [scene.errors(q, r.joint_positions_camera_m).mean() for r in (ours, theirs)]
        assert errors[0] < 0.03 and errors[0] < errors[1] + 0.01, errors


def test_ipopt_tracks_the_same_bits_twice(tracks):
    _, found = tracks
    for first, again in zip(found["ipopt"], found["ipopt again"], strict=True):
        assert np.array_equal(first.q, again.q)
        assert np.array_equal(first.joint_covariances_m2, again.joint_covariances_m2)
