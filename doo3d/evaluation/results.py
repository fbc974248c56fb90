"""Results that are on the disk already, scored: the folder that `doo3d detect` wrote."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError
from ..types import COORDINATES, SCHEMA, Chain, Connection, Crossing, Detection, Place
from .rows import Row
from .score import score
from .truthfile import read_truth


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
        raise InputError(f"{folder}: has a result for none of the frames that {truth} knows ({_some(list(frames))})")
    rows = []
    for name, truths in frames.items():
        there = paths[name].exists()
        found = read_detection(paths[name]) if there else Detection(())
        crossings = found.crossings if found.coordinates == "camera" else None
        seconds = sum(found.seconds.values()) if there else float("nan")
        error = None if there else "no result"
        family = folder.resolve().name
        rows.append(Row(name, family, score(found.chains, truths, crossings), seconds, error, found.sure, found))
    return rows


def read_detection(path: str | Path) -> Detection:
    """What `doo3d detect` wrote of one frame, in 3-D.

    Raises
    ------
    InputError : not there, not JSON, of another schema, of the 2-D mode, or damaged.
    """
    try:
        values = json.loads(Path(path).read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror})") from None
    except ValueError as error:
        raise InputError(f"{path}: is not valid JSON ({error})") from None
    if not isinstance(values, dict) or values.get("schema") != SCHEMA:
        raise InputError(f"{path}: is not a detection: expected an object with schema {SCHEMA!r}")
    if values.get("mode") != "3d":
        raise InputError(f"{path}: is of the 2-D mode, the truth is in 3-D")
    try:
        return _detection(values)
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise InputError(f"{path}: something is missing or broken in it ({error!r})") from None


def _detection(values: dict[str, Any]) -> Detection:
    names = {text: key for key, text in COORDINATES.items()}
    return Detection(
        tuple(_chain(chain) for chain in values["chains"]),
        coordinates=names[values["coordinates"]],
        frame=str(values["frame"]),
        seconds={stage: float(taken) for stage, taken in values.get("seconds", {}).items()},
        crossings=tuple(_crossing(crossing) for crossing in values.get("crossings", ())),
    )


def _chain(values: dict[str, Any]) -> Chain:
    joints = np.array(values["joints"], dtype=float)
    if joints.ndim != 2 or joints.shape[1] != 3 or not np.isfinite(joints).all():
        raise ValueError(f"joints {joints.shape}, expected (N + 1, 3), finite")
    return Chain(
        joints,
        float(values["segment_length"]),
        float("nan") if values["radius"] is None else float(values["radius"]),
        occluded=np.array(values["occluded"], dtype=bool),
        closed=bool(values["closed"]),
        connections=tuple(Connection(int(item["segment"]), float(item["sure"])) for item in values.get("connections", ())),
    )


def _crossing(values: dict[str, Any]) -> Crossing:
    upper, lower = (Place(int(values[side]["chain"]), int(values[side]["segment"])) for side in ("upper", "lower"))
    return Crossing(upper, lower, np.array(values["point"], dtype=float), float(values["sure"]))


def _some(names: list[str]) -> str:
    return ", ".join(names[:3]) + (", ..." if len(names) > 3 else "")
