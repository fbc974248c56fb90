"""Run the detection over frames with known truth, and score it; or score the results that `doo3d detect` wrote."""

import math
import time
from functools import partial
from pathlib import Path
from typing import Any, Literal

import cv2
import numpy as np

from ...config import Config, HsvRange
from ...errors import ConfigError, DooError, InputError, error_code
from ...outputs.run_reader import read_detection
from ...types import Bools, Detection, Frame
from ..metrics.record import Record
from ..metrics.score import COLUMNS, score
from ..rendering.ragged_mask import ragged_mask
from ..scenes.model import Color, Truth
from ..scenes.registry import family_rng
from ..truth_file import read_truth
from .cases import Case, KnownFrame
from .pictures import UNREADABLE, frame_caption, frame_panels
from .run import Benchmark

Masking = Literal["mask", "ragged", "hsv", "auto"]

HUE_HALF_WIDTH, MIN_SATURATION, MIN_VALUE = 10, 90, 25
"""HSV box around a cable's color, in OpenCV's 8-bit units: half its width in hue, least saturation, least value."""


def frame_benchmark(config: Config, known_count: bool = True, method: Masking = "mask") -> Benchmark:
    """Return the benchmark of single frames.

    If a frame cannot be read, or the detection fails in it, the frame counts as wrong and its record holds the error.

    Parameters
    ----------
    config
        the configuration of the detection, with a 3-D mode; for frames without cables, 2-D modes are allowed.
    known_count
        True gives the detection the true number of cables; False lets it decide from the data.
    method
        how the cables are segmented. "mask": by the case's true mask, unless the config names another method than auto or mask.
        "ragged": the same, by the true mask with ragged edges from `ragged_mask`, which are equal in every call.
        "hsv": by HSV boxes around the cables' true colors. "auto": by the method of the config, without the true mask.
    """
    measure = partial(measure_frame, config=config, known_count=known_count, method=method)
    return Benchmark(measure, COLUMNS, frame_panels, frame_caption, frame_badness)


def measure_frame(case: Case, config: Config, known_count: bool, method: Masking) -> list[Record]:
    """Read a case, run the detection in it, and return its record; arguments are as for `frame_benchmark`."""
    try:
        known = case.load()
    except InputError as error:
        return [unreadable(case, error)]
    return [detect_case(case, known, config, known_count, method)]


def unreadable(case: Case, error: DooError) -> Record:
    """Return the record of a case whose frame cannot be read: scored without chains, and wrong even if the frame holds no cable.

    Parameters
    ----------
    case
        the case; its `truths` count as not detected.
    error
        the reason; its message and its code are stored in the record.
    """
    wrong = {"correct": False, "reasons": (UNREADABLE,)}
    end = {"confidence": 1.0, "ms": math.nan, "error": str(error), "code": error.code}
    return case.record(score((), case.truths, ()) | wrong | end)


def detect_safely(
    data: Any, config: Config, mask: Bools | None, failures: type[Exception] = DooError
) -> tuple[Detection, dict[str, Any]]:
    """Run the detection in one frame; return it and the values confidence, ms, error and code of its record.

    Parameters
    ----------
    data, config, mask
        as for `doo3d.detect`.
    failures
        exceptions that are caught; a detection without chains is returned in their place.
    """
    from ...pipeline import detect

    error = code = None
    start = time.perf_counter()
    try:
        detection = detect(data, config, mask=mask)
    except failures as failure:
        detection, code = Detection(()), error_code(failure)
        error = str(failure) if isinstance(failure, DooError) else f"{type(failure).__name__}: {failure}"
    seconds = time.perf_counter() - start
    return detection, {"confidence": detection.confidence or 0.0, "ms": 1e3 * seconds, "error": error, "code": code}


