"""Read and write truth files: `truth.json` of a capture, `<name>.truth.json` of a cloud."""

import json
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError
from ..outputs.detection_json import read_object
from ..types import COORDINATES
from .scenes.model import Truth

SCHEMA = "doo3d/truth/1"
AXIS_STRIDE = 2
"""Number of axis points per written point; written points are 1 mm apart."""

DIGITS = 4
"""Number of decimals of coordinates in m: 0.1 mm."""

SPACING = 0.001
"""Distance in m between the points of a resampled axis."""

MAX_COORDINATE = 1e6
"""Greatest coordinate in m; no cable is farther from its camera."""

MAX_STEP_RATIO, MIN_STEP_RATIO = 1.5, 0.5
"""An axis is resampled if a step is longer than MAX_STEP_RATIO times SPACING, or shorter than MIN_STEP_RATIO times the mean
step."""

DEFAULT_COLOR = (200, 40, 40)
"""RGB of a cable without a color."""


def write_truth(path: Path, frames: Mapping[str, tuple[Truth, ...]]) -> None:
    """Write the true cables of each frame to a truth file (JSON, schema doo3d/truth/1).

    Axis points are written about 1 mm apart, rounded to 0.1 mm.

    Parameters
    ----------
    path
        the file to write; an existing one is replaced.
    frames
        name of the frame -> its cables, m, in the camera's optical frame.
    """
    values = {
        "schema": SCHEMA,
        "units": "m",
        "coordinates": COORDINATES["camera"],
        "frames": {name: [_to_dict(truth) for truth in truths] for name, truths in frames.items()},
    }
    path.write_text(json.dumps(values, separators=(",", ":")) + "\n", encoding="utf-8", newline="\n")


def _to_dict(truth: Truth) -> dict[str, Any]:
    index = np.arange(0, len(truth.axis), AXIS_STRIDE)
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
    """Read a truth file: name of the frame -> its true cables, m, in the camera's optical frame.

    The file (JSON) is written by `write_truth` or by hand. A cable needs `axis` and `radius`; without the other fields, it is
    open, seen all along, and of a default color. An axis is resampled every 1 mm along straight lines if its points are more than
    1.5 mm apart or unevenly spaced.

    Raises
    ------
    InputError : the file is missing, not JSON or not of the schema doo3d/truth/1, or a cable is invalid.
    """
    values = read_object(path, (SCHEMA,), "a truth file")
    frames = values.get("frames")
    if not isinstance(frames, dict) or not all(isinstance(cables, list) for cables in frames.values()):
        raise InputError(f"{path}: frames: expected an object with a list of cables by each frame's name", code="truth-invalid")
    return {
        name: tuple(_truth(cable, f"{path}: frame {name}, cable {k}") for k, cable in enumerate(cables))
        for name, cables in frames.items()
    }


def _truth(values: Any, where: str) -> Truth:
    """Return a cable from its JSON object; `where` names it in errors."""
    try:
        axis, radius = np.array(values["axis"], dtype=float), float(values["radius"])
        red, green, blue = (int(value) for value in values.get("color", DEFAULT_COLOR))
        seen = np.array(values.get("seen", np.ones(len(axis))), dtype=bool)
        closed = bool(values.get("closed", False))
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise InputError(
            f"{where}: expected axis and radius, and perhaps closed, color and seen ({error!r})", code="truth-invalid"
        ) from None
    is_usable = axis.ndim == 2 and axis.shape[1] == 3 and len(axis) >= 2 and bool((np.abs(axis) < MAX_COORDINATE).all())
    if not is_usable or seen.shape != (len(axis),):
        raise InputError(
            f"{where}: axis {axis.shape}, seen {seen.shape}, expected (P, 3) below 1e6 m, P >= 2, and (P,)", code="truth-invalid"
        )
    if not 0 < radius < np.inf:
        raise InputError(f"{where}: radius {radius:g}, expected metres above 0", code="truth-invalid")
    truth = Truth(axis, radius, closed, (red, green, blue), seen)
    if truth.length == 0:
        raise InputError(f"{where}: all points of the axis are the same, expected different ones", code="truth-invalid")
    return _evenly_sampled(truth)


def _evenly_sampled(truth: Truth) -> Truth:
    """Return the cable with axis points about SPACING apart, resampled if they are not."""
    steps = np.diff(truth.arcs)
    inner = steps[:-1] if len(steps) > 1 else steps  # the last one is the remainder
    if truth.closed:
        steps = np.append(steps, truth.length - truth.arcs[-1])
    if steps.max() <= MAX_STEP_RATIO * SPACING and inner.min() >= MIN_STEP_RATIO * inner.mean():
        return truth
    arcs, seen = truth.arcs, np.asarray(truth.seen)
    if truth.closed:
        arcs, seen = np.append(arcs, truth.length), np.append(seen, seen[:1])
    even = np.linspace(0, truth.length, max(int(np.ceil(truth.length / SPACING)), 2) + 1)[: -1 if truth.closed else None]
    nearest = np.round(np.interp(even, arcs, np.arange(len(arcs)))).astype(int)
    points = np.column_stack([np.interp(even, arcs, column) for column in truth.line.T])
    return replace(truth, axis=points, seen=seen[nearest])
