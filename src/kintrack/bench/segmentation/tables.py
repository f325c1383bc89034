# SPDX-License-Identifier: Apache-2.0
"""The tables of the segmentation bench, from the content of `segmentation.json`."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

from kintrack.bench.cases import CLEAN
from kintrack.bench.segmentation.cases import COMPOSITES, CONDITIONS, TEST
from kintrack.bench.segmentation.runtimes import VARIANTS
from kintrack.bench.segmentation.samples import DEPTH, MODALITIES, RGBD
from kintrack.bench.segmentation.summary import OBJECTS, trained_alike
from segmentation.labels import LABELS

PARTS = LABELS[1:]


class Grid(NamedTuple):
    """A table."""

    title: str
    """What it shows."""
    header: tuple[str, ...]
    """Names of the columns."""
    rows: Sequence[tuple[str, ...]]
    """Its cells."""

    def text(self) -> str:
        """In columns, as wide as they need to be; the first is set left, the others right."""
        lines = [self.header, *self.rows]
        widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
        return "\n".join(
            "  ".join(
                cell.rjust(width) if n else cell.ljust(width)
                for n, (cell, width) in enumerate(zip(line, widths, strict=True))
            )
            for line in lines
        )

    def markdown(self) -> str:
        """As Markdown; the first column is text, the others are set right."""
        rule = ["---", *["---:"] * (len(self.header) - 1)]
        return "\n".join("| " + " | ".join(row) + " |" for row in (self.header, rule, *self.rows))


def counts(content: dict[str, Any]) -> Grid:
    """Operations, parameters, sizes."""
    header = ("network", "convolutions", "poolings", "deconvolutions", "widths",
              "parameters [M]", "GFLOP a frame", "file [MB]", "trained with objects")  # fmt: skip
    rows = [
        (
            name,
            *(str(facts[key]) for key in ("convolutions", "poolings", "deconvolutions")),
            "/".join(map(str, facts["widths"])),
            f"{facts['parameters'] / 1e6:.2f}",
            f"{facts['gflop']:.2f}",
            f"{facts['bytes'] / 1e6:.1f}",
            {True: "yes", False: "no", None: "?"}[facts["inserted_objects"]],
        )
        for name, facts in _ordered(content, content["networks"])
    ]
    return Grid("Networks", header, rows)


def times(content: dict[str, Any]) -> Grid:
    """Milliseconds and agreement of every runtime."""
    header = ("network", "runtime", "network alone [ms]", "p95", "while tracking [ms]", "p95",
              "both looks [ms]", "p95", "pixels that differ [%]", "non-background IoU [%]",
              "change")  # fmt: skip
    rows = []
    for name, found in _ordered(content, content["runtimes"]):
        reference = found["works"].get(found["reference"])
        first = reference and reference["agreement"]["non_background_iou"]
        for runtime in VARIANTS:
            if runtime not in found["works"]:
                continue
            one = found["works"][runtime]
            iou = one["agreement"]["non_background_iou"]
            took = one["timing"]
            rows.append(
                (
                    name,
                    runtime,
                    *(f"{took[part][key]:.1f}" for part in ("network", "tracking", "start")
                      for key in ("median_ms", "p95_ms")),
                    f"{100 * one['agreement']['differing']:.2f}",
                    _percent(iou),
                    "-" if iou is None or first is None else f"{100 * (iou - first):+.2f}",
                )
            )  # fmt: skip
    return Grid("Runtimes", header, rows)


def accuracy(content: dict[str, Any], group: str = TEST) -> Grid:
    """Pixel accuracy, background and non-background IoU."""
    header = ("network", "input", "object", "frames", "pixel accuracy", "background IoU",
              "non-background IoU", "person's mask IoU", "mean IoU of parts")  # fmt: skip
    keys = ("pixel_accuracy", "background_iou", "non_background_iou", "person_iou",
            "mean_part_iou")  # fmt: skip
    rows = [
        (*where, str(found["frames"]), *(_percent(found[key]) for key in keys))
        for where, found in _each(content, group)
    ]
    return Grid("Accuracy [%]", header, rows)


def of_pixels(content: dict[str, Any], group: str = TEST) -> Grid:
    """The same and every part, judged where a tracker uses labels."""
    header = ("network", "input", "object", "non-background IoU", "person's mask IoU",
              "mean IoU of parts", *(part.replace("_", " ") for part in PARTS))  # fmt: skip
    keys = ("non_background_iou", "person_iou", "mean_part_iou", *PARTS)
    rows = [
        (*where, *(_percent(found["of_pixels"][key]) for key in keys))
        for where, found in _each(content, group)
    ]
    return Grid("Judged at the image's pixels with a reading [%]", header, rows)


def parts(content: dict[str, Any], group: str = TEST) -> Grid:
    """Intersection over union of every part."""
    header = ("network", "input", "object", *(part.replace("_", " ") for part in PARTS))
    rows = [
        (*where, *(_percent(found[part]) for part in PARTS))
        for where, found in _each(content, group)
    ]
    return Grid("IoU of every part [%]", header, rows)


def ablation(content: dict[str, Any]) -> Grid:
    """Training without inserted objects, against the same network with them."""
    header = ("network without", "against", "set", "input", "object", "with", "without", "change")
    rows: list[tuple[str, ...]] = []
    for bare, facts in _ordered(content, content["networks"]):
        if facts["inserted_objects"] is not False:
            continue
        for full, other in _ordered(content, content["networks"]):
            alike = trained_alike(facts, other, but=("augment.inserted",))
            if other["inserted_objects"] is True and alike:
                rows += _changes(content, bare, full)
    return Grid("Trained without inserted objects: non-background IoU [%]", header, rows)


def _changes(content: dict[str, Any], bare: str, full: str) -> Iterator[tuple[str, ...]]:
    for group in content["labels"]:
        found = {where: one["non_background_iou"] for where, one in _each(content, group)}
        for (name, modality, condition), new in found.items():
            old = found.get((full, modality, condition))
            if name == bare and (full, modality, condition) in found:
                change = "-" if old is None or new is None else f"{100 * (new - old):+.1f}"
                shown = (_percent(old), _percent(new), change)
                yield (bare, full, group, modality, condition, *shown)


def composites(content: dict[str, Any]) -> Grid:
    """Real people in real scenes."""
    header = ("network", "input", "object", "frames", "non-background IoU", "unknown as background",
              "background IoU", "person's mask IoU", *(part.replace("_", " ") for part in PARTS),
              "person unknown")  # fmt: skip
    keys = ("non_background_iou", "strict_non_background_iou", "background_iou", "person_iou",
            *PARTS, "unknown")  # fmt: skip
    rows = [
        (*where, str(found["frames"]), *(_percent(found[key]) for key in keys))
        for where, found in _each(content, COMPOSITES)
    ]
    return Grid("UTD-MHAD in real scenes [%]", header, rows)


def mask(content: dict[str, Any]) -> Grid:
    """Person's mask on real recordings."""
    header = ("recording", "network", "input", "frames", "IoU", "IoU where depth reads")
    rows = [
        (scene, name, modality, str(found["frames"]), _percent(found["iou"]),
         _percent(found["iou_read"]))
        for scene, networks in content["mask"].items()
        for name, modalities in _ordered(content, networks)
        for modality, found in _in_order(modalities)
    ]  # fmt: skip
    return Grid("Person's mask on a real recording [%]", header, rows)


