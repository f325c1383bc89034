# SPDX-License-Identifier: Apache-2.0
"""`kintrack demo`."""

from __future__ import annotations

import webbrowser
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Demo:
    """Fit the recording that ships, write its page and video, and compare with the truth."""

    output: Path = Path("kintrack-demo")
    """Folder for everything the demo makes."""
    no_open: bool = False
    """Do not open the page in a browser."""

    def run(self) -> None:
        """Fit, evaluate, show."""
        from kintrack.commands.evaluate import Evaluate
        from kintrack.commands.fit import Fit
        from kintrack.sequence import open_sequence
        from kintrack.strip import write_strip

        recording = Path(__file__).parents[1] / "demo"
        page = self.output / "track.html"
        Fit(
            sequence=recording, output=self.output, video=self.output / "overlay.mp4", html=page
        ).run()
        Evaluate(self.output, recording, truth=True).run()
        write_strip(self.output, open_sequence(recording), self.output / "overlay.png")
        if not self.no_open:
            webbrowser.open(page.resolve().as_uri())
