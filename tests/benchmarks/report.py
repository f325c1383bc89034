# SPDX-License-Identifier: Apache-2.0
"""Rewrite one named section of docs/results.md, with the conditions it was measured under.

Everything between a section's two markers belongs to the command that measures it; whatever is
written outside of them stays.
"""

from __future__ import annotations

import importlib.metadata
import os
import platform
import re
import subprocess
import sys
from collections.abc import Mapping, Sequence
from datetime import datetime, timezone
from pathlib import Path

from kintrack.errors import ResultError
from kintrack.files import write_atomically

ROOT = Path(__file__).resolve().parents[2]
"""Top of the repository."""

RESULTS = ROOT / "docs" / "results.md"
"""Where measured results are told."""

PACKAGES = ("kintrack", "numpy", "scipy", "numba", "pin", "opencv-python-headless",
            "casadi", "openvino", "torch")  # fmt: skip
"""Packages whose versions matter to a measurement."""

_TITLE = "# Results\n\nEach section is written by the command that measures it.\n"


def rewrite_section(path: Path, name: str, body: str) -> None:
    """Replace the section `name` of a Markdown file, or append it; the rest stays as it is.

    Args:
        path: The file; made where missing.
        name: Lower-case letters, digits and hyphens.
        body: Markdown of the section.

    Raises:
        ResultError: if the name is not allowed, a marker stands alone or the file cannot be
            written.
    """
    if not re.fullmatch(r"[a-z0-9-]+", name):
        raise ResultError(f"section name {name!r}: a-z, 0-9 and hyphens are allowed")
    begin, end = f"<!-- begin {name}: generated, do not edit -->", f"<!-- end {name} -->"
    text = path.read_text(encoding="utf-8") if path.is_file() else _TITLE
    if text.count(begin) != text.count(end) or text.count(begin) > 1:
        raise ResultError(f"{path}: needed is one pair of {begin} and {end}, or none")
    block = f"{begin}\n{body.strip()}\n{end}"
    if begin in text:
        head, rest = text.split(begin)
        text = head + block + rest.split(end)[1]
    else:
        text = f"{text.rstrip()}\n\n{block}\n"
    path.parent.mkdir(parents=True, exist_ok=True)
    write_atomically(path, lambda file: file.write(text.encode()))


def table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A Markdown table; the first column is text, the others are set right."""
    rule = ["---", *["---:"] * (len(header) - 1)]
    return "\n".join("| " + " | ".join(row) + " |" for row in (header, rule, *rows))


def conditions(data: str, seeds: str, arguments: Sequence[str] | None = None) -> dict[str, str]:
    """What a measurement depends on, without host names and paths outside the repository.

    Args:
        data: The recordings used, in words.
        seeds: Random seeds, or that there are none.
        arguments: The command line; this process' own if None.

    Returns:
        Name -> value, in the order of printing.
    """
    return {
        "command": command_line(sys.argv if arguments is None else arguments),
        "date": datetime.now(timezone.utc).strftime("%Y-%m-%d"),
        "commit": commit(),
        "machine": f"{cpu_model()}, {cores()} cores, {memory_gib():.0f} GiB of memory",
        "system": operating_system(),
        "versions": ", ".join(f"{name} {version}" for name, version in versions().items()),
        "data": data,
        "seeds": seeds,
    }


def bullets(facts: Mapping[str, str]) -> str:
    """Facts as a Markdown list."""
    return "\n".join(f"- {name}: {value}" for name, value in facts.items())


def command_line(arguments: Sequence[str]) -> str:
    """The command that runs a script of the repository, other places written as `<path>`."""
    script, *rest = arguments
    return " ".join(["python", _inside(script), *map(_inside, rest)])


def commit() -> str:
    """Short hash of the commit, and whether the code differs from it."""
    head = _git("rev-parse", "--short", "HEAD")
    if not head:
        return "unknown"
    return f"{head}, with changes" if _git("status", "--porcelain", "--", "src", "model") else head


def cpu_model() -> str:
    """Name of the processor."""
    try:
        text = Path("/proc/cpuinfo").read_text(encoding="utf-8")
    except OSError:
        return platform.processor() or platform.machine()
    found = re.search(r"^model name\s*:\s*(.+)$", text, flags=re.MULTILINE)
    return found.group(1).strip() if found else platform.machine()


def cores() -> int:
    """Cores this process may run on."""
    if sys.platform == "linux":
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def memory_gib() -> float:
    """Memory of the machine [GiB]; NaN where the system does not say."""
    try:
        return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 2**30
    except (AttributeError, ValueError, OSError):
        return float("nan")


def operating_system() -> str:
    """Name and version of the operating system."""
    try:
        return f"{platform.freedesktop_os_release()['PRETTY_NAME']}, {platform.machine()}"
    except (OSError, KeyError):
        return f"{platform.system()} {platform.release()}, {platform.machine()}"


def versions() -> dict[str, str]:
    """Python's version and that of each of `PACKAGES` that is installed."""
    found = {"python": platform.python_version()}
    for name in PACKAGES:
        try:
            found[name] = importlib.metadata.version(name)
        except importlib.metadata.PackageNotFoundError:
            continue
    return found


def _inside(argument: str) -> str:
    """An argument as it may be published: paths relative to the repository, or hidden."""
    flag, equals, value = argument.rpartition("=")
    path = Path(value)
    if len(path.parts) < 2:
        return argument
    resolved = path.resolve()
    shown = str(resolved.relative_to(ROOT)) if resolved.is_relative_to(ROOT) else "<path>"
    return f"{flag}{equals}{shown}"


def _git(*arguments: str) -> str:
    try:
        done = subprocess.run(
            ["git", *arguments], cwd=ROOT, capture_output=True, text=True, check=True, timeout=20
        )
    except (OSError, subprocess.SubprocessError):
        return ""
    return done.stdout.strip()
