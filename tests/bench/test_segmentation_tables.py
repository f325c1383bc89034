# SPDX-License-Identifier: Apache-2.0
import copy

import numpy as np
import pytest

from kintrack.bench.segmentation.card import card
from kintrack.bench.segmentation.cases import COMPOSITES, TEST
from kintrack.bench.segmentation.config import named_weights
from kintrack.bench.segmentation.samples import DEPTH, RGBD
from kintrack.bench.segmentation.summary import OBJECTS, targets
from kintrack.bench.segmentation.tables import all_grids
from kintrack.bench.segmentation.witness import JointCounts, witness_summary
from kintrack.errors import ConfigError
from segmentation.evaluate import scores_of
from segmentation.labels import LABELS


def scores(right):
    """Scores of labels of which a share is right and the rest is background."""
    counts = np.diag(np.full(7, 1000 * right))
    counts[0, 0] = 100_000
    counts[1:, 0] = 1000 - 1000 * right
    found = scores_of(counts.astype(int)).summary()
    return {"frames": 9, "recordings": 3, "unknown": 0.02, **found,
            "strict_non_background_iou": right, "of_pixels": found}  # fmt: skip


def network(architecture, inserted=True):
    config = {"seed": 7, "network": {"architecture": architecture},
              "steps": 0, "augment": {"inserted": 0.6 if inserted else 0.0}}  # fmt: skip
    return {"architecture": architecture, "widths": [1, 2], "parameters": 5_000_000, "gflop": 9.5,
            "convolutions": 9, "poolings": 3, "deconvolutions": 3, "bytes": 12_000_000,
            "sha256": "ab" * 32, "runtime": "openvino-int8", "inserted_objects": inserted,
            "training": {"data": ["training"], "command": "kintrack train /a/training -o run",
                         "steps": 5, "config": config}}  # fmt: skip


def times(ms):
    took = {"median_ms": ms, "p95_ms": 1.2 * ms, "calls": 20}
    return {"missing": {}, "reference": "openvino-int8", "works": {"openvino-int8": {
        "agreement": {"differing": 0.0, "non_background_iou": 0.9},
        "timing": {"network": took, "tracking": took, "start": took}}}}  # fmt: skip


@pytest.fixture
def content():
    joints = JointCounts()
    joints.add(np.ones((106, 128), np.uint8), np.ones((106, 128), bool),
               {"head": np.array([5.0, 5.0])}, (128, 106))  # fmt: skip
    seen = witness_summary(joints.plain())
    by_condition = {"clean": scores(0.95), "30 cm": scores(0.85), OBJECTS: scores(0.88)}
    return {
        "order": ["fast", "unet", "bare"],
        "networks": {"fast": network("fast_fcn"), "unet": network("unet"),
                     "bare": network("unet", inserted=False)},
        "labels": {
            TEST: {name: {RGBD: copy.deepcopy(by_condition)} for name in ("fast", "unet", "bare")},
            COMPOSITES: {"fast": {DEPTH: {OBJECTS: scores(0.7)}}},
        },
        "mask": {"uva_turn": {"fast": {RGBD: {"frames": 9, "iou": 0.9, "iou_read": 0.95}}}},
        "witness": {"sofa": {"fast": {RGBD: seen}}},
        "ceiling": seen,
        "runtimes": {"fast": times(4.0), "unet": times(16.0), "bare": times(16.0)},
        "config": {}, "load": 0.1, "left_out": {},
    }  # fmt: skip


def judged(content):
    return {row["what"]: row for row in targets(content)}


def test_targets_are_passed_and_missed_by_what_was_measured(content):
    found = judged(content)
    assert found["non-background IoU, objects at 30-60 cm"]["passed"]
    assert found["IoU of the left arm, the same"]["measured"] == pytest.approx(88.0)
    assert not found["non-background IoU, UTD-MHAD in real scenes with objects"]["passed"]
    assert found["int8 a frame, network"]["passed"]
    assert "visible joints on their own part, bonn_tablet" not in found


