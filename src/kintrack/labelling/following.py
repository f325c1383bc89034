# SPDX-License-Identifier: Apache-2.0
"""One person found in a recording with a room, and followed through time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import cv2
import numpy as np
from jaxtyping import Float
from numpy import ndarray

from kintrack.bounds import check_bounds
from kintrack.components import components
from kintrack.labelling.room import (
    Plane,
    RoomConfig,
    on_planes,
    room_planes,
    still_background,
)
from kintrack.labelling.transfer import NOISE_PER_M
from kintrack.sequence.frame import SequenceReader

BEHIND_M = 0.15
"""Least depth step between a person's outline and what is behind it [m]."""


@dataclass(frozen=True)
class ForegroundConfig:
    """What of an image may be the person."""

    max_width_px: int = 320
    """Wider images are thinned to at most this width for the search [px]."""
    edge_m: float = 0.08
    """Depth step that parts two things [m]; four times the depth noise is added."""
    min_area_m2: float = 0.15
    """Least surface of a person in view [m^2]: head and shoulders."""
    max_area_m2: float = 1.6
    """Largest surface [m^2]: a tall person in a wide coat who sits on a stool."""
    min_height_m: float = 0.5
    """Least height in the image [m]."""
    max_height_m: float = 2.4
    """Largest height, arms raised [m]."""
    max_width_m: float = 2.2
    """Largest width, arms spread [m]."""
    max_distance_m: float = 6.0
    """Things further away are ignored [m]."""
    min_moving: float = 0.15
    """Least share of a first piece that moved, before a still camera."""
    min_stirring: float = 0.03
    """The same where no piece of any frame moved that much: somebody who stands and waves."""
    min_free: float = 0.6
    """Least share of a person's outline behind which the image is further away; furniture stands
    against walls and behind people."""
    min_relief_m: float = 0.02
    """Least depth of a person about the plane through him, root mean square [m]; cupboards and
    boards have less. Only asked before a moving camera, as `min_free`."""
    max_growth: float = 1.7
    """Largest change of a person's visible surface from one frame to the next, as a factor."""
    reach_m: float = 0.12
    """How far a person may move sideways from one frame to the next [m]."""
    min_overlap: float = 0.25
    """Least share of the last mask that must be found again."""
    samples: int = 60
    """Frames over the recording from which the still background is made."""
    room: RoomConfig = field(default_factory=RoomConfig)
    """Floor, walls and background."""

    def __post_init__(self) -> None:
        lengths = ("edge_m", "min_area_m2", "max_area_m2", "min_height_m", "max_height_m",
                   "max_width_m", "max_distance_m", "min_relief_m", "reach_m")  # fmt: skip
        shares = ("min_moving", "min_stirring", "min_free", "min_overlap")
        check_bounds(
            self,
            max_width_px=(64, 4096),
            samples=(3, 1000),
            max_growth=(1, 100),
            **dict.fromkeys(lengths, (1e-4, 100)),
            **dict.fromkeys(shares, (0, 1)),
        )


