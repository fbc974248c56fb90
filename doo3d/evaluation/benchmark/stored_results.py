"""Score results on disk: the folder that `doo3d detect` wrote."""

from __future__ import annotations

from functools import partial
from pathlib import Path

from ...errors import InputError
from ...outputs.run_reader import read_detection
from ...types import Detection
from ..metrics.record import Record
from ..metrics.score import score
from ..truth_file import read_truth
from .cases import Case


def result_rows(folder: str | Path, truth: str | Path) -> list[Record]:
    """Return a record for each frame of a truth file, scored from the results that `doo3d detect` wrote.

    A frame without a result counts as one without chains, with the error "no result".

    Parameters
    ----------
    folder
        folder of the results, with a detection `<frame>.json` for each frame; its name becomes the family of the records.
    truth
        the truth file (schema doo3d/truth/1).

    Raises
    ------
    InputError : the truth or a result cannot be read, or is not such a file; a result is of the 2-D mode; no frame has a result.
    """
    folder, frames = Path(folder), read_truth(truth)
    paths = {name: folder / f"{name}.json" for name in frames}
    if not any(path.exists() for path in paths.values()):
        raise InputError(
            f"{folder}: has a result for none of the frames that {truth} names ({_first_names(list(frames))})",
            code="results-missing",
        )
    rows = []
    for name, truths in frames.items():
        missing = not paths[name].exists()
        detection = Detection(()) if missing else _read_3d(paths[name])
        crossings = detection.crossings if detection.coordinates == "camera" else None
        frame_score = score(detection.chains, truths, crossings)
        ms = 1e3 * sum(detection.seconds.values()) if detection.seconds else float("nan")
        error, code = ("no result", "results-missing") if missing else (None, None)
        end = {"confidence": detection.confidence or 0.0, "ms": ms, "error": error, "code": code}
        rows.append(Case(name, folder.resolve().name, partial(_read_3d, paths[name])).record(frame_score | end))
    return rows


def _read_3d(path: Path) -> Detection:
    detection = read_detection(path).in_camera()
    if detection.mode != "3d":
        raise InputError(f"{path}: is of the 2-D mode, the truth is in 3-D: detect with a 3-D config", code="results-2d")
    return detection


def _first_names(names: list[str]) -> str:
    return ", ".join(names[:3]) + (", ..." if len(names) > 3 else "")
