"""Truth beside data: `truth.json` of a capture, `<name>.truth.json` of a cloud."""

from __future__ import annotations

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
EVERY = 2  # axis points to one that is written: 1 mm
DIGITS = 4  # of metres: 0.1 mm
SPACING = 0.001  # m between the points of an axis that is laid anew
COARSE, UNEVEN = 1.5, 0.5  # of SPACING: longer steps are; of the mean step: shorter ones are, and it is laid anew
PLAIN = (200, 40, 40)  # the colour of a cable that names none


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
    """What `write_truth` wrote, or somebody by hand: frame name -> cables.

    Of a cable, `axis` and `radius` are needed; it is open, seen all along, and of no colour in particular where the file does
    not say. An axis whose points are farther or less evenly apart than ours is laid anew at 1 mm, straight from point to point.

    Raises
    ------
    InputError : not there, not JSON, not of this schema, or a cable is not one.
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
    try:
        axis, radius = np.array(values["axis"], dtype=float), float(values["radius"])
        red, green, blue = (int(value) for value in values.get("color", PLAIN))
        seen = np.array(values.get("seen", np.ones(len(axis))), dtype=bool)
        closed = bool(values.get("closed", False))
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise InputError(
            f"{where}: expected axis and radius, and perhaps closed, color and seen ({error!r})", code="truth-invalid"
        ) from None
    if axis.ndim != 2 or axis.shape[1] != 3 or len(axis) < 2 or seen.shape != (len(axis),) or not np.isfinite(axis).all():
        raise InputError(
            f"{where}: axis {axis.shape}, seen {seen.shape}, expected (P, 3), finite, P >= 2, and (P,)", code="truth-invalid"
        )
    if not 0 < radius < np.inf:
        raise InputError(f"{where}: radius {radius:g}, expected metres above 0", code="truth-invalid")
    truth = Truth(axis, radius, closed, (red, green, blue), seen)
    if truth.length == 0:
        raise InputError(f"{where}: all points of the axis are one", code="truth-invalid")
    return _even(truth)


def _even(truth: Truth) -> Truth:
    """The same cable with points that are evenly apart, about SPACING, where they are not."""
    steps = np.diff(truth.arcs)
    inner = steps[:-1] if len(steps) > 1 else steps  # the last one is what was left
    if truth.closed:
        steps = np.append(steps, truth.length - truth.arcs[-1])
    if steps.max() <= COARSE * SPACING and inner.min() >= UNEVEN * inner.mean():
        return truth
    axis, along, seen = truth.axis, truth.arcs, np.asarray(truth.seen)
    if truth.closed:
        axis, along, seen = np.vstack((axis, axis[:1])), np.append(along, truth.length), np.append(seen, seen[:1])
    at = np.linspace(0, truth.length, max(int(np.ceil(truth.length / SPACING)), 2) + 1)[: -1 if truth.closed else None]
    nearest = np.round(np.interp(at, along, np.arange(len(along)))).astype(int)
    return replace(truth, axis=np.column_stack([np.interp(at, along, axis[:, k]) for k in range(3)]), seen=seen[nearest])
