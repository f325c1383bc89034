# SPDX-License-Identifier: Apache-2.0
from pathlib import Path

import cv2
import numpy as np
import pytest

from kintrack.errors import SceneError, SequenceError
from kintrack.geometry import PinholeCamera
from kintrack.sequence.camera_file import write_camera_file
from synthesis.objects.cutout import load_cutout, load_scene_frame, scene_mesh
from synthesis.objects.files import load_thing

trimesh = pytest.importorskip("trimesh")
DATA = Path(__file__).resolve().parents[4] / "shared" / "data"
CAMERA = PinholeCamera(64, 48, 60.0, 60.0, 31.5, 23.5)
SIZE = np.array([0.5, 1.0, 2.0])


def _block(size=SIZE, low=(0, 0, 0)):
    mesh = trimesh.creation.box(size)
    mesh.apply_translation(np.asarray(low) + np.asarray(size) / 2)
    return mesh


def _extent(thing):
    return np.ptp(thing.mesh.vertices, axis=0)


@pytest.mark.parametrize("suffix", ["glb", "obj", "ply", "stl"])
def test_a_mesh_is_read_in_metres_and_set_on_the_floor(tmp_path, suffix):
    path = tmp_path / f"block.{suffix}"
    _block(low=(5, 7, 0)).export(path)
    thing = load_thing(path)
    assert thing.name == "block"
    assert _extent(thing) == pytest.approx(SIZE)
    assert thing.mesh.vertices.min(axis=0) == pytest.approx([-0.25, -0.5, 0.0])
    a, b, c = np.moveaxis(thing.mesh.vertices[thing.mesh.faces], 1, 0)
    assert np.einsum("fi,fi->", a, np.cross(b, c)) / 6 == pytest.approx(np.prod(SIZE))


def test_gltf_has_y_up_and_z_forward_unless_it_stands_on_z(tmp_path):
    path = tmp_path / "block.glb"
    _block(low=(-1, 0, 3)).export(path)  # stands on y = 0
    assert _extent(load_thing(path)) == pytest.approx(SIZE[[2, 0, 1]])
    _block(low=(-1, 2, 3)).export(path)  # stands on nothing: as glTF says
    assert _extent(load_thing(path)) == pytest.approx(SIZE[[2, 0, 1]])
    assert _extent(load_thing(path, up="z")) == pytest.approx(SIZE)
    _block(low=(-1, 2, 0)).export(path)
    assert _extent(load_thing(path)) == pytest.approx(SIZE)


def test_the_front_of_a_gltf_file_becomes_x(tmp_path):
    path = tmp_path / "nose.glb"
    nose = _block((0.1, 0.1, 0.1), (-0.05, 0.0, 1.0))
    trimesh.util.concatenate([_block((1, 1, 1), (-0.5, 0, 0)), nose]).export(path)
    vertices = load_thing(path).mesh.vertices
    front = vertices[np.isclose(vertices[:, 0], vertices[:, 0].max())]
    assert np.abs(front[:, 1]).max() == pytest.approx(0.05)


def test_the_scene_graph_is_applied(tmp_path):
    scene = trimesh.Scene()
    mesh = _block((1, 1, 1))
    for x in (0.0, 3.0):
        scene.add_geometry(mesh, transform=trimesh.transformations.translation_matrix([x, 0, 0]))
    path = tmp_path / "two.glb"
    scene.export(path)
    assert _extent(load_thing(path, up="z")) == pytest.approx([4, 1, 1])


def test_units_other_than_metres_are_scaled_when_asked(tmp_path):
    path = tmp_path / "millimetres.stl"
    _block(1000 * SIZE).export(path)
    with pytest.raises(SceneError, match="500 x 1000 x 2000 m.*Metres are expected"):
        load_thing(path)
    assert _extent(load_thing(path, unit_m=0.001)) == pytest.approx(SIZE)


