# SPDX-License-Identifier: Apache-2.0
"""The data engine: frames per second, disk, and a sheet of random frames; docs/results.md.

Run it on an otherwise idle machine.
"""

from __future__ import annotations

from typing import Any

import report
from command import OUT, parser, run

from kintrack.bench.filming import FilmingConfig, run_filming
from kintrack.commands.console import StepProgress, console
from kintrack.files import make_result_folder, write_json
from synthesis.dataset.build import build_dataset
from synthesis.dataset.pictures import write_sheet
from synthesis.dataset.recipes import takes_of

SHEET_FRAMES = 400
"""Frames of the set that the sheet is drawn from."""
SEED = 0


def main() -> int:
    """Measure, draw, write."""
    arguments = parser(__doc__).parse_args()
    config = FilmingConfig(frames=15, takes=2) if arguments.quick else FilmingConfig()
    with StepProgress() as progress:
        found = run_filming(config, progress)
        for kind, rates in found.items():
            console.print(f"{kind}: {rates['frames_per_second']:.1f} frames/s")
        if arguments.quick:
            return 0
        folder = make_result_folder(OUT) / "sheet"
        mocap = arguments.data / "mocap"
        takes = takes_of("training", SEED, mocap if mocap.is_dir() else None, SHEET_FRAMES)
        facts: dict[str, object] = {"recipe": "training", "seed": SEED}
        build_dataset(
            folder,
            takes,
            facts,
            mocap if mocap.is_dir() else None,
            config.workers,
            lambda done: progress("filming for the sheet", done.frames, SHEET_FRAMES),
        )
    write_sheet(folder, report.RESULTS.parent / "dataset.png", 20, SEED)
    write_json(OUT / "data_engine.json", found)
    report.rewrite_section(report.RESULTS, "data-engine", section(found, config))
    console.print(f"written: {report.RESULTS.relative_to(report.ROOT)}, docs/dataset.png")
    return 0


def section(found: dict[str, Any], config: FilmingConfig) -> str:
    """Markdown of the section."""
    rows = [
        [kind, f"{rates['frames_per_second']:.1f}", f"{rates['bytes_per_frame'] / 1e3:.0f}"]
        for kind, rates in found.items()
    ]
    facts = report.conditions(
        data=f"{config.takes} takes of {config.frames} frames each (`paper` recipe, in rooms)",
        seeds=str(config.seed),
    )
    return f"""## Cost of synthetic recordings

Whole rooms at 512 x 424 with a dressed person: rays, colour with shadows, noise of a Kinect v2
and of the colour camera, labels, true joints, hidden share, compressed files.
{config.workers} processes; people, clothes and rooms are drawn within the measured time.

{report.table(("camera", "frames/s", "kB a frame"), rows)}

### Conditions

{report.bullets(facts)}
"""


if __name__ == "__main__":
    run(main)
