# SPDX-License-Identifier: Apache-2.0
"""What was counted, pooled into the figures that are reported, and compared with the targets."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from kintrack.bench.cases import CLEAN
from kintrack.bench.segmentation.cases import COMPOSITES, TEST, Case
from kintrack.bench.segmentation.samples import DEPTH, RGBD
from kintrack.bench.segmentation.witness import witness_summary
from segmentation.evaluate import scores_of
from segmentation.labels import LABELS

OBJECTS = "30-60 cm"
"""All recordings with an object, pooled."""
SHIPPED_RUNTIME = "openvino-int8"


@dataclass(frozen=True)
class Judged:
    """One recording by one network."""

    case: Case
    """The recording."""
    network: str
    """The network's name."""
    modality: str
    """One of `MODALITIES`."""
    plain: dict[str, Any]
    """See `Tally.plain`."""


def summary(judged: Sequence[Judged]) -> dict[str, Any]:
    """Scores by group, network, modality and condition.

    Returns:
        `labels`: of recordings with true labels; `mask`: intersection over union of the person;
        `witness`: see `witness_summary`.
    """
    found: dict[str, Any] = {"labels": {}, "mask": {}, "witness": {}}
    pools: dict[tuple[str, ...], list[Judged]] = defaultdict(list)
    for row in judged:
        where = (row.case.group, row.network, row.modality)
        pools[(*where, row.case.condition)].append(row)
        if row.case.condition != CLEAN:
            pools[(*where, OBJECTS)].append(row)
    for (group, network, modality, condition), rows in pools.items():
        if group in (TEST, COMPOSITES):
            _put(found["labels"], _labels(rows), group, network, modality, condition)
            continue
        if np.sum([row.plain["mask"] for row in rows]):
            _put(found["mask"], _mask(rows), group, network, modality)
        if rows[0].plain["joints"]["labels"]:
            joints = witness_summary(rows[0].plain["joints"])
            _put(found["witness"], joints, group, network, modality)
    return found


def _put(tree: dict[str, Any], value: object, *keys: str) -> None:
    for key in keys[:-1]:
        tree = tree.setdefault(key, {})
    tree[keys[-1]] = value


def _labels(rows: Sequence[Judged]) -> dict[str, Any]:
    counts = np.sum([row.plain["counts"] for row in rows], axis=0)
    strict = np.sum([row.plain["counts_strict"] for row in rows], axis=0)
    pixels = np.sum([row.plain["counts_of_pixels"] for row in rows], axis=0)
    unknown = strict.sum() - counts.sum()
    return {
        "recordings": len(rows),
        "frames": sum(row.plain["frames"] for row in rows),
        **scores_of(counts).summary(),
        "unknown": float(unknown / max(counts[1:].sum() + unknown, 1)),
        "of_pixels": scores_of(pixels).summary(),
        "strict_non_background_iou": scores_of(strict).summary()["non_background_iou"],
    }


def _mask(rows: Sequence[Judged]) -> dict[str, Any]:
    return {
        "frames": sum(row.plain["frames"] for row in rows),
        **{
            name: _iou(np.sum([row.plain[key] for row in rows], axis=0))
            for name, key in (("iou", "mask"), ("iou_read", "mask_read"))
        },
    }


def _iou(counts: np.ndarray) -> float | None:
    union = counts.sum() - counts[0, 0]
    return float(counts[1, 1] / union) if union else None


