# SPDX-License-Identifier: Apache-2.0
"""Who is in view: the labelled pixels of a frame, sorted into people.

A network labels everybody. Labelled pixels that no depth step parts are one piece; pieces are one
person where they nearly touch, or lie above each other with something in front of the gap, unless
that would give one person two heads or two trunks. Pieces all rim and no inside are left out:
along an outline a coarse label map spills onto what lies behind.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, UInt8
from numba import njit
from numpy import ndarray
from scipy.spatial.distance import cdist

from kintrack.association.observation import Observation
from kintrack.components import components
from kintrack.geometry import LABELS, transform_points
from kintrack.labelled_config import PeopleConfig

SIDE_SHARE = 0.04
"""What comes so near to the left or right edge, share of the image, goes on beyond it."""
CUT_SHARE = 0.4
"""Somebody whom the edge cuts counts as if only this share of what shows of him did."""
HEAD, TORSO = LABELS.index("head"), LABELS.index("torso")


@dataclass(frozen=True)
class Somebody:
    """One person's labelled pixels."""

    mask: Bool[ndarray, "h w"]
    """The pixels, at working resolution."""
    place_world: Float[ndarray, " 3"]
    """Middle of trunk and head, or of all pixels where neither shows [m]."""
    distance_m: float
    """From the camera [m]."""
    part_area_m2: Float[ndarray, " 7"]
    """What shows of each part, across the line of sight [m^2]."""
    cut: bool = False
    """Whether the left or right edge of the image cuts him."""

    @property
    def area_m2(self) -> float:
        """What shows of the person, across the line of sight [m^2]."""
        return float(self.part_area_m2.sum())

    @property
    def weight_m2(self) -> float:
        """The same, less if the edge of the image cuts the person [m^2]."""
        return self.area_m2 * (CUT_SHARE if self.cut else 1.0)


def find_people(
    observation: Observation,
    T_world_camera: Float[ndarray, "4 4"],
    config: PeopleConfig | None = None,
) -> tuple[Somebody, ...]:
    """Everybody in view.

    Args:
        observation: Labelled points.
        T_world_camera: Camera pose; tells what is above what.
        config: What parts people.

    Returns:
        People, the one who shows most first; none if nothing is labelled.
    """
    config = PeopleConfig() if config is None else config
    if observation.labels is None:
        return ()
    z = observation.points_camera[..., 2]
    label = _parts(observation.labels, z, config.max_distance_m)
    piece = components(z, label > 0, config.edge_m, 0.0)
    count = int(piece.max()) + 1
    if count == 0:
        return ()
    inside = label.ravel() > 0
    index, part = piece.ravel()[inside], label.ravel()[inside]
    core = np.bincount(index, weights=_cores(z, label, config.edge_m).ravel()[inside])
    area = (z.ravel() ** 2 / (observation.camera.fx * observation.camera.fy))[inside]
    points = transform_points(T_world_camera, observation.points_camera.reshape(-1, 3)[inside])
    areas = np.zeros((count, len(LABELS)))
    np.add.at(areas, (index, part), area)
    solid = core >= config.least_core * np.bincount(index)
    large = np.flatnonzero(solid & (areas.sum(axis=1) >= config.least_piece_m2))
    large = large[np.argsort(-areas[large].sum(axis=1), kind="stable")]
    pieces = [_Piece(points[index == k], part[index == k], areas[k]) for k in large]
    people = []
    for members in _joined(pieces, config):
        found = areas[large[members]].sum(axis=0)
        if found.sum() < config.least_person_m2:
            continue
        member = np.zeros(count + 1, dtype=bool)
        member[large[members]] = True
        mask = member[piece]
        place = _middle(
            np.concatenate([pieces[m].points for m in members]),
            np.concatenate([pieces[m].parts for m in members]),
        )
        distance = float(np.linalg.norm(place - T_world_camera[:3, 3]))
        people.append(Somebody(mask, place, distance, found, cut_by_side(mask)))
    return tuple(sorted(people, key=lambda body: -body.area_m2))


def choose(
    people: tuple[Somebody, ...], near_world: Float[ndarray, " 3"] | None = None
) -> Somebody | None:
    """The person to look at: nearest to a place, or the nearest of those who show enough.

    Args:
        people: Everybody in view.
        near_world: Where the person was last [m]; None if nobody is known yet.

    Returns:
        The person, None if there is none. Without a place, whoever shows at least half as much as
        the one who shows most may be chosen; of somebody who is half outside, that is less.
    """
    if not people:
        return None
    if near_world is not None:
        return min(people, key=lambda body: float(np.linalg.norm(body.place_world - near_world)))
    least = 0.5 * max(body.weight_m2 for body in people)
    return min((b for b in people if b.weight_m2 >= least), key=lambda body: body.distance_m)


def cut_by_side(mask: Bool[ndarray, "h w"]) -> bool:
    """Whether at least a quarter of a patch's rows reach the left or the right edge."""
    side = max(1, round(SIDE_SHARE * mask.shape[1]))
    rows = max(1, int(mask.any(axis=1).sum()))
    reaching = max(int(part.any(axis=1).sum()) for part in (mask[:, :side], mask[:, -side:]))
    return 4 * reaching >= rows


