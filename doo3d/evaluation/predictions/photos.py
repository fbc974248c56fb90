"""Score predictions in labelled photographs: the scores of `doo3d evaluate dataset`, crossings and runs."""

from functools import partial
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from ...errors import InputError
from ...types import Bools, Detection, Ints
from ..benchmark.cases import Case
from ..benchmark.run import Benchmark
from ..metrics.record import Column, Record, amount, failures, number, parts, share
from ..metrics.run_length import RUN_LENGTH, run_squares
from ..photos import datasets
from ..photos.datasets import MIN_CABLE_PIXELS, Photo
from ..photos.evaluate import PHOTO_COLUMNS, caption, photo_panels
from ..photos.score import BRIDGE_PX, dice_of, drawn_pixels, match_of, score_photo
from .files import Prediction, outcome, read_prediction

MARGIN_PX = 5
"""Width in px of the surroundings in which a cable must be on two sides of another one, to lie under it."""

COLUMNS: tuple[Column, ...] = (
    *PHOTO_COLUMNS[:4],
    share(("upper", "strand"), 15, "crossings", parts("crossings", right="crossings_correct")),
    RUN_LENGTH,
    number(("time", "ms"), 7, "ms", 1),
    amount(("", "missing"), 7, "errors", failures),
)
"""Columns: as of `doo3d evaluate dataset`; upper strand at crossings; expected run length in %; median time; missing frames."""


def photo_cases(folder: Path) -> list[Case]:
    """Return the photographs of a folder in one of the two layouts of `doo3d evaluate dataset`: mbest or cset.

    In the layout cset, each cable has a color in the label images; in the layout mbest, a number.
    """
    for root in (folder, folder / "data"):
        labels = sorted(path for kind in ("labels", "test_labels") for path in (root / kind).glob("*.png"))
        if labels and datasets.decode_image(labels[0]).ndim == 3:
            return datasets.cset(folder)
    return datasets.mbest(folder)


def photo_benchmark(files: dict[tuple[str, str], list[Path]]) -> Benchmark:
    """Return the benchmark of predictions in photographs; `files` are those of `prediction_files`."""
    measure = partial(measure_photo, files=files)
    return Benchmark(measure, COLUMNS, photo_panels, caption, lambda row: -np.nan_to_num(row.drawn) - row.instances)


def measure_photo(case: Case, files: dict[tuple[str, str], list[Path]]) -> list[Record]:
    """Read the prediction of a photograph, and return its record; a missing one is scored as empty and counts as an error."""
    photo: Photo = case.load()
    paths, shape = files[case.family, case.name], photo.labels.shape
    if paths:
        prediction = read_prediction(paths, 2, shape)
        _check_view(prediction.detection, shape, paths[0])
    else:
        prediction = Prediction(None, np.zeros(shape, dtype=int), float("nan"))
    values = score_prediction(prediction, photo.labels)
    return [case.record(values | {"ms": prediction.ms} | outcome(paths), prediction.detection or Detection(()))]


def _check_view(detection: Detection | None, shape: tuple[int, ...], path: Path) -> None:
    view = detection and detection.view
    if view and (view.height, view.width) != shape:
        raise InputError(
            f"{path}: is of an image of {view.width}x{view.height}, the labels are {shape[1]}x{shape[0]}: they must be equal",
            code="label-size",
        )


