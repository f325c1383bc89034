# SPDX-License-Identifier: Apache-2.0
"""The person is found before floor, wall and furniture, with a still and with a moving camera."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

from kintrack.errors import ConfigError, SequenceError
from kintrack.geometry import PinholeCamera
from kintrack.labelling.foreground import ForegroundConfig, find_foreground, only_person
from kintrack.labelling.room import RoomConfig, room_planes
from kintrack.sequence.frame import Frame

FLOOR_M, WALL_M = 1.0, 4.5


@dataclass
class Frames:
    """A recording in memory."""

    frames: tuple[Frame, ...]
    camera: PinholeCamera
    name: str = "room"
    root: Path = Path("room")

    def __len__(self):
        return len(self.frames)

    def __iter__(self):
        return iter(self.frames)

    def frame(self, index):
        return self.frames[index]


@pytest.fixture(scope="module")
def room(scene):
    """A function: frames of a person who walks sideways before wall, floor and a cupboard."""

    def film(places, wall_m=None, seed=0):
        rng = np.random.default_rng(seed)
        camera = scene.camera
        v, u = np.mgrid[: camera.height, : camera.width]
        down = np.maximum((v - camera.cy) / camera.fy, 1e-6)
        frames, persons = [], []
        for i, place in enumerate(places):
            far = np.minimum(FLOOR_M / down, WALL_M if wall_m is None else wall_m[i])
            far = np.where((u > 20) & (u < 70) & (v > 60) & (v < 170), np.minimum(far, 3.6), far)
            far = far + rng.normal(size=far.shape) * 1.4e-3 * far**2
            body = np.zeros(far.shape)
            if place is not None:
                q = scene.place(at=(2.8, *place))
                body = scene.depth(q)
            person = (body > 0) & (body < far)
            frames.append(scene.frame(np.where(person, body, far).astype(np.float32), i))
            persons.append(person)
        return Frames(tuple(frames), camera), persons

    return film


WALK = [(0.6 - 0.15 * i, -0.1) for i in range(9)]


def overlap(foreground, recording, persons):
    found = [foreground.of(frame) for frame in recording]
    return [(a & b).sum() / max((a | b).sum(), 1) for a, b in zip(found, persons, strict=True)]


def test_a_recording_without_background_passes_untouched(scene):
    recording = Frames(tuple(scene.frame(scene.depth(scene.place()), i) for i in range(3)),
                       scene.camera)  # fmt: skip
    foreground = find_foreground(recording)
    assert foreground.kind == "removed"
    alone = only_person(recording, foreground)
    assert alone.frame(1) is recording.frame(1)
    assert not foreground.room(recording.frame(1)).any()


def test_floor_and_wall_are_found_the_same_every_time_and_the_cupboard_is_not(room):
    recording, _ = room([(0.0, -0.1)])
    points = recording.camera.back_project(recording.frame(0).depth_m)
    planes = room_planes(points, recording.camera, RoomConfig())
    assert len(planes) == 2
    wall, floor = sorted(planes, key=lambda plane: plane.offset_m)
    assert wall.normal_camera[2] < -0.99 and abs(wall.offset_m + WALL_M) < 0.05
    assert floor.normal_camera[1] < -0.99 and abs(floor.offset_m + FLOOR_M) < 0.03
    again = room_planes(points, recording.camera, RoomConfig())
    assert all((a.normal_camera == b.normal_camera).all() for a, b in zip(planes, again))  # noqa: B905


def test_a_person_who_walks_before_a_still_camera_is_found(room):
    recording, persons = room(WALK)
    foreground = find_foreground(recording)
    assert foreground.kind == "still"
    assert min(overlap(foreground, recording, persons)) > 0.85


def test_a_person_before_a_moving_camera_is_found(room):
    recording, persons = room(WALK, wall_m=[4.0 + 0.25 * i for i in range(9)])
    config = ForegroundConfig(room=RoomConfig(still_share=0.9))
    foreground = find_foreground(recording, config)
    assert foreground.kind == "moving"
    assert min(overlap(foreground, recording, persons)) > 0.85


def test_an_empty_room_yields_nobody_and_the_person_who_enters_it_is_found(room):
    recording, persons = room([None, None, *WALK[:5], None])
    foreground = find_foreground(recording)
    shares = overlap(foreground, recording, persons)
    assert min(shares[2:7]) > 0.8
    for index in (0, 1, 7):
        assert foreground.of(recording.frame(index)).sum() < 100
    alone = only_person(recording, foreground)
    assert alone.frame(0).depth_m is None and "no person" in alone.frame(0).problem


def test_an_empty_recording_of_the_room_takes_its_place(room):
    recording, persons = room(WALK[:4])
    empty, _ = room([None] * 3, seed=1)
    foreground = find_foreground(recording, empty_room=empty)
    assert min(overlap(foreground, recording, persons)) > 0.85
    other = Frames(empty.frames, PinholeCamera(320, 240, 300.0, 300.0, 159.5, 119.5))
    with pytest.raises(SequenceError, match="another camera"):
        find_foreground(recording, empty_room=other)


def test_a_frame_that_cannot_be_read_is_passed_over(room):
    recording, persons = room(WALK)
    broken = list(recording.frames)
    broken[4] = replace(broken[4], depth_m=None, problem="broken")
    foreground = find_foreground(Frames(tuple(broken), recording.camera))
    assert foreground.masks[4] is None and foreground.masks[8] is not None


def test_a_recording_of_broken_frames_is_an_error(room):
    recording, _ = room(WALK[:2])
    broken = tuple(replace(f, depth_m=None, problem="broken") for f in recording)
    with pytest.raises(SequenceError, match="room: none of the frames"):
        find_foreground(Frames(broken, recording.camera))


def test_a_setting_out_of_range_is_refused():
    with pytest.raises(ConfigError, match="edge_m = 0"):
        ForegroundConfig(edge_m=0)
