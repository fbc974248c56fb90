"""Read predictions: `<frame>.json` with points of chains, `<frame>.png` with instance labels, and the results of doo3d."""

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import InputError
from ...guard.parsing import read_json
from ...kernels import lay_equal_chords
from ...outputs.run_reader import read_detection
from ...types import Chain, Detection, Floats, Ints
from ..benchmark.cases import Case
from ..photos.datasets import decode_image

ENDINGS = (".json", ".instances.png", ".png")
"""Endings of the files of a frame; a frame may have chains (.json) and instance labels (one of the others)."""

MAX_STEP = {2: 5.0, 3: 0.005}
"""Dimension -> greatest segment length of a resampled chain: 5 px, 5 mm. A coarse line is followed at its corners, too."""

MAX_COORDINATE = {2: 1e5, 3: 100.0}
"""Dimension -> greatest coordinate: 100,000 px, and 100 m, beyond which points must be in mm."""

SHORTER = (1.0, 0.998, 0.995, 0.99, 0.98, 0.95, 0.9)
"""Factors of the segment length of a resampled chain, tried in order until its chords reach the end of the line."""

EQUAL = 1e-6
"""Greatest relative difference of segments that count as equal: that of `Chain`."""


@dataclass(frozen=True)
class Prediction:
    """What a program predicts for one frame.

    Attributes
    ----------
    detection
        the chains, px in 2-D, m in the camera's optical frame in 3-D; None if the frame has instance labels only.
    labels
        (H, W) int, the number of the instance at each pixel, 0 for none; None if the frame has chains only.
    ms
        duration of the prediction in ms; NaN if unknown.
    """

    detection: Detection | None
    labels: Ints | None
    ms: float


def prediction_files(folder: Path, cases: Sequence[Case]) -> dict[tuple[str, str], list[Path]]:
    """Return the files of each case's prediction, by the family and the name of the case; an empty list if there are none.

    The files are `<family>/<name>` with one of ENDINGS. The family, and the folders in the name, may be left out where no other
    case has the rest.

    Raises
    ------
    InputError : the folder is missing, or has a file for none of the cases.
    """
    if not folder.is_dir():
        raise InputError(f"{folder}: there is no such folder: give the folder of the predictions", code="file-missing")
    short = Counter(Path(case.name).name for case in cases) + Counter(case.name for case in cases if "/" in case.name)
    found = {}
    for case in cases:
        names = [f"{case.family}/{case.name}", *(name for name in (case.name, Path(case.name).name) if short[name] == 1)]
        each = [[path for ending in ENDINGS if (path := folder / f"{name}{ending}").is_file()] for name in names]
        found[case.family, case.name] = next(filter(None, each), [])
    if not any(found.values()):
        first = cases[0].name if "/" in cases[0].name else f"{cases[0].family}/{cases[0].name}"
        raise InputError(
            f"{folder}: has no file for any of the {len(cases)} frames: expected {first}.json or {first}.png",
            code="predictions-missing",
        )
    return found


def outcome(paths: Sequence[Path]) -> dict[str, str | None]:
    """Return the values error and code of a frame's record, from the files of its prediction: an error if there are none."""
    return {"error": None, "code": None} if paths else {"error": "no prediction", "code": "predictions-missing"}


def read_prediction(paths: Sequence[Path], dim: int, shape: tuple[int, ...] | None = None) -> Prediction:
    """Read the prediction of one frame.

    Parameters
    ----------
    paths
        the files of the frame, at least one.
    dim
        2 for points in px, 3 for points in m.
    shape
        (height, width) that instance labels must have; None leaves them unread.

    Raises
    ------
    InputError : a file cannot be read, has another dimension or size, or has values that are not valid.
    """
    detection, ms = None, math.nan
    if paths[0].suffix == ".json":
        detection, ms = _read_chains(paths[0], dim)
    images = [path for path in paths if path.suffix != ".json"]
    labels = _read_labels(images[0], shape) if images and shape is not None else None
    if detection is None and labels is None:
        raise InputError(
            f"{paths[0]}: is an image, and the truth is in 3-D: give chains in a .json file", code="prediction-invalid"
        )
    return Prediction(detection, labels, ms)


