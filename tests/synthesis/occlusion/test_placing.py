# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from kintrack.errors import ConfigError, SceneError
from kintrack.geometry import T_LEVEL_WORLD_CAMERA, PinholeCamera
from kintrack.raster import rasterise
from synthesis.mesh import Material, mesh_of
from synthesis.occlusion.placing import TOLERANCE, PlacingConfig, place
from synthesis.occlusion.silhouette import Silhouette, hidden_share

CAMERA = PinholeCamera(160, 120, 143.0, 143.0, 80.0, 60.0)
CORNERS = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float)
QUADS = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
FACES = np.array([t for q in QUADS for t in ((q[0], q[1], q[2]), (q[0], q[2], q[3]))])


def grey(coords):
    return np.full((len(coords), 3), 0.5)


BOX = mesh_of((CORNERS - [0.5, 0.5, 0.0]) * [0.5, 0.6, 0.7], FACES, Material(grey))


def person(depth_m=2.5):
    mask = np.zeros((120, 160), dtype=bool)
    mask[15:110, 65:95] = True
    return Silhouette(mask, np.where(mask, depth_m, 0.0))


def seen(placing):
    T = placing.T_camera_thing
    points = BOX.vertices @ T[:3, :3].T + T[:3, 3]
    depth = rasterise(points, BOX.faces, CAMERA)[0]
    return points, np.where(np.isfinite(depth), depth, 0.0)


@pytest.mark.parametrize("distance_m", [0.30, 0.45, 0.60])
@pytest.mark.parametrize("share", [0.33, 0.5])
def test_the_farthest_point_and_the_hidden_share_are_as_asked(distance_m, share):
    config = PlacingConfig(distance_m, share)
    found = place(BOX, CAMERA, T_LEVEL_WORLD_CAMERA, [person()], config, np.random.default_rng(1))
    points, depth = seen(found)
    assert points[:, 2].max() == pytest.approx(2.5 - distance_m, abs=1e-6)
    assert hidden_share(person(), depth) == pytest.approx(share, abs=TOLERANCE)


@pytest.mark.parametrize("side, sign", [("left", -1), ("right", 1)])
def test_it_stands_on_the_side_that_is_asked_for(side, sign):
    for seed in range(4):
        config = PlacingConfig(0.45, 0.33, side)
        rng = np.random.default_rng(seed)
        found = place(BOX, CAMERA, T_LEVEL_WORLD_CAMERA, [person()], config, rng)
        columns = np.nonzero(seen(found)[1])[1]
        assert sign * (0.5 * (columns.min() + columns.max()) - 79.5) > 0


def test_it_stands_upright_but_for_a_small_tilt():
    for seed in range(4):
        rng = np.random.default_rng(seed)
        found = place(BOX, CAMERA, T_LEVEL_WORLD_CAMERA, [person()], PlacingConfig(), rng)
        up_camera = found.T_camera_thing[:3, 2] / found.scale
        assert up_camera @ [0.0, -1.0, 0.0] > np.cos(np.radians(30.0))


def test_an_impossible_share_says_how_much_was_possible():
    thin = mesh_of(BOX.vertices * [1e-2, 1e-2, 0.3], FACES, Material(grey))
    with pytest.raises(SceneError, match=r"stick cannot hide 0\.50 .* the most .* was 0\.0"):
        place(
            thin,
            CAMERA,
            T_LEVEL_WORLD_CAMERA,
            [person()],
            PlacingConfig(0.45, 0.5),
            np.random.default_rng(0),
            "stick",
        )


def test_a_person_outside_the_image_is_an_error():
    with pytest.raises(SceneError, match="no person in any frame"):
        place(BOX, CAMERA, T_LEVEL_WORLD_CAMERA, [], PlacingConfig(), np.random.default_rng(0))


def test_a_person_too_near_leaves_no_room():
    with pytest.raises(SceneError, match="no room"):
        place(
            BOX,
            CAMERA,
            T_LEVEL_WORLD_CAMERA,
            [person(0.8)],
            PlacingConfig(0.6),
            np.random.default_rng(0),
        )


@pytest.mark.parametrize("values", [{"share": 0.9}, {"share": 0.0}, {"distance_m": -1.0}])
def test_shares_and_distances_out_of_range_are_refused(values):
    with pytest.raises(ConfigError, match=next(iter(values))):
        PlacingConfig(**values)
