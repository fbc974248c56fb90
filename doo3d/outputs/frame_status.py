"""Read the status of each frame of a run, including failed ones, from the manifest and the journal."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from ..errors import InputError
from ..guard.image_size import announced_size, read_encoded
from ..guard.limits import current_limits
from ..types import Array
from . import JOURNAL, MANIFEST, SUFFIXES
from .journal import Journal
from .run_reader import Results


@dataclass(frozen=True)
class FrameStatus:
    """The outcome of one frame of a run, for videos and reports.

    Attributes
    ----------
    name
        name of the frame.
    error
        the reason why the frame failed; None if it succeeded.
    timestamp
        time of the frame, s; None if the capture has no times.
    seconds
        time that the processing of the frame took, s; None if unknown.
    stages
        name of a processing stage -> time that it took, s; empty if unknown.
    picture
        path of the frame's picture with the chains drawn; None if none was drawn. A failed frame has none.
    """

    name: str
    error: str | None
    timestamp: float | None
    seconds: float | None
    stages: dict[str, float]
    picture: Path | None


def frame_statuses(results: Results) -> list[FrameStatus]:
    """Return the status of every frame of a finished run, failed frames included, in the order of the capture.

    Raises
    ------
    InputError
        the run is not finished, or its manifest is damaged.
    """
    if not results.manifest.get("finished", True):
        raise InputError(
            f"{results.path}: the run is not finished; repeat the same doo3d detect command to resume it", code="run-unfinished"
        )
    journal = {str(line.get("name")): line for line in Journal(results.path / JOURNAL).read()}
    try:
        return [_status(results.path, frame, journal.get(frame["name"], {})) for frame in results.manifest["frames"]]
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise InputError(f"{results.path / MANIFEST}: is damaged or not of doo3d ({error!r})", code="results-damaged") from None


def _status(folder: Path, frame: dict[str, Any], line: dict[str, Any]) -> FrameStatus:
    """Return the status of one frame from its entry in the manifest and its line of the journal."""
    seconds, stamp, kind = line.get("seconds", frame.get("seconds")), frame.get("timestamp"), frame.get("picture")
    return FrameStatus(
        name=str(frame["name"]),
        error=None if frame["status"] == "ok" else str(frame.get("error") or "no reason is given"),
        timestamp=None if stamp is None else float(stamp),
        seconds=None if seconds is None else float(seconds),
        stages={str(stage): float(duration) for stage, duration in (line.get("stages") or {}).items()},
        picture=None if kind is None else folder / f"{frame['name']}{SUFFIXES[kind]}",
    )


def read_picture(path: Path | None) -> Array | None:
    """Read an image file as (H, W, 3) uint8 BGR; None if there is no path, or the file is missing or not an image."""
    if path is None:
        return None
    try:
        data = np.frombuffer(read_encoded(path), np.uint8)
    except InputError:
        return None
    announced = announced_size(data.tobytes())
    if announced is None or announced[0] * announced[1] > current_limits().max_pixels:
        return None
    picture = cv2.imdecode(data, cv2.IMREAD_COLOR)
    return None if picture is None else np.asarray(picture)
