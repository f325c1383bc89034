# SPDX-License-Identifier: Apache-2.0
"""Things and rooms rendered once, to be put into pictures; kept in a file."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from numpy import ndarray

from kintrack.bounds import check_bounds
from kintrack.errors import SceneError
from kintrack.geometry import PinholeCamera
from segmentation.augment.insertion import Cutouts
from segmentation.augment.sample import Bank
from segmentation.labels import BACKGROUND
from segmentation.picture import Picture, reduced

SIDE_PX = 96
"""Cut-outs are squares of this side [px]."""
SMALL = ("cup", "phone", "bottle")
"""Kinds that hide nothing of a person."""
NAMELESS = 0.5
"""Share of the cut-outs that are of no kind of thing."""
VIEWS = 4
"""Views of each thing."""
ROOM_VIEWS = 2
"""Views of each room."""
ENTRY = "kintrack.bank"
VERSION = 2


@dataclass(frozen=True)
class BankConfig:
    """How much is rendered."""

    cutouts: int = 480
    """Views of things."""
    rooms: int = 160
    """Views of rooms without people."""
    seed: int = 0
    """Draws all."""

    def __post_init__(self) -> None:
        check_bounds(self, cutouts=(0, 20_000), rooms=(0, 5_000), seed=(0, 2**31))


def load_bank(
    path: Path,
    config: BankConfig,
    on_progress: Callable[[int, int], None] = lambda done, total: None,
) -> Bank:
    """The bank of a file; rendered first if the file is not there or holds another one.

    Args:
        path: File, safetensors.
        config: What it must hold.
        on_progress: Called with views done and in all while they are rendered.

    Raises:
        SceneError: if the packages for rendering are not installed.
    """
    from safetensors import SafetensorError, safe_open
    from safetensors.numpy import save

    facts = json.dumps({"version": VERSION, **asdict(config)})
    try:
        with safe_open(path, framework="numpy") as file:
            if (file.metadata() or {}).get(ENTRY) == facts:
                return _bank({name: file.get_tensor(name) for name in file.keys()})
    except (SafetensorError, OSError):
        pass
    tensors = rendered(config, on_progress)
    path.parent.mkdir(parents=True, exist_ok=True)
    beside = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    beside.write_bytes(save(tensors, metadata={ENTRY: facts}))
    beside.replace(path)
    return _bank(tensors)


def rendered(
    config: BankConfig, on_progress: Callable[[int, int], None] = lambda done, total: None
) -> dict[str, ndarray]:
    """Render cut-outs and rooms."""
    rng = np.random.default_rng((config.seed, 17))
    total = config.cutouts + config.rooms
    reliefs = np.full((config.cutouts, SIDE_PX, SIDE_PX), np.nan, np.float16)
    colors = np.zeros((config.cutouts, SIDE_PX, SIDE_PX, 3), np.uint8)
    spans = np.zeros(config.cutouts)
    n = 0
    while n < config.cutouts:
        for relief, color, span in _thing_views(rng, min(VIEWS, config.cutouts - n)):
            reliefs[n], colors[n], spans[n] = relief, color, span
            n += 1
        on_progress(n, total)
    rooms: list[Picture] = []
    while len(rooms) < config.rooms:
        rooms += _room_views(rng, min(ROOM_VIEWS, config.rooms - len(rooms)))
        on_progress(n + len(rooms), total)
    shape = rooms[0].depth_m.shape if rooms else (0, 0)
    return {
        "cutout.relief": reliefs,
        "cutout.color": colors,
        "cutout.span": spans,
        "room.depth": np.array([r.depth_m for r in rooms], np.float32).reshape(-1, *shape),
        "room.color": np.array([r.color for r in rooms], np.uint8).reshape(-1, *shape, 3),
        "room.focal": np.array([r.focal_px for r in rooms]),
    }


def _bank(tensors: dict[str, ndarray]) -> Bank:
    cutouts = Cutouts(
        tensors["cutout.relief"].astype(np.float32), tensors["cutout.color"], tensors["cutout.span"]
    )
    depths, colors = tensors["room.depth"], tensors["room.color"]
    rooms = tuple(
        Picture(depth, color, np.full(depth.shape, BACKGROUND, np.uint8), float(focal))
        for depth, color, focal in zip(depths, colors, tensors["room.focal"], strict=True)
    )
    return Bank(cutouts, rooms)


def _thing_views(rng: np.random.Generator, count: int) -> list[tuple[ndarray, ndarray, float]]:
    """Relief, colour and span of some views of a thing that is drawn."""
    from synthesis.objects.assembly import assembly
    from synthesis.objects.catalogue import training_things
    from synthesis.render.lights import draw_lights
    from synthesis.render.stage import Stage
    from synthesis.render.view import pixel_radiance
    from synthesis.sensors.color import draw_color_camera
    from synthesis.sensors.sensor import rays

    makers = {name: make for name, make in training_things().items() if name not in SMALL}
    make = makers[str(rng.choice(sorted(makers)))]
    mesh = (assembly if rng.random() < NAMELESS else make)(rng).mesh
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    middle, radius = 0.5 * (low + high), 0.5 * float(np.linalg.norm(high - low))
    stage = Stage(mesh, None, draw_lights(rng))
    views = []
    for _ in range(count):
        away = max(rng.uniform(1.0, 3.5), 1.3 * radius)
        toward = _direction(rng.uniform(-np.pi, np.pi), rng.uniform(-0.1, 0.6))
        T = _looking(middle + away * toward, middle)
        focal = 0.48 * SIDE_PX * np.sqrt(away**2 - radius**2) / radius
        camera = PinholeCamera(SIDE_PX, SIDE_PX, focal, focal, *[0.5 * (SIDE_PX - 1)] * 2)
        view = stage.view(None, rays(camera, 2), T, color=True)
        depth = view.depth_m[::2, ::2]
        relief = np.where(depth > 0, depth - away, np.nan)
        if not np.isfinite(relief).any():
            relief = np.full_like(relief, np.nan)
            relief[SIDE_PX // 2, SIDE_PX // 2] = 0.0
        color = draw_color_camera(rng).develop(pixel_radiance(view, 2), rng)
        views.append((relief, color, away / focal))
    return views


def _room_views(rng: np.random.Generator, count: int) -> list[Picture]:
    """Some views of a room that is drawn, as a Kinect v2 with a longer range sees it."""
    from synthesis.objects.catalogue import training_things
    from synthesis.objects.rooms import room
    from synthesis.render.lights import draw_lights
    from synthesis.render.stage import Stage
    from synthesis.render.view import pixel_radiance
    from synthesis.sensors.catalogue import SENSORS
    from synthesis.sensors.color import draw_color_camera
    from synthesis.sensors.sensor import rays

    sensor = SENSORS["kinect_v2_far"]()
    camera, k = sensor.camera, sensor.supersampling
    angle = np.linspace(-np.pi, np.pi, 24)
    spot = rng.uniform(0.1, 0.6) * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    eye = np.array([-rng.uniform(1.8, 4.0), 0.0, rng.uniform(0.5, 2.2)])
    T = _looking(eye, np.array([0.0, rng.normal(0.0, 0.3), rng.uniform(0.5, 1.3)]))
    try:
        mesh = room(rng, spot, eye, T, things=training_things())
    except SceneError:
        return []
    stage, color_camera = Stage(mesh, None, draw_lights(rng)), draw_color_camera(rng)
    pictures = []
    for n in range(count):
        if n:
            T = _looking(eye, np.array([0.0, rng.normal(0.0, 0.8), rng.uniform(0.4, 1.5)]))
        view = stage.view(None, rays(camera, k), T, color=True)
        color = color_camera.develop(pixel_radiance(view, k), rng)
        nobody = np.zeros((camera.height, camera.width), np.uint8)
        pictures.append(reduced(sensor.measure(view, rng), color, nobody, camera.fx))
    return pictures


def _direction(yaw_rad: float, pitch_rad: float) -> ndarray:
    c = np.cos(pitch_rad)
    return np.array([c * np.cos(yaw_rad), c * np.sin(yaw_rad), np.sin(pitch_rad)])


def _looking(eye: ndarray, at: ndarray) -> ndarray:
    """T_world_camera of a level camera at one point that looks at another."""
    z = (at - eye) / np.linalg.norm(at - eye)
    x = np.cross(z, [0.0, 0.0, 1.0])
    x /= np.linalg.norm(x)
    T = np.eye(4)
    T[:3, :3] = np.stack([x, np.cross(z, x), z], axis=1)
    T[:3, 3] = eye
    return T