class Scene:
    """One recording at working resolution, and what is known of its room."""

    def __init__(self, sequence, config, camera, factor, still, background, sampled):
        self.sequence, self.config, self.camera, self.factor = sequence, config, camera, factor
        self.still, self.background = still, background
        self.far = still_background(sampled) if background is None else background
        self.least_moving = config.min_moving
        self.planes: tuple[Plane, ...] = ()
        self.seen: dict[int, tuple[Plane, ...]] = {}
        if still:
            self.planes = room_planes(camera.back_project(self.far), camera, config.room)

    def pieces(self, index: int) -> tuple[ndarray, ndarray, tuple[Plane, ...]]:
        """Depth, piece number per pixel (-1 = room or no reading) and planes of a frame."""
        depth = self.sequence.frame(index).depth_m
        if depth is None:
            empty = np.zeros((self.camera.height, self.camera.width))
            return empty, np.full(empty.shape, -1), ()
        depth = np.asarray(depth[:: self.factor, :: self.factor], dtype=float)
        points = self.camera.back_project(depth)
        config = self.config
        if self.still:
            planes = self.planes
        else:
            if index not in self.seen:
                self.seen[index] = room_planes(points, self.camera, config.room)
            planes = self.seen[index]
        free = (depth > 0) & (depth < config.max_distance_m)
        free &= ~on_planes(points, planes, config.room)
        if self.background is not None:
            free &= (self.background <= 0) | (depth < self.background - self.margin())
        return depth, components(depth, free, config.edge_m, 4 * NOISE_PER_M), planes

    def margin(self) -> Float[ndarray, "h w"]:
        """How far before the background something must be [m]."""
        room = self.config.room
        background = self.far if self.background is None else self.background
        return room.margin_m + 3 * NOISE_PER_M * background**2

    def follow(self, on_frame: Callable[[], None]):
        """Masks and planes of all frames, from the clearest one both ways."""
        count = len(self.sequence)
        masks: list[ndarray | None] = [None] * count
        planes: list[tuple[Plane, ...]] = [()] * count
        scores = np.zeros(count)
        for i in range(count):
            depth, piece, planes[i] = self.pieces(i)
            scores[i] = self.first(depth, piece)[0]
            on_frame()
        if scores.max() <= 0 and self.still:
            self.least_moving = self.config.min_stirring
            scores = np.array([self.first(*self.pieces(i)[:2])[0] for i in range(count)])
        if scores.max() <= 0:
            return masks, tuple(planes)
        seed = int(np.argmax(scores))
        for order in (range(seed, count), range(seed, -1, -1)):
            last: tuple[ndarray, ndarray] | None = None
            for i in order:
                depth, piece, _ = self.pieces(i)
                found = self.again(depth, piece, last) if last is not None else None
                if found is None:
                    found = self.first(depth, piece)[1]
                masks[i] = found
                last = None if found is None else (found, depth)
        return masks, tuple(planes)

    def first(self, depth, piece) -> tuple[float, ndarray | None]:
        """The piece that is most like a person [its score in m^2, its mask]."""
        config = self.config
        best, mask = 0.0, None
        pixel_m2 = depth**2 / (self.camera.fx * self.camera.fy)
        moved = depth < self.far - self.margin() if self.still else np.ones(depth.shape, bool)
        found = piece >= 0
        if not found.any():
            return best, mask
        area = np.bincount(piece[found], weights=pixel_m2[found])
        moving = np.bincount(piece[found], weights=(pixel_m2 * moved)[found])
        for k in np.flatnonzero((area >= config.min_area_m2) & (area <= config.max_area_m2)):
            if moving[k] < self.least_moving * area[k]:
                continue
            this = piece == k
            if not self.sized(depth, this):
                continue
            free = self.free(depth, this)
            if not self.still and (free < config.min_free or self.flat(depth, this)):
                continue
            beside = this[:, :2].sum() + this[:, -2:].sum() + self.cut(depth, this)
            score = free * moving[k] / (1 + beside / 10)
            if score > best:
                best, mask = score, this
        return best, mask

    def free(self, depth, mask) -> float:
        """Share of a piece's outline behind which the image is further away."""
        kernel = np.ones((5, 5), np.uint8)
        own = cv2.dilate(np.where(mask, depth, 0.0), kernel)
        rim = (cv2.dilate(mask.astype(np.uint8), kernel) > 0) & ~mask & (depth > 0)
        return float((depth[rim] > own[rim] + BEHIND_M).sum() / max(rim.sum(), 1))

    def flat(self, depth, mask) -> bool:
        """True if a piece has no more relief about a plane than depth noise and a board have."""
        row, column = np.nonzero(mask)
        z = depth[mask]
        A = np.stack([row, column, np.ones(len(z))], axis=1)
        left = z - A @ np.linalg.lstsq(A, z, rcond=None)[0]
        noise = NOISE_PER_M * float(np.median(z)) ** 2
        return float(np.sqrt((left**2).mean())) < float(np.hypot(self.config.min_relief_m, noise))

    def cut(self, depth, mask) -> int:
        """Pixels of a piece beside pixels without reading that reach to the image's rim."""
        width = mask.shape[1] // 20
        return int(mask[:, :width].sum() + mask[:, -width:].sum())

    def sized(self, depth, mask) -> bool:
        """True if a piece has a person's height and width in the image."""
        row, column = np.nonzero(mask)
        z = float(np.median(depth[mask]))
        height = np.ptp(np.quantile(row, [0.01, 0.99])) * z / self.camera.fy
        across = np.ptp(np.quantile(column, [0.02, 0.98])) * z / self.camera.fx
        config = self.config
        return bool(
            config.min_height_m <= height <= config.max_height_m and across <= config.max_width_m
        )

    def again(self, depth, piece, last) -> ndarray | None:
        """The pieces that continue the last mask; None if too little of it is found."""
        config = self.config
        mask, before = last
        z = float(np.median(before[mask]))
        half = max(1, round(config.reach_m * self.camera.fx / z))
        kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * half + 1, 2 * half + 1))
        near = cv2.dilate(mask.astype(np.uint8), kernel) > 0
        low, high = np.quantile(before[mask], [0.01, 0.99])
        near &= (depth > low - 0.25) & (depth < high + 0.25)
        found = piece >= 0
        if not found.any():
            return None
        whole = np.bincount(piece[found])
        within = np.bincount(piece[found & near], minlength=len(whole))
        pixel_m2 = (z / self.camera.fx) * (z / self.camera.fy)
        fits = (within >= 0.6 * whole) & (whole * pixel_m2 <= config.max_area_m2) & (whole >= 15)
        taken = np.flatnonzero(fits)
        if len(taken) == 0:
            return None
        out = np.isin(piece, taken)
        if out.sum() < config.min_overlap * mask.sum():
            return None
        if not self.still:
            change = (depth[out] ** 2).sum() / (before[mask] ** 2).sum()
            if not 1 / config.max_growth <= change <= config.max_growth:
                return None
            if self.free(depth, out) < 0.7 * config.min_free:
                return None
        return out

    def learn(self, masks: list[ndarray | None]) -> None:
        """The background: what each pixel reads while the person found so far is elsewhere."""
        depths = []
        half = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (9, 9))
        for i in spread_frames(len(self.sequence), self.config.samples):
            depth = self.sequence.frame(i).depth_m
            if depth is None:
                continue
            depth = np.asarray(depth[:: self.factor, :: self.factor], dtype=float).copy()
            mask = masks[i]
            if mask is not None:
                depth[cv2.dilate(mask.astype(np.uint8), half) > 0] = 0
            depths.append(depth)
        self.background = still_background(depths)


def spread_frames(count: int, most: int) -> list[int]:
    """At most so many frame numbers, evenly spread."""
    return sorted({int(i) for i in np.linspace(0, count - 1, min(count, most))})


def sampled_depths(sequence: SequenceReader, most: int, factor: int) -> list[ndarray]:
    """Depth images of readable frames, evenly spread and thinned [m]."""
    frames = (sequence.frame(i).depth_m for i in spread_frames(len(sequence), most))
    return [np.asarray(d[::factor, ::factor]) for d in frames if d is not None]