def detect_case(case: Case, known: KnownFrame, config: Config, known_count: bool = True, method: Masking = "mask") -> Record:
    """Run the detection in one frame with known truth, and return its record.

    If the detection fails, the frame is scored without chains and the record holds the error. In a frame without cables, the
    detection is given neither the number of cables nor a mask, and the config may be for 2-D.

    Parameters
    ----------
    case
        the case, for its name and its family.
    known
        the frame, its cables and its mask, as returned by `case.load()`.
    config, known_count, method
        as for `frame_benchmark`.
    """
    if config.mode == "2d" and known.truths:
        raise ConfigError(
            "the truth is in 3-D and the config is for 2-D: use a 3-D config, or evaluate dataset mbest or cset",
            code="config-mode",
        )
    if not known.truths:
        known_count, method = False, "auto"
    used = case_config(config, known.truths, known_count, method)
    mask = given_mask(case.name, known, method) if used.segment.method in ("auto", "mask") else None
    detection, end = detect_safely(known.data, used, mask)
    is_frame = isinstance(known.data, Frame)
    camera, crossings = (known.data.camera, detection.crossings) if is_frame else (None, None)  # type: ignore[union-attr]
    return case.record(score(detection.chains, known.truths, crossings, camera) | end, detection)


def given_mask(name: str, known: KnownFrame, method: Masking) -> Bools | None:
    """Return the mask (H, W) to give to the detection: the true one, a ragged one, or None; `name` seeds the ragged edges."""
    if method == "mask":
        return known.mask
    if method != "ragged" or known.mask is None:
        return None
    return ragged_mask(known.mask, family_rng(f"{name}/ragged", 0)) if known.ragged is None else known.ragged


def frame_badness(row: Record) -> tuple[bool, int, float, float]:
    """Return a key that sorts records by how bad their frames are: the worst frame has the greatest key.

    Wrong frames come before correct ones; then frames with more faults (wrong connections, occlusions, crossings, number of
    chains), then those with less of the cables covered and more of the chains off the cables, then those with the greater RMS
    distance from the true axis.
    """
    faults = row.connections_wrong + row.occlusions - row.occlusions_correct + abs(row.chains - row.objects)
    faults += row.crossings - row.crossings_correct + row.crossings_extra
    missing = 0.0 if row.correct else 1 - row.coverage + row.off_fraction
    return not row.correct, faults, missing, max(filter(math.isfinite, (0.0, row.rms_seen, row.rms_hidden)))


def case_config(config: Config, truths: tuple[Truth, ...], known_count: bool, method: Masking) -> Config:
    """Return the settings for one frame: with the number of cables if it is known, and for "hsv" with the cables' colors.

    Parameters
    ----------
    config
        the settings of all frames.
    truths
        the cables of the frame.
    known_count, method
        as for `frame_benchmark`.
    """
    merge = config.merge.model_copy(update={"chains": max(len(truths), 1) if known_count else None})
    segment = config.segment
    if method == "hsv":
        ranges = tuple(_hsv_range(color) for color in sorted(_colors(truths)))
        segment = segment.model_copy(update={"method": "hsv", "ranges": ranges})
    return config.model_copy(update={"merge": merge, "segment": segment})


def _colors(truths: tuple[Truth, ...]) -> set[Color]:
    """Return the colors of the cables and of their stripes."""
    return {truth.color for truth in truths} | {truth.stripe.color for truth in truths if truth.stripe is not None}


def _hsv_range(color: Color) -> HsvRange:
    """Return the HSV box of an RGB color, wide enough for its shadows and highlights."""
    hue = int(cv2.cvtColor(np.array([[color]], dtype=np.uint8), cv2.COLOR_RGB2HSV)[0, 0, 0])
    return HsvRange(low=((hue - HUE_HALF_WIDTH) % 180, MIN_SATURATION, MIN_VALUE), high=((hue + HUE_HALF_WIDTH) % 180, 255, 255))


def result_rows(folder: str | Path, truth: str | Path) -> list[Record]:
    """Return a record for each frame of a truth file, scored from the results that `doo3d detect` wrote.

    A frame without a result file is scored without chains, and its record has the error "no result".

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