def test_a_texture_colours_the_surface(tmp_path):
    from PIL import Image

    pixels = np.zeros((8, 8, 3), np.uint8)
    pixels[:4], pixels[4:] = (255, 0, 0), (0, 0, 255)
    corners = np.array([[0, 0, 0], [1, 0, 0], [1, 0, 1], [0, 0, 1]], dtype=float)
    visual = trimesh.visual.TextureVisuals(
        uv=corners[:, [0, 2]],
        material=trimesh.visual.material.PBRMaterial(baseColorTexture=Image.fromarray(pixels)),
    )
    path = tmp_path / "poster.glb"
    trimesh.Trimesh(corners, [[0, 1, 2], [0, 2, 3]], visual=visual, process=False).export(path)
    mesh = load_thing(path, up="z").mesh
    top = np.isclose(mesh.vertices[:, 2], 1.0)
    inner = 0.5 + 0.9 * (mesh.coords - 0.5)
    colors = mesh.materials[0].pattern(inner)
    assert colors[top] == pytest.approx(np.tile([1, 0, 0], (2, 1)))
    assert colors[~top] == pytest.approx(np.tile([0, 0, 1], (2, 1)))


def test_vertex_colours_are_kept(tmp_path):
    mesh = _block()
    mesh.visual.vertex_colors = np.tile([255, 0, 0, 255], (len(mesh.vertices), 1))
    path = tmp_path / "red.ply"
    mesh.export(path)
    thing = load_thing(path).mesh
    assert thing.materials[0].pattern(thing.coords) == pytest.approx(
        np.tile([1, 0, 0], (len(thing.vertices), 1))
    )


def test_a_missing_or_unknown_file_is_named(tmp_path):
    with pytest.raises(SceneError, match="sofa.glb does not exist"):
        load_thing(tmp_path / "sofa.glb")
    path = tmp_path / "sofa.blend"
    path.write_bytes(b"x")
    with pytest.raises(SceneError, match=r"sofa.blend: allowed are .glb"):
        load_thing(path)


@pytest.mark.parametrize("suffix", ["glb", "gltf", "obj", "ply", "stl"])
@pytest.mark.parametrize("content", [b"", b"this is no mesh at all, whatever it says\n" * 5])
def test_a_file_that_is_no_mesh_is_named(tmp_path, suffix, content):
    path = tmp_path / f"broken.{suffix}"
    path.write_bytes(content)
    with pytest.raises(SceneError, match=f"broken.{suffix}"):
        load_thing(path)


def test_points_without_faces_are_refused(tmp_path):
    path = tmp_path / "cloud.ply"
    trimesh.PointCloud(np.eye(3)).export(path)
    with pytest.raises(SceneError, match="cloud.ply has no faces"):
        load_thing(path)


def test_vertices_that_are_not_numbers_are_refused(tmp_path):
    path = tmp_path / "nan.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nv nan 1 0\nf 1 2 3\n")
    with pytest.raises(SceneError, match="nan.obj: vertex 2 is .*nan"):
        load_thing(path)


def test_too_many_triangles_are_refused(tmp_path):
    path = tmp_path / "fine.stl"
    mesh = _block()
    mesh = trimesh.Trimesh(mesh.vertices, np.tile(mesh.faces, (17_000, 1)), process=False)
    mesh.export(path)
    with pytest.raises(SceneError, match="fine.stl has more than 200000 triangles; simplify"):
        load_thing(path)


@pytest.mark.parametrize("size", [25.0, 0.0005])
def test_absurd_sizes_are_refused(tmp_path, size):
    path = tmp_path / "odd.stl"
    _block((size, size, size)).export(path)
    with pytest.raises(SceneError, match=f"odd.stl is {size:g} x .* 0.001 to 20 m"):
        load_thing(path)


@pytest.mark.skipif(not DATA.is_dir(), reason="no development data")
def test_the_shared_furniture_stands_upright():
    for path in sorted((DATA / "furniture").glob("*.glb")):
        extent = _extent(load_thing(path))
        assert 0.3 < extent[2] < 2.2, path
    assert _extent(load_thing(DATA / "furniture" / "Wardrobe.glb"))[2] > 2.0


def _sequence(folder, depth, color=None):
    (folder / "depth").mkdir(parents=True)
    write_camera_file(folder / "camera.json", CAMERA, 0.001)
    cv2.imwrite(str(folder / "depth" / "000000.png"), (depth * 1000).astype(np.uint16))
    (folder / "depth.txt").write_text("0.0 depth/000000.png\n")
    if color is not None:
        (folder / "rgb").mkdir()
        cv2.imwrite(str(folder / "rgb" / "000000.png"), color[..., ::-1])
        (folder / "rgb.txt").write_text("0.0 rgb/000000.png\n")