def targets(content: dict[str, Any]) -> list[dict[str, Any]]:
    """The targets that can be judged, for the network that ships, which is the first.

    Returns:
        What, measured, bound, whether at least or at most that is asked for, unit, and passed.
    """
    ships = content["order"][0]
    pair = rivals_of(content)
    at = content["labels"].get(TEST, {}).get(ships, {}).get(RGBD, {}).get(OBJECTS, {})
    rows = [
        _share("non-background IoU, objects at 30-60 cm", at.get("non_background_iou"), 85),
        _share("background IoU, the same", at.get("background_iou"), 98),
        *(_share(f"IoU of the {part.replace('_', ' ')}, the same", at.get(part), 75)
          for part in LABELS[1:]),
    ]  # fmt: skip
    if pair is not None:
        own, other = (content["labels"][TEST][name][RGBD][OBJECTS]["non_background_iou"]
                      for name in pair)  # fmt: skip
        gap = None if None in (own, other) else other - own
        rows.append(_share(f"{pair[0]} behind {pair[1]} in that", gap, 2, at_least=False,
                           unit="points"))  # fmt: skip
        times = [_median(content, name, SHIPPED_RUNTIME, "network") for name in pair]
        ratio = times[0] / times[1] if times[0] and times[1] else None
        rows.append(_row(f"time of {pair[0]}, int8, of that of {pair[1]}", ratio, 1 / 3,
                         at_least=False, unit="times"))  # fmt: skip
    real = content["labels"].get(COMPOSITES, {}).get(ships, {}).get(DEPTH, {}).get(OBJECTS, {})
    rows.append(_share("non-background IoU, UTD-MHAD in real scenes with objects",
                       real.get("non_background_iou"), 75))  # fmt: skip
    mask = content["mask"].get("uva_turn", {}).get(ships, {}).get(RGBD, {})
    rows.append(_share("IoU of the person's mask, uva_turn", mask.get("iou"), 85))
    for scene in ("bonn_tablet", "sofa"):
        joints = content["witness"].get(scene, {}).get(ships, {}).get(RGBD, {})
        rows.append(_share(f"visible joints on their own part, {scene}", joints.get("own"), 80))
    for what, part, bound in (("network", "network", 6.0), ("pre- and post-processing", "tracking",
                                                             12.0)):  # fmt: skip
        time_ms = _median(content, ships, SHIPPED_RUNTIME, part)
        rows.append(_row(f"int8 a frame, {what}", time_ms, bound, at_least=False, unit="ms"))
    return [row for row in rows if row["measured"] is not None]


def rivals_of(content: dict[str, Any]) -> tuple[str, str] | None:
    """The first Fast-FCN and the first U-Net that were trained alike, if there are any."""
    networks = content["networks"]
    for name in content["order"]:
        for rival in content["order"]:
            kinds = networks[name]["architecture"], networks[rival]["architecture"]
            if kinds == ("fast_fcn", "unet") and trained_alike(networks[name], networks[rival]):
                return str(name), str(rival)
    return None


def trained_alike(
    one: Mapping[str, Any], other: Mapping[str, Any], but: Sequence[str] = ("network.",)
) -> bool:
    """Whether two networks were trained from nothing on the same data, as long and in the same way.

    Networks that do not tell count as trained in different ways.

    Args:
        one: Facts of a network.
        other: Of another one.
        but: How the names of settings begin that may differ.
    """
    said = one["training"], other["training"]
    if any(not training.get("steps") or training.get("start") for training in said):
        return False
    if any(said[0].get(key) != said[1].get(key) for key in ("data", "steps", "training_pictures")):
        return False
    own, others = (
        {key: value for key, value in settings(training).items() if not key.startswith(tuple(but))}
        for training in said
    )
    return own == others


def settings(training: Mapping[str, Any]) -> dict[str, Any]:
    """Every setting of a training by its dotted name; none if the weights tell none."""
    config = training.get("config")
    return dict(_leaves(config)) if isinstance(config, Mapping) else {}


def _leaves(tree: Mapping[str, Any], before: str = "") -> Iterator[tuple[str, Any]]:
    for key, value in tree.items():
        if isinstance(value, Mapping):
            yield from _leaves(value, f"{before}{key}.")
        else:
            yield before + key, value


def _median(content: dict[str, Any], network: str, runtime: str, part: str) -> float | None:
    works = content["runtimes"][network]["works"].get(runtime)
    return None if works is None else works["timing"][part]["median_ms"]


def _share(
    what: str, share: float | None, bound: float, at_least: bool = True, unit: str = "%"
) -> dict[str, Any]:
    return _row(what, None if share is None else 100 * share, bound, at_least, unit)


def _row(
    what: str, measured: float | None, bound: float, at_least: bool, unit: str
) -> dict[str, Any]:
    passed = measured is not None and (measured >= bound if at_least else measured <= bound)
    return {"what": what, "measured": measured, "bound": bound, "at_least": at_least,
            "unit": unit, "passed": passed}  # fmt: skip
