"""Truth beside data: `truth.json` of a capture, `<name>.truth.json` of a cloud."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError
from ..types import COORDINATES
from .model import Truth

SCHEMA = "doo3d/truth/1"
EVERY = 2  # axis points to one that is written: 1 mm
DIGITS = 4  # of metres: 0.1 mm


def write_truth(path: Path, frames: Mapping[str, tuple[Truth, ...]]) -> None:
    """The cables of each frame by the frame's name, axis points rounded to 0.1 mm at about 1 mm spacing."""
    values = {
        "schema": SCHEMA,
        "units": "m",
        "coordinates": COORDINATES["camera"],
        "frames": {name: [_plain(truth) for truth in truths] for name, truths in frames.items()},
    }
    path.write_text(json.dumps(values, separators=(",", ":")) + "\n", encoding="utf-8", newline="\n")


def _plain(truth: Truth) -> dict[str, Any]:
    index = np.arange(0, len(truth.axis), EVERY)
    if not truth.closed:
        index = np.unique(np.append(index, len(truth.axis) - 1))
    seen = np.ones(len(truth.axis), dtype=bool) if truth.seen is None else truth.seen
    return {
        "radius": round(truth.radius, 5),
        "closed": truth.closed,
        "color": list(truth.color),
        "axis": np.round(truth.axis[index], DIGITS).tolist(),
        "seen": seen[index].astype(int).tolist(),
    }


def read_truth(path: str | Path) -> dict[str, tuple[Truth, ...]]:
    """What `write_truth` wrote: frame name -> cables.

    Raises
    ------
    InputError : not there, not JSON, or not of this schema.
    """
    try:
        values = json.loads(Path(path).read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror})") from None
    except ValueError as error:
        raise InputError(f"{path}: is not valid JSON ({error})") from None
    if not isinstance(values, dict) or values.get("schema") != SCHEMA:
        raise InputError(f"{path}: is not a truth file: expected an object with schema {SCHEMA!r}")
    try:
        return {name: tuple(_truth(cable) for cable in cables) for name, cables in values["frames"].items()}
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise InputError(f"{path}: frames: expected radius, closed, color, axis and seen of each cable ({error!r})") from None


def _truth(values: dict[str, Any]) -> Truth:
    red, green, blue = (int(value) for value in values["color"])
    axis, seen = np.array(values["axis"], dtype=float), np.array(values["seen"], dtype=bool)
    if axis.ndim != 2 or axis.shape[1] != 3 or seen.shape != (len(axis),):
        raise ValueError(f"axis {axis.shape}, seen {seen.shape}, expected (P, 3) and (P,)")
    return Truth(axis, float(values["radius"]), bool(values["closed"]), (red, green, blue), seen)
