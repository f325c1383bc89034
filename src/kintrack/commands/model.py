# SPDX-License-Identifier: Apache-2.0
"""`kintrack model`."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import tyro

from kintrack.commands.console import StepProgress, console
from kintrack.modelling.build import ModelBuildConfig, build_model
from kintrack.modelling.pictures import draw_model
from kintrack.residuals.pose_prior import PRIOR_FILE
from synthesis.motions.habits import HabitsConfig, learn_habits


@dataclass(frozen=True)
class ModelBuild:
    """Rebuild the human from the adult population (needs the extra `model`)."""

    output: Path = Path("model")
    """Folder for human.urdf and skin/."""
    config: Annotated[ModelBuildConfig, tyro.conf.OmitArgPrefixes] = field(
        default_factory=ModelBuildConfig
    )
    """Sizes and seed."""

    def run(self) -> None:
        """Build, with a line per step."""
        build_model(self.output, self.config, console.print)


@dataclass(frozen=True)
class ModelPictures:
    """Draw the human in extreme but legal poses, and what its shape coefficients do."""

    output: Path = Path("docs")
    """Folder for model_poses.png and model_shapes.png."""

    def run(self) -> None:
        """Draw both pictures."""
        for path in draw_model(self.output):
            console.print(f"written: {path}")


@dataclass(frozen=True)
class ModelPrior:
    """Learn which postures legs take (needs the extra `model`)."""

    output: Path = Path("model")
    """Folder for pose_prior.npz."""
    mocap: Path | None = None
    """Folder of motion capture clips, as cmu_*.npz; authored motions only if not given."""
    config: Annotated[HabitsConfig, tyro.conf.OmitArgPrefixes] = field(default_factory=HabitsConfig)
    """Sizes and seed."""

    def run(self) -> None:
        """Learn it, with progress."""
        path = self.output / PRIOR_FILE
        with StepProgress("motions") as progress:
            learn_habits(
                path, self.mocap, self.config, lambda done, n: progress("performing", done, n)
            )
        console.print(f"written: {path}")


@dataclass(frozen=True)
class Model:
    """The human itself: build it, learn its postures, or draw it."""

    action: Annotated[
        Annotated[ModelBuild, tyro.conf.subcommand("build")]
        | Annotated[ModelPrior, tyro.conf.subcommand("prior")]
        | Annotated[ModelPictures, tyro.conf.subcommand("pictures")],
        tyro.conf.OmitSubcommandPrefixes,
        tyro.conf.OmitArgPrefixes,
    ]
    """What to do."""

    def run(self) -> None:
        """Do it."""
        self.action.run()