def score_prediction(prediction: Prediction, labels: Ints) -> Record:
    """Score a prediction against the labels of a photograph.

    Without instance labels, the chains are drawn with their widths, the last one on top. Without chains, `drawn` is unknown.

    Parameters
    ----------
    prediction
        chains in px, instance labels, or both.
    labels
        (H, W) int: i from 1 at the pixels that show cable i, 0 for background.

    Returns
    -------
    Record
        the values of `score_photo`; `crossings` and `crossings_correct`, places where the labels show one cable over another, and
        those where the instance on top is the upper cable's; `run_squares` and `cable_squares`, see `run_squares`, in px.
    """
    detection, numbers = prediction.detection, prediction.labels
    if detection is not None and numbers is None:
        numbers = _painted(detection, labels.shape)
    assert numbers is not None
    known = np.unique(numbers[numbers > 0])
    cables = int(labels.max(initial=0))
    instances, match = match_of(dice_of(labels, cables, [labels[numbers == each] for each in known]))
    values: dict[str, Any] = {"cables": cables, "chains": len(known), "correct": cables == len(known), "drawn": float("nan")}
    values["match"] = match.tolist()
    if detection is not None:
        values = dict(score_photo(detection, labels, numbers))
    of_cable = np.array([known[each] if each >= 0 else 0 for each in match], dtype=int)
    places = label_crossings(labels)
    right = sum(_is_upper(numbers[place], of_cable[upper - 1], of_cable[lower - 1]) for upper, lower, place in places)
    runs = zip(("run_squares", "cable_squares"), run_squares(_along(labels, cables, numbers), [1.0] * cables), strict=True)
    return Record(values | {"instances": instances, "crossings": len(places), "crossings_correct": right} | dict(runs))


def _painted(detection: Detection, shape: tuple[int, ...]) -> Ints:
    numbers = np.zeros(shape, dtype=int)
    for k, chain in enumerate(detection.chains, start=1):
        numbers[drawn_pixels(chain, (shape[0], shape[1]))] = k
    return numbers


def label_crossings(labels: Ints) -> list[tuple[int, int, Bools]]:
    """Return the places where labels show a cable over another: numbers of the upper and the lower one, and (H, W) bool pixels.

    The lower cable must be on both sides of the upper one, at most 41 px apart. Crossings of a cable with itself are not in the
    labels.
    """
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (BRIDGE_PX, BRIDGE_PX))
    around, found = np.ones((2 * MARGIN_PX + 1,) * 2, np.uint8), []
    for lower in range(1, int(labels.max(initial=0)) + 1):
        pixels = np.pad((labels == lower).astype(np.uint8), BRIDGE_PX)
        closed = cv2.morphologyEx(pixels, cv2.MORPH_CLOSE, disc)[BRIDGE_PX:-BRIDGE_PX, BRIDGE_PX:-BRIDGE_PX] > 0
        for upper in np.unique(labels[closed & (labels > 0) & (labels != lower)]):
            count, regions = cv2.connectedComponents((closed & (labels == upper)).astype(np.uint8))
            for place in (regions == region for region in range(1, count)):
                beside = (cv2.dilate(place.astype(np.uint8), around) > 0) & (labels == lower)
                sides = cv2.connectedComponentsWithStats(beside.astype(np.uint8))[2][1:, cv2.CC_STAT_AREA]
                if (sides >= MIN_CABLE_PIXELS).sum() >= 2:
                    found.append((int(upper), lower, place))
    return found


def _is_upper(numbers: Ints, upper: int, lower: int) -> bool:
    """Return whether both cables have an instance, and more pixels of their crossing have the number of the upper one's."""
    return bool(upper > 0 and lower > 0 and (numbers == upper).sum() > (numbers == lower).sum())


def _along(labels: Ints, cables: int, numbers: Ints) -> list[Ints]:
    """Return the instance at each center pixel of each cable, 0 for none; an instance counts only where it covers most."""
    result = []
    covered = np.array(
        [np.bincount(numbers[labels == cable], minlength=numbers.max(initial=0) + 1) for cable in range(1, cables + 1)]
    )
    for cable in range(1, cables + 1):
        depth = cv2.distanceTransform(np.pad((labels == cable).astype(np.uint8), 1), cv2.DIST_L2, 5)
        ridge = ((depth > 0) & (depth >= cv2.dilate(depth, np.ones((3, 3), np.uint8))))[1:-1, 1:-1]
        along = numbers[ridge]
        result.append(np.where(covered.argmax(axis=0)[along] == cable - 1, along, 0))
    return result