def test_the_rival_is_the_unet_that_saw_objects_too(content):
    content["labels"][TEST]["unet"][RGBD][OBJECTS] = scores(0.91)
    content["labels"][TEST]["bare"][RGBD][OBJECTS] = scores(0.5)
    found = judged(content)
    assert found["fast behind unet in that"]["measured"] == pytest.approx(3.0)
    assert not found["fast behind unet in that"]["passed"]
    assert found["time of fast, int8, of that of unet"]["measured"] == 0.25
    assert found["time of fast, int8, of that of unet"]["passed"]


@pytest.mark.parametrize("told", [{"steps": 9}, {"steps": None}, {"start": {"steps": 3}},
                                  {"data": ["other"]}])  # fmt: skip
def test_networks_are_only_compared_if_they_were_trained_alike(content, told):
    content["targets"] = []
    for name in ("fast", "bare"):
        content["networks"][name]["training"] |= told
    assert not [what for what in judged(content) if "unet" in what]
    assert not [grid for grid in all_grids(content) if grid.title.startswith("Trained")]


def test_another_seed_is_another_training(content):
    content["networks"]["fast"]["training"]["config"]["seed"] = 8
    assert not [what for what in judged(content) if "unet" in what]


def test_every_table_is_as_wide_as_its_header(content):
    content["targets"] = targets(content)
    grids = all_grids(content)
    assert len(grids) == 11
    for grid in grids:
        assert {len(row) for row in grid.rows} == {len(grid.header)}, grid.title
        lines = grid.markdown().splitlines()
        assert len(lines) == 2 + len(grid.rows) and len({line.count("|") for line in lines}) == 1


def test_the_ablation_is_set_against_the_same_network_trained_with_objects(content):
    content["targets"] = []
    content["labels"][TEST]["bare"][RGBD][OBJECTS] = scores(0.5)
    (ablation,) = (grid for grid in all_grids(content) if grid.title.startswith("Trained"))
    assert {row[:2] for row in ablation.rows} == {("bare", "unet")}
    assert [row[3:] for row in ablation.rows if row[4] == OBJECTS] == [
        (RGBD, OBJECTS, "88.0", "50.0", "-38.0")
    ]


def test_a_table_tells_pooled_scores_and_those_of_a_distance(content):
    content["targets"] = []
    (accuracy,) = (grid for grid in all_grids(content) if grid.title.startswith("Accuracy"))
    column = accuracy.header.index("non-background IoU")
    own = {row[2]: row[column] for row in accuracy.rows if row[0] == "fast"}
    assert own == {"none": "95.0", "30 cm": "85.0", OBJECTS: "88.0"}


def test_the_card_tells_data_seed_command_and_numbers_of_the_first_network_only(content):
    content["targets"] = targets(content)
    text = card(content, "curves.png")
    for said in ("kintrack train training -o run", "seed: 7", "data: training", "(curves.png)",
                 "augment.inserted | 0.6", "| fast | RGB-D | 30 cm | 9 |"):  # fmt: skip
        assert said in text, said
    assert "| bare |" not in text and "| unet |" not in text
    assert "curves" not in card(content, None)


def test_weights_that_tell_nothing_of_their_training_have_a_card_too(content):
    content["targets"] = []
    content["networks"]["fast"]["training"] = {}
    assert "the weights file tells none" in card(content, None)


def test_weights_are_given_by_name():
    found = named_weights(["fast_fcn=a/b=c.safetensors", "unet=u"])
    assert [f"{name} {path}" for name, path in found.items()] == [
        "fast_fcn a/b=c.safetensors",
        "unet u",
    ]
    for wrong in ([], ["plain.safetensors"], ["=x"], ["a="], ["a=1", "a=2"], ["a b=1"]):
        with pytest.raises(ConfigError):
            named_weights(wrong)


def test_parts_come_in_the_order_of_the_labels(content):
    content["targets"] = []
    (parts,) = (grid for grid in all_grids(content) if grid.title.startswith("IoU of every"))
    assert parts.header[3:] == tuple(name.replace("_", " ") for name in LABELS[1:])
