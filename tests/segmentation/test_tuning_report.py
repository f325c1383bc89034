# SPDX-License-Identifier: Apache-2.0
"""What the report on tuned weights says."""

from segmentation.tuning_report import text_of, verdict_of


def condition(name, before, after, own=True):
    return {"condition": name, "own": own, "start": {"non_background_iou": before},
            "tuned": {"non_background_iou": after}}  # fmt: skip


def test_the_verdict_says_better_worse_the_same_and_forgotten():
    assert "better on what was held out (as recorded: 70.0 to 80.0 %)" in verdict_of(
        [condition("as recorded", 0.7, 0.8)])  # fmt: skip
    assert "go on with those you began with" in verdict_of(
        [condition("as recorded", 0.7, 0.8), condition("objects in front", 0.7, 0.6)])  # fmt: skip
    assert "about as good" in verdict_of([condition("as recorded", 0.7, 0.702)])
    lost = condition("other recordings", 0.9, 0.8, own=False)
    assert "forgotten" in verdict_of([condition("as recorded", 0.7, 0.8), lost])
    assert "about as good" in verdict_of([condition("as recorded", None, None)])


def test_a_part_that_nobody_shows_has_no_score_in_the_text():
    keys = ("non_background_iou", "background_iou", "person_iou", "head", "torso", "right_arm",
            "left_arm", "right_leg", "left_leg")  # fmt: skip
    one = dict.fromkeys(keys, 0.5)
    scores = [{"condition": "as recorded", "own": True, "pictures": 1, "tuned": one,
               "start": one | {"head": None}}]  # fmt: skip
    text = text_of({"verdict": "v", "weights": "w", "start": "s", "command": "c", "version": "1",
                    "training": {}, "recordings": [], "scores": scores,
                    "division": {"by": "people", "caution": ""}})  # fmt: skip
    assert "| before > after | as recorded (1) |" in text.replace("IoU [%], ", "")
    assert "| head | - > 50.0 |" in text and "| torso | 50.0 > 50.0 (+0.0) |" in text
    assert "Caution" not in text
