"""Which frames of an interrupted run are finished, so that repeating the command does only the others."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from . import SUFFIXES


def finished_frames(folder: Path, lines: Sequence[dict[str, Any]], names: Sequence[str]) -> dict[str, dict[str, Any]]:
    """Return the frames that an interrupted run has finished, as a dict frame name -> line of the journal.

    A frame is finished if the journal has a line for it and, unless the frame failed, all its files exist. The result ends before
    the first of `names` that is not finished, since results are written in order.

    Parameters
    ----------
    folder
        folder of the run's results.
    lines
        lines of the run's journal, one dict per frame with at least "name" and "status" ("ok" or "failed").
    names
        names of all frames of the run, in order.
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
