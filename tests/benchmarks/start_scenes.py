# SPDX-License-Identifier: Apache-2.0
"""Short recordings that break into the middle of what somebody does, for cold starts.

People face anywhere, sit in a third of them, stand behind things in a third, and leave the image
in part in a quarter. `python tests/benchmarks/start_scenes.py --count 100` makes the first hundred
in out/starts/; those that are there stay.
"""

from __future__ import annotations

import argparse
import json
import shutil
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np

from kintrack.errors import KintrackError
from kintrack.files import write_json
from kintrack.joints import JOINT_NAMES
from kintrack.sequence.write import SequenceWriter
from synthesis.dataset.record import TAKE_FILE
from synthesis.film import film
from synthesis.motions.actions import HELD_OUT_ACTIONS, training_actions
from synthesis.motions.motion import Motion
from synthesis.people.population import held_out_people, training_people
from synthesis.scene import Scene, build_scene
from synthesis.takes import Take

OUT = Path(__file__).resolve().parents[2] / "out" / "starts"
FRAMES = 10
"""Length of a recording: a start has so many frames to lock [Wan19 says nothing; issue 6]."""
LONGEST_BEFORE = 110
"""Most frames of the motion that pass before the recording begins."""
SITTING = ("sitting_down_and_rising", "sitting_and_gesturing")
SITTING_SHARE, BARRIER_SHARE, TRUNCATED_SHARE = 0.3, 0.3, 0.25
MOST_HIDDEN = 0.6
"""Recordings that show less of the person in their first frame are drawn anew."""
REDRAWS = 12


def draw_take(seed: int, n: int, draw: int, held_out: bool) -> tuple[Take, int]:
    """The n-th take and how many of its frames come before the recording."""
    rng = np.random.default_rng((seed, 6, n, draw, int(held_out)))
    sitting = rng.random() < SITTING_SHARE
    others = HELD_OUT_ACTIONS if held_out else training_actions()
    action = str(rng.choice(SITTING if sitting else [a for a in others if a not in SITTING]))
    before = int(rng.integers(0, LONGEST_BEFORE + 1))
    take = Take(
        name=f"{n:04d}",
        part="held_out" if held_out else "held_in",
        seed=(seed, 7, n, draw, int(held_out)),
        person=int(rng.choice(held_out_people() if held_out else training_people())),
        action=action,
        sensor="kinect_v2",
        frames=before + FRAMES,
        barrier=bool(rng.random() < BARRIER_SHARE),
        truncated=bool(rng.random() < TRUNCATED_SHARE),
        held_out_things=held_out,
    )
    return take, before


def later(scene: Scene, before: int) -> Scene:
    """The scene from a frame on."""
    motion = scene.motion
    planted = {side: flags[before:] for side, flags in motion.planted.items()}
    return replace(
        scene,
        motion=Motion(motion.times_s[before:], motion.q[before:], planted),
        held=tuple(replace(h, Ts_world_mesh=h.Ts_world_mesh[before:]) for h in scene.held),
        Ts_world_camera=scene.Ts_world_camera[before:],
    )


def make(root: Path, seed: int, n: int, held_out: bool) -> Path:
    """One recording, made unless it is there."""
    folder = root / ("held_out" if held_out else "held_in") / f"s{seed}_{n:04d}"
    if (folder / TAKE_FILE).is_file():
        return folder
    partial = folder.with_name(f".{folder.name}.partial")
    problem = ""
    for draw in range(REDRAWS):
        shutil.rmtree(partial, ignore_errors=True)
        take, before = draw_take(seed, n, draw, held_out)
        try:
            scene = later(build_scene(take), before)
        except KintrackError as error:
            problem = str(error)
            continue
        writer = SequenceWriter(partial, scene.sensor.camera)
        for exposure in film(scene, np.random.default_rng((*take.seed, 1))):
            if not len(writer) and not exposure.hidden_share <= MOST_HIDDEN:
                problem = f"{exposure.hidden_share:.0%} hidden"
                break
            writer.write(
                exposure.timestamp_s,
                exposure.depth_m,
                color=exposure.color,
                labels=exposure.labels,
                joint_positions_m=exposure.joint_positions_camera_m,
                hidden_share=exposure.hidden_share,
                hidden_joints=[
                    name
                    for name, hidden in zip(JOINT_NAMES, exposure.hidden_joints, strict=True)
                    if hidden
                ],
            )
        else:
            facts = {"take": asdict(take), "before": before, "draw": draw}
            pose = scene.Ts_world_camera[0].tolist()
            write_json(partial / TAKE_FILE, facts | {"T_world_camera": pose})
            partial.rename(folder)
            return folder
    shutil.rmtree(partial, ignore_errors=True)
    raise KintrackError(f"{folder.name}: no recording in {REDRAWS} draws ({problem})")


def facts_of(folder: Path) -> dict:
    """What decided a recording."""
    return json.loads((folder / TAKE_FILE).read_text())


def main() -> int:
    """Make recordings from the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--step", type=int, default=1)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--held-out", action="store_true")
    arguments = parser.parse_args()
    for n in range(arguments.first, arguments.count, arguments.step):
        make(OUT, arguments.seed, n, arguments.held_out)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