def test_a_cut_out_stands_and_looks_back_at_the_camera(tmp_path):
    depth = np.zeros((48, 64))
    depth[10:40, 20:50] = 2.0
    depth[30:40, 20:30] = 1.96  # a foot that sticks out, on the left
    color = np.zeros((48, 64, 3), np.uint8)
    color[:, :35], color[:, 35:] = (255, 0, 0), (0, 255, 0)
    _sequence(tmp_path / "stand", depth, color)
    thing = load_cutout(tmp_path / "stand")
    mesh = thing.mesh
    assert thing.name == "stand"
    assert np.ptp(mesh.vertices, axis=0) == pytest.approx([0.04, 29 / 30, 29 / 30], rel=1e-3)
    assert mesh.vertices[:, 2].min() == 0.0
    a, b, c = np.moveaxis(mesh.vertices[mesh.faces], 1, 0)
    assert (np.cross(b - a, c - a)[:, 0] > 0).all()
    foot = mesh.vertices[mesh.vertices[:, 0] > 0.019]
    assert foot[:, 1].max() < 0 and foot[:, 2].max() < 0.4  # the viewer's left is its -y
    red = mesh.materials[0].pattern(mesh.coords)[:, 0] > 0.9
    assert mesh.vertices[red, 1].max() < mesh.vertices[~red, 1].min()


def test_a_cut_out_without_colour_is_grey(tmp_path):
    _sequence(tmp_path / "grey", np.full((48, 64), 1.5))
    mesh = load_cutout(tmp_path / "grey").mesh
    assert np.ptp(mesh.materials[0].pattern(mesh.coords)) == 0


def test_an_empty_cut_out_or_a_missing_frame_is_named(tmp_path):
    _sequence(tmp_path / "empty", np.zeros((48, 64)))
    with pytest.raises(SceneError, match="empty"):
        load_cutout(tmp_path / "empty")
    with pytest.raises(SequenceError, match="frame 4"):
        load_cutout(tmp_path / "empty", frame=4)
    dots = np.zeros((48, 64))
    dots[::3, ::3] = 1.0
    _sequence(tmp_path / "dots", dots)
    with pytest.raises(SceneError, match="dots.*no faces"):
        load_cutout(tmp_path / "dots")


def test_a_surface_ends_where_depth_jumps():
    depth = np.full((48, 64), 1.0)
    depth[:, 32:] = 1.07
    faces = scene_mesh(depth, None, CAMERA).faces
    assert len(faces) == 2 * 47 * (31 + 31)
    depth[:, 32:] = 1.05
    assert len(scene_mesh(depth, None, CAMERA).faces) == 2 * 47 * 63


def test_one_missing_pixel_costs_half_of_each_quad_around_it():
    depth = np.full((48, 64), 2.0)
    depth[20, 20] = 0
    assert len(scene_mesh(depth, None, CAMERA).faces) == 2 * 47 * 63 - 4


def test_a_surface_keeps_the_points_of_its_pixels():
    depth = np.random.default_rng(0).uniform(2.0, 2.02, (48, 64))
    mesh = scene_mesh(depth, None, CAMERA)
    assert mesh.vertices == pytest.approx(CAMERA.back_project(depth).reshape(-1, 3))
    a, b, c = np.moveaxis(mesh.vertices[mesh.faces], 1, 0)
    assert (np.einsum("fi,fi->f", np.cross(b - a, c - a), a) < 0).all()


def test_a_view_that_a_room_does_not_have_is_named(tmp_path):
    write_camera_file(tmp_path / "camera.json", CAMERA, 0.001)
    cv2.imwrite(str(tmp_path / "000007.depth.png"), np.full((48, 64), 1500, np.uint16))
    assert load_scene_frame(tmp_path, 0).vertices[:, 2] == pytest.approx(1.5)
    with pytest.raises(SceneError, match="view 1 of .*allowed are 0 to 0"):
        load_scene_frame(tmp_path, 1)


@pytest.mark.skipif(not DATA.is_dir(), reason="no development data")
def test_a_real_kitchen_becomes_a_coloured_surface():
    mesh = load_scene_frame(DATA / "scenes" / "redkitchen", 0)
    assert len(mesh.faces) > 300_000
    colors = mesh.materials[0].pattern(mesh.coords[::50])
    assert ((colors[:, 0] > 2.5 * colors[:, 1]) & (colors[:, 0] > 0.05)).mean() > 0.05
