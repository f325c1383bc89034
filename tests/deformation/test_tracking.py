# SPDX-License-Identifier: Apache-2.0
from dataclasses import replace

import numpy as np
import pytest

from deformation.folded import FOLD_M, fold_of, wearing
from kintrack.deformation_config import DeformationConfig
from kintrack.errors import ResultError
from kintrack.geometry import T_LEVEL_WORLD_CAMERA
from kintrack.joints import JOINT_NAMES
from kintrack.offsets import SURFACE_FILE, load_offsets
from kintrack.result_writer import TrackWriter
from kintrack.surfaces import load_surfaces, write_surfaces
from kintrack.tracker import Tracker

FRAMES = 20


@pytest.fixture(scope="module")
def config(quick):
    return replace(quick, deformation=DeformationConfig(enabled=True))


@pytest.fixture(scope="module")
def recording(scene, human):
    """Frames of a person with a fold who sways; the last two show nobody."""
    folded = wearing(human, fold_of(human))
    depths = [
        scene.depth(scene.place(at=(2.8, 0.01 * np.sin(0.4 * n), 0.0)), folded)
        for n in range(FRAMES)
    ]
    depths += [np.zeros_like(depths[0])] * 2
    return [scene.frame(depth, n) for n, depth in enumerate(depths)]


@pytest.fixture(scope="module")
def tracked(config, human, recording, scene, tmp_path_factory):
    """Tracker, results and result folder."""
    folder = tmp_path_factory.mktemp("result")
    tracker = Tracker(config, human)
    with TrackWriter(
        folder, JOINT_NAMES, sequence_name="sway", camera=scene.camera, config={}
    ) as writer:
        writer.note(T_world_camera=T_LEVEL_WORLD_CAMERA, person={"shape": [], "clothing_m": {}})
        results = [tracker.step(frame) for frame in recording]
        for result in results:
            writer.append(result)
    return tracker, results, folder


def test_the_tracker_finds_the_fold_while_the_person_sways(tracked, human):
    tracker, results, _ = tracked
    assert all(result.status == "tracking" for result in results[:FRAMES])
    top = np.argmax(fold_of(human))
    assert results[FRAMES - 1].offsets_m[top] == pytest.approx(FOLD_M, abs=0.003)
    assert tracker.human.skin is not human.skin


def test_without_deformation_nothing_is_raised(quick, human, recording):
    tracker = Tracker(quick, human)
    assert tracker.step(recording[0]).offsets_m is None
    assert tracker.human is human


def test_a_rival_wears_what_the_track_has_learnt(config, human, recording):
    tracker = Tracker(config, human)
    results = [tracker.step(frame) for frame in recording[:12]]
    learnt = tracker.surface.offsets_m
    assert learnt.max() > 0.5 * FOLD_M
    duels = tracker._challenged(recording[11], results[-1])
    assert duels
    for duel in duels:
        worn = duel.rival.surface.offsets_m
        assert np.abs(worn - learnt).mean() < 0.2 * np.abs(learnt).mean()


def test_two_runs_give_the_same_bits(config, human, recording, tracked):
    tracker = Tracker(config, human)
    for frame, before in zip(recording[:4], tracked[1], strict=False):
        result = tracker.step(frame)
        assert result.offsets_m.tobytes() == before.offsets_m.tobytes()
        assert result.q.tobytes() == before.q.tobytes()


def test_the_result_folder_keeps_the_offsets_to_a_tenth_of_a_millimetre(tracked):
    _, results, folder = tracked
    stored = load_offsets(folder / SURFACE_FILE)
    assert len(stored) == len(results)
    assert np.abs(stored[FRAMES - 1] - results[FRAMES - 1].offsets_m).max() <= 0.5001e-4
    assert np.isnan(stored[-1]).all() == (results[-1].offsets_m is None)


def test_a_new_run_into_the_same_folder_takes_the_old_surface_away(scene, tmp_path):
    (tmp_path / SURFACE_FILE).write_bytes(b"old")
    with TrackWriter(tmp_path, JOINT_NAMES, sequence_name="", camera=scene.camera, config={}):
        pass
    assert not (tmp_path / SURFACE_FILE).exists()


@pytest.mark.parametrize("content", [b"", b"no archive", None])
def test_a_broken_surface_file_is_named(tmp_path, content):
    path = tmp_path / SURFACE_FILE
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(ResultError, match=SURFACE_FILE):
        load_offsets(path)


def test_offsets_of_another_length_than_the_track_are_refused(tracked, tmp_path):
    for name in ("track.npz", "summary.json"):
        (tmp_path / name).write_bytes((tracked[2] / name).read_bytes())
    np.savez(tmp_path / SURFACE_FILE, offsets_100um=np.zeros((3, 5), dtype=np.int16))
    with pytest.raises(ResultError, match="3 frames of 5 vertices"):
        load_surfaces(tmp_path)


@pytest.mark.parametrize("resolution", ["tracking", "display"])
def test_every_tracked_frame_is_exported_with_its_fold(tracked, tmp_path, resolution):
    _, _, folder = tracked
    written = write_surfaces(folder, tmp_path, None, resolution, "offset", ("ply", "gltf"), 19)
    names = sorted(path.name for path in tmp_path.iterdir())
    assert written == 2
    assert names == ["000000.glb", "000000.ply", "000019.glb", "000019.ply"]
    found = tracked[1][19].offsets_m.max()
    assert load_surfaces(folder, resolution).offsets_m[19].max() == pytest.approx(found, rel=0.2)


def test_residuals_without_a_recording_are_refused(tracked, tmp_path):
    with pytest.raises(ResultError, match="recording"):
        write_surfaces(tracked[2], tmp_path, None, coloring="residual")


def test_with_the_recording_residuals_are_written_beside_the_offsets(tracked, recording, tmp_path):
    class Recording:
        def frame(self, index):
            return recording[index]

    folder = tracked[2]
    write_surfaces(folder, tmp_path, Recording(), coloring="residual", formats=("ply",), every=30)
    (path,) = tmp_path.iterdir()
    assert b"property float residual_m" in path.read_bytes()[:500]
