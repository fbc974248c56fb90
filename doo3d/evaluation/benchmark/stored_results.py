"""Results that are on the disk already, scored: the folder that `doo3d detect` wrote."""

from __future__ import annotations

from pathlib import Path

from ...errors import InputError
from ...outputs.run_reader import read_detection
from ...types import Detection
from ..metrics.score import score
from ..truth_file import read_truth
from .rows import Row


def result_rows(folder: str | Path, truth: str | Path) -> list[Row]:
    """The score of every frame that the truth knows; one without a result counts as one in which nothing was found.

    Parameters
    ----------
    folder : with a <frame>.json of schema doo3d/detection/1 for each frame. truth : a file as `write_truth` writes it.

    Raises
    ------
    InputError : one of them cannot be read, is of another kind, or there is a result for none of the frames.
    """
    folder, frames = Path(folder), read_truth(truth)
    paths = {name: folder / f"{name}.json" for name in frames}
    if not any(path.exists() for path in paths.values()):
        raise InputError(
            f"{folder}: has a result for none of the frames that {truth} knows ({_some(list(frames))})", code="results-missing"
        )
    rows = []
    for name, truths in frames.items():
        there = paths[name].exists()
        found = _in_3d(paths[name]) if there else Detection(())
        crossings = found.crossings if found.coordinates == "camera" else None
        seconds = sum(found.seconds.values()) if found.seconds else float("nan")
        error = None if there else "no result"
        family = folder.resolve().name
        rows.append(Row(name, family, score(found.chains, truths, crossings), seconds, error, found.confidence, found))
    return rows


def _in_3d(path: Path) -> Detection:
    found = read_detection(path)
    if found.mode != "3d":
        raise InputError(f"{path}: is of the 2-D mode, the truth is in 3-D", code="results-2d")
    return found


def _some(names: list[str]) -> str:
    return ", ".join(names[:3]) + (", ..." if len(names) > 3 else "")