def only(observation: Observation, body: Somebody) -> Observation:
    """The observation with one person's labels; everybody else is background."""
    assert observation.labels is not None
    labels = np.where(body.mask, observation.labels, np.uint8(0))
    return replace(observation, region=body.mask & observation.region, labels=labels)


def without_others(
    observation: Observation,
    own: Somebody,
    people: tuple[Somebody, ...],
    config: PeopleConfig | None = None,
) -> Observation:
    """The observation without the labels of everybody else who surely is somebody else.

    Args:
        observation: Labelled points.
        own: The person.
        people: Everybody in view.
        config: What parts people: a head or a trunk of one's own, far enough away. A limb alone may
            be the person's behind something.
    """
    assert observation.labels is not None
    config = PeopleConfig() if config is None else config
    theirs = np.zeros_like(observation.region)
    for body in people:
        area, away = body.part_area_m2, np.linalg.norm(body.place_world - own.place_world)
        whole = area[HEAD] >= config.head_m2 or area[TORSO] >= config.torso_m2
        if body is not own and whole and away > config.torsos_m:
            theirs |= body.mask
    labels = np.where(theirs, np.uint8(0), observation.labels)
    return replace(observation, region=observation.region & ~theirs, labels=labels)


@dataclass(frozen=True)
class _Piece:
    points: Float[ndarray, "n 3"]
    parts: UInt8[ndarray, " n"]
    areas: Float[ndarray, " 7"]

    @property
    def sample(self) -> Float[ndarray, "m 3"]:
        """At most 64 of its points."""
        return self.points[:: -(-len(self.points) // 64)]


def _joined(pieces: list[_Piece], config: PeopleConfig) -> list[list[int]]:
    """Which pieces make up each person; larger pieces are asked first."""
    samples = [piece.sample for piece in pieces]
    n = len(pieces)
    gap = np.full((n, n), np.inf)
    for i in range(n):
        for j in range(i):
            gap[i, j] = gap[j, i] = _gap(samples[i], samples[j], config)
    group = list(range(n))
    pairs = [(gap[i, j], i, j) for i in range(n) for j in range(i) if np.isfinite(gap[i, j])]
    for _, i, j in sorted(pairs):
        a, b = group[i], group[j]
        if a == b:
            continue
        first = [pieces[k] for k in range(n) if group[k] == a]
        second = [pieces[k] for k in range(n) if group[k] == b]
        if not _two(first, second, config):
            group = [min(a, b) if g in (a, b) else g for g in group]
    return [[k for k in range(n) if group[k] == g] for g in sorted(set(group))]


def _gap(a: ndarray, b: ndarray, config: PeopleConfig) -> float:
    """Distance between two pieces [m]; inf if they cannot be one person's."""
    apart = float(cdist(a, b).min())
    if apart <= config.link_m:
        return apart
    across = cdist(a[:, :2], b[:, :2]).min()
    up = max(a[:, 2].min() - b[:, 2].max(), b[:, 2].min() - a[:, 2].max(), 0.0)
    return apart if across <= config.aside_m and up <= config.above_m else np.inf


def _two(a: list[_Piece], b: list[_Piece], config: PeopleConfig) -> bool:
    """True if two groups of pieces have a head or a trunk each, too far apart to be the same."""
    for part, least, apart in (
        (HEAD, config.head_m2, config.heads_m),
        (TORSO, config.torso_m2, config.torsos_m),
    ):
        if all(sum(p.areas[part] for p in g) >= least for g in (a, b)):
            middles = [
                np.median(np.concatenate([p.points[p.parts == part] for p in g]), axis=0)
                for g in (a, b)
            ]
            if np.linalg.norm(middles[0] - middles[1]) > apart:
                return True
    return False


def _middle(points: Float[ndarray, "n 3"], parts: UInt8[ndarray, " n"]) -> Float[ndarray, " 3"]:
    trunk = (parts == HEAD) | (parts == TORSO)
    return np.median(points[trunk] if trunk.any() else points, axis=0)


def _parts(labels: UInt8[ndarray, "h w"], z: Float[ndarray, "h w"], most_m: float) -> ndarray:
    """The labels, 0 where there is no reading, none that counts, or no body part."""
    good = (labels < len(LABELS)) & (z > 0) & (z <= most_m)
    return np.where(good, labels, np.uint8(0))


@njit(cache=True, nogil=True)
def _cores(z, label, edge):
    h, w = z.shape
    out = np.zeros((h, w), dtype=np.bool_)
    for i in range(1, h - 1):
        for j in range(1, w - 1):
            if label[i, j] == 0:
                continue
            near = True
            for a, b in ((i + 1, j), (i - 1, j), (i, j + 1), (i, j - 1)):
                if label[a, b] == 0 or abs(z[a, b] - z[i, j]) > edge:
                    near = False
            out[i, j] = near
    return out
