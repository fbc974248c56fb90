"""What is said of each frame of a run, failed ones too: manifest and journal together."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from ..errors import InputError
from ..types import Array
from . import SUFFIXES
from .journal import Journal
from .run_folder import JOURNAL, MANIFEST
from .run_reader import Results


@dataclass(frozen=True)
class Told:
    """One frame. error : why it failed; None where it did not. seconds, stages : what it took, s; None and empty where that
    is not known any more. picture : the file of its picture, which may be gone."""

    name: str
    error: str | None
    timestamp: float | None
    seconds: float | None
    stages: dict[str, float]
    picture: Path


def told(results: Results) -> list[Told]:
    """Every frame of a finished run, in order.

    Raises
    ------
    InputError : the run is not finished, or the manifest is damaged.
    """
    if not results.manifest.get("finished", True):
        raise InputError(
            f"{results.path}: the run is not finished; the same doo3d detect goes on where it was", code="run-unfinished"
        )
    journal = {str(line.get("name")): line for line in Journal(results.path / JOURNAL).read()}
    try:
        return [_told(results.path, frame, journal.get(frame["name"], {})) for frame in results.manifest["frames"]]
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise InputError(f"{results.path / MANIFEST}: is damaged or not of doo3d ({error!r})", code="results-damaged") from None


def _told(folder: Path, frame: dict[str, Any], line: dict[str, Any]) -> Told:
    seconds, stamp = line.get("seconds", frame.get("seconds")), frame.get("timestamp")
    return Told(
        name=str(frame["name"]),
        error=None if frame["status"] == "ok" else str(frame.get("error") or "no reason is given"),
        timestamp=None if stamp is None else float(stamp),
        seconds=None if seconds is None else float(seconds),
        stages={str(stage): float(taken) for stage, taken in (line.get("stages") or {}).items()},
        picture=folder / f"{frame['name']}{SUFFIXES['overlay']}",
    )


def read_picture(path: Path) -> Array | None:
    """(H, W, 3) uint8 BGR; None where there is none, or none that can be read."""
    try:
        data = np.frombuffer(path.read_bytes(), np.uint8)
    except OSError:
        return None
    picture = cv2.imdecode(data, cv2.IMREAD_COLOR) if len(data) else None
    return None if picture is None else np.asarray(picture)