def _read_chains(path: Path, dim: int) -> tuple[Detection, float]:
    """Return the chains of a JSON file, of this project or neutral, and their duration in ms."""
    values, mode = read_json(path), "2d" if dim == 2 else "3d"
    if isinstance(values, dict) and "schema" in values:
        detection = read_detection(path).in_camera()
        if detection.mode != mode:
            raise InputError(f"{path}: is of the {detection.mode} mode, the truth is in {dim}-D", code="prediction-invalid")
        return detection, 1e3 * sum(detection.seconds.values()) if detection.seconds else math.nan
    chains = values.get("chains") if isinstance(values, dict) else None
    if not isinstance(chains, list):
        raise InputError(f'{path}: expected {{"chains": [{{"points": [[...]], "radius": r}}]}}', code="prediction-invalid")
    ms = values.get("ms")
    read = tuple(_chain(chain, dim, f"{path}: chain {k}") for k, chain in enumerate(chains))
    is_time = isinstance(ms, int | float) and ms >= 0
    return Detection(read, mode, "image" if dim == 2 else "camera"), float(ms) if is_time else math.nan


def _chain(values: Any, dim: int, where: str) -> Chain:
    """Return a chain from its JSON object; `where` names it in errors."""
    try:
        points = np.array(values["points"], dtype=float)
        radius = np.array(math.nan if values.get("radius") is None else values["radius"], dtype=float)
        closed = bool(values.get("closed", False))
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise InputError(
            f"{where}: expected points, and perhaps radius and closed ({error!r})", code="prediction-invalid"
        ) from None
    if points.ndim != 2 or points.shape[1] != dim or len(points) < 2 or not np.isfinite(points).all():
        raise InputError(
            f"{where}: points have shape {points.shape}, expected finite numbers (P, {dim}), P >= 2", code="prediction-invalid"
        )
    if np.abs(points).max() > MAX_COORDINATE[dim]:
        unit = "px" if dim == 2 else "metres"
        raise InputError(f"{where}: has the coordinate {np.abs(points).max():g}, expected {unit}", code="prediction-invalid")
    if radius.shape not in ((), (len(points),)) or (radius <= 0).any():
        raise InputError(f"{where}: radius must be above 0: one number, or one for each point", code="prediction-invalid")
    if closed and not np.array_equal(points[0], points[-1]):
        points, radius = np.vstack((points, points[:1])), radius if radius.ndim == 0 else np.append(radius, radius[0])
    if not np.linalg.norm(np.diff(points, axis=0), axis=1).any():
        raise InputError(f"{where}: all points are the same, expected different ones", code="prediction-invalid")
    return equal_chain(points, radius, closed)


def equal_chain(points: Floats, radius: Floats, closed: bool = False) -> Chain:
    """Return the chain of equal segments along a line of points.

    Points that are equally far apart are kept. Others are resampled at their mean distance, at most 5 px or 5 mm.

    Parameters
    ----------
    points
        (P, D) px in 2-D, m in 3-D; not all the same.
    radius
        () or (P,), the radius of the whole line, or at each point; NaN if unknown.
    closed
        whether the line is a ring, whose last point repeats the first.
    """
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    length, middle = float(steps.sum()), float(np.median(radius))
    segment = length / len(steps)
    if (np.abs(steps - segment) <= EQUAL / 2 * segment).all():
        return Chain(points, segment, middle, radius if radius.ndim else np.zeros(0), closed=closed)
    count = max(1, math.ceil(length / min(segment, MAX_STEP[points.shape[1]])))
    for shorter in SHORTER:
        segment = shorter * length / count
        joints = lay_equal_chords(points, segment)[0]
        if len(joints) > count:
            break
    if len(joints) < 2:
        joints = np.array((points[0], points[0] + segment * np.eye(points.shape[1])[0]))
    radii = np.zeros(0)
    if radius.ndim:
        radii = np.interp(np.linspace(0, length, len(joints)), np.append(0.0, np.cumsum(steps)), radius)
    return Chain(joints, segment, middle, radii, closed=closed and bool(np.allclose(joints[0], joints[-1])))


def _read_labels(path: Path, shape: tuple[int, ...]) -> Ints:
    """Read instance labels from an image of 8 or 16 bit, (H, W) int; the numbers of instances may have gaps."""
    labels = decode_image(path)
    if labels.ndim != 2 or labels.dtype not in (np.uint8, np.uint16):
        raise InputError(
            f"{path}: has shape {labels.shape} and type {labels.dtype}, expected the number of the instance "
            "at each pixel, 0 for none, in one channel of 8 or 16 bit",
            code="prediction-invalid",
        )
    if labels.shape != shape:
        raise InputError(
            f"{path}: is {labels.shape[1]}x{labels.shape[0]}, the labels are {shape[1]}x{shape[0]}: they must be equal",
            code="label-size",
        )
    return labels.astype(int)