def witness(content: dict[str, Any]) -> Grid:
    """Joints of a witness on pixels of their own part."""
    header = ("recording", "network", "input", "joints", "own part", "or 1 pixel beside",
              "own part where depth reads", "or 1 pixel beside", "other side's", "other part's",
              "background", "no depth")  # fmt: skip
    keys = ("own", "near", "own_read", "near_read", "mirrored", "other", "background")
    rows = []
    for scene, networks in content["witness"].items():
        for name, modalities in _ordered(content, networks):
            for modality, found in _in_order(modalities):
                rows.append((scene, name, modality, found))
    rows.append(("synthetic", "true labels, true joints", "-", content["ceiling"]))
    return Grid(
        "Visible MediaPipe joints on real recordings [%]",
        header,
        [
            (*where, str(found["joints"]), *(_percent(found[key]) for key in keys),
             _percent(found["without_reading"] / max(found["joints"], 1)))
            for *where, found in rows
        ],
    )  # fmt: skip


def joints(content: dict[str, Any]) -> Grid:
    """The same by joint, for the first network with all that the camera gives."""
    name = content["order"][0]
    columns = {
        scene: (networks[name].get(RGBD) or networks[name][DEPTH])["by_joint"]
        for scene, networks in content["witness"].items()
    }
    columns["true labels, true joints"] = content["ceiling"]["by_joint"]
    names = dict.fromkeys(joint for found in columns.values() for joint in found)
    rows = [
        (joint.replace("_", " "),
         *(_percent(found.get(joint, {}).get("own")) for found in columns.values()))
        for joint in names
    ]  # fmt: skip
    return Grid(f"Joints on their own part by joint, {name} [%]", ("joint", *columns), rows)


def aims(content: dict[str, Any]) -> Grid:
    """Targets, for the network that ships."""
    rows = [
        (
            row["what"],
            f"{row['measured']:.2f} {row['unit']}",
            f"{'at least' if row['at_least'] else 'at most'} {row['bound']:.4g} {row['unit']}",
            "pass" if row["passed"] else "**fail**",
        )
        for row in content["targets"]
    ]
    name = content["order"][0]
    return Grid(f"Targets, {name}", ("", "measured", "target", ""), rows)


def all_grids(content: dict[str, Any]) -> list[Grid]:
    """Every table that has rows."""
    makers = (
        counts,
        times,
        accuracy,
        parts,
        of_pixels,
        ablation,
        composites,
        mask,
        witness,
        joints,
        aims,
    )
    return [grid for grid in (make(content) for make in makers) if grid.rows]


def _each(
    content: dict[str, Any], group: str
) -> Iterator[tuple[tuple[str, str, str], dict[str, Any]]]:
    """(network, input, object) and scores, in the order of the tables."""
    for network, modalities in _ordered(content, content["labels"].get(group, {})):
        for modality, conditions in _in_order(modalities):
            for condition in (*CONDITIONS, OBJECTS):
                if condition in conditions:
                    shown = "none" if condition == CLEAN else condition
                    yield (network, modality, shown), conditions[condition]


def _ordered(content: dict[str, Any], by_network: dict[str, Any]) -> list[tuple[str, Any]]:
    """Networks in the order they were given, which a JSON file does not keep."""
    return [(name, by_network[name]) for name in content["order"] if name in by_network]


def _in_order(modalities: dict[str, Any]) -> list[tuple[str, Any]]:
    """The same for what networks are shown."""
    return [(modality, modalities[modality]) for modality in MODALITIES if modality in modalities]


def _percent(share: float | None) -> str:
    return "-" if share is None else f"{100 * share:.1f}"
