"""Which frames of an interrupted run are finished, so that repeating the command does only the others."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from . import SUFFIXES


def finished_frames(folder: Path, lines: Sequence[dict[str, Any]], names: Sequence[str]) -> dict[str, dict[str, Any]]:
    """Return the finished frames at the start of a run: name -> line of the journal.

    A frame is finished when the journal has its line and, unless the frame failed, all its files exist. The first frame that is
    not finished ends the list: results are written in order.

    Parameters
    ----------
    folder
        of the run.
    lines
        of the journal, one dict per frame with `name` and `status`.
    names
        of all frames, in order.
    """
    by_name = {line.get("name"): line for line in lines}
    finished: dict[str, dict[str, Any]] = {}
    for name in names:
        line = by_name.get(name)
        if line is None:
            break
        files = [folder / f"{name}{suffix}" for suffix in SUFFIXES.values()]
        if line["status"] == "ok" and not all(file.exists() for file in files):
            break
        finished[name] = line
    return finished
