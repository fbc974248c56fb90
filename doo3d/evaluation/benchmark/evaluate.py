"""Run the detection over frames with known truth, and score it."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Literal

import cv2
import numpy as np

from ...config import Config, HsvRange
from ...errors import ConfigError, DooError, InputError
from ...types import Detection, Frame
from ..metrics.score import score
from ..rendering.ragged_mask import ragged_mask
from ..rendering.renderer import Rendered, render
from ..scenes.model import Color, Truth
from ..scenes.registry import family_rng, make_scene
from .cases import Case, KnownFrame, folder_cases, known_frame, scene_cases
from .rows import Row

Masking = Literal["mask", "ragged", "hsv", "auto"]

HUE_HALF_WIDTH, MIN_SATURATION, MIN_VALUE = 10, 90, 25
"""The box of a cable's color, in OpenCV's 8-bit HSV."""


def evaluate(
    cases: Sequence[Case],
    config: Config,
    known_count: bool = True,
    method: Masking = "mask",
    report: Callable[[Row], None] = lambda row: None,
) -> list[Row]:
    """Detect in every case and score the result.

    The first readable case is run twice and counted once, so that compilation is not timed. If a frame cannot be read, or the
    detection fails in it, the frame counts as wrong and its row holds the error.

    Parameters
    ----------
    cases
        the frames with known truth.
    config
        the configuration of the detection, of a 3-D mode; for frames without cables, it may be of a 2-D mode.
    known_count
        True gives the detection the true number of cables; False lets it decide from the data.
    method
        how the cables are segmented. "mask": by the case's true mask, unless the config names another method than auto or mask.
        "ragged": the same, by the true mask spoiled as by `ragged_mask`, the same for every call.
        "hsv": by HSV boxes round the cables' true colors. "auto": as the config says, without the true mask.
    report
        called with each row as soon as its case is done.

    Returns
    -------
    A row for each case, in the order of `cases`.

    Raises
    ------
    ConfigError : the config is for 2-D, and a frame has cables.
    """
    rows: list[Row] = []
    compiled = False
    for case in cases:
        try:
            known = case.load()
        except InputError as error:
            rows.append(unreadable(case, error))
        else:
            if not compiled:
                detect_case(case, known, config, known_count, method)
            compiled = True
            rows.append(detect_case(case, known, config, known_count, method))
        report(rows[-1])
    return rows


def unreadable(case: Case, error: DooError) -> Row:
    """Return the row of a case whose frame cannot be read: scored without chains, and wrong even if the frame holds no cable.

    Parameters
    ----------
    case
        the case; its `truths` count as missed.
    error
        the reason; its message and its code are stored in the row.
    """
    empty_score = replace(score((), case.truths, ()), correct=False, reasons=("cannot be read",))
    return Row(case.name, case.family, empty_score, float("nan"), str(error), error.code)


def detect_case(case: Case, known: KnownFrame, config: Config, known_count: bool = True, method: Masking = "mask") -> Row:
    """Detect in one frame with known truth, and return the row with its score.

    If the detection fails, the row is scored without chains and holds the error. Of a frame without cables, neither the number
    nor a mask is given, and the config may be for 2-D.

    Parameters
    ----------
    case
        the case, for its name and its family.
    known
        the frame, its cables and its mask, as returned by `case.load()`.
    config
        the configuration of the detection, of a 3-D mode.
    known_count
        True gives the detection the true number of cables; False lets it decide from the data.
    method
        how the cables are segmented. "mask": by the true mask, unless the config names another method than auto or mask.
        "ragged": the same, by the true mask spoiled as by `ragged_mask`, the same for every call.
        "hsv": by HSV boxes round the cables' true colors. "auto": as the config says, without the true mask.
    """
    from ...pipeline import detect

    if config.mode == "2d" and known.truths:
        raise ConfigError(
            "the truth is in 3-D and the config is for 2-D: use a 3-D config, or evaluate dataset mbest or cset",
            code="config-mode",
        )
    if not known.truths:
        known_count, method = False, "auto"
    used = case_config(config, known.truths, known_count, method)
    mask = known.mask if method in ("mask", "ragged") and used.segment.method in ("auto", "mask") else None
    if method == "ragged" and mask is not None:
        mask = ragged_mask(mask, family_rng(f"{case.name}/ragged", 0)) if known.ragged is None else known.ragged
    run: Callable[..., Detection] = detect
    error = code = None
    start = time.perf_counter()
    try:
        detection = run(known.data, used, mask=mask)
    except DooError as failure:
        detection, error, code = Detection(()), str(failure), failure.code
    seconds = time.perf_counter() - start
    crossings = detection.crossings if isinstance(known.data, Frame) else None
    camera = known.data.camera if isinstance(known.data, Frame) else None
    frame_score = score(detection.chains, known.truths, crossings, camera)
    return Row(case.name, case.family, frame_score, seconds, error, code, detection.confidence, detection, case)


def evaluate_scenes(
    families: Iterable[str],
    seeds: Iterable[int],
    config: Config,
    sensor: str = "d435",
    known_count: bool = True,
    method: Masking = "mask",
    size: tuple[int, int] = (1280, 720),
) -> list[Row]:
    """Render a scene for every family and seed, detect in it, and score the result.

    Parameters
    ----------
    families
        names of kinds of scenes such as "crossing" (the keys of FAMILIES), or "tubes:" and the path of a text file of tubes.
    seeds
        integers, 0 or more; one scene of each family is made for each seed.
    config
        the configuration of the detection, of a 3-D mode.
    sensor
        simulated depth camera: "d435", "d455", "zivid", "stereo", or "none" for exact depth.
    known_count
        True gives the detection the true number of cables; False lets it decide from the data.
    method
        how the cables are segmented. "mask": by the case's true mask, unless the config names another method than auto or mask.
        "ragged": the same, by the true mask spoiled as by `ragged_mask`, the same for every call.
        "hsv": by HSV boxes round the cables' true colors. "auto": as the config says, without the true mask.
    size
        (width, height) px of the image.

    Returns
    -------
    A row for each scene, family by family.

    Raises
    ------
    ConfigError : the config is for 2-D.
    ValueError : there is no such family or sensor.
    """
    return evaluate(scene_cases(families, seeds, sensor, size), config, known_count, method)


def render_scenes(
    families: Iterable[str], seeds: Iterable[int], sensor: str = "d435", size: tuple[int, int] = (1280, 720)
) -> Iterator[tuple[str, Rendered]]:
    """Render a scene for every family and seed, and yield (name of the family, rendered scene), family by family.

    Make a list of the result to score several configs on the same scenes.

    Parameters
    ----------
    families
        names of kinds of scenes such as "crossing" (the keys of FAMILIES), or "tubes:" and the path of a text file of tubes; in
        the latter case, the file's name is yielded as the name of the family.
    seeds
        integers, 0 or more; one scene of each family is made for each seed.
    sensor
        simulated depth camera: "d435", "d455", "zivid", "stereo", or "none" for exact depth.
    size
        (width, height) px of the image.

    Raises
    ------
    ValueError : there is no such family or sensor.
    """
    seeds = list(seeds)
    for family in families:
        for seed in seeds:
            yield family.rpartition("/")[2], render(make_scene(family, seed, size), sensor)


def evaluate_rendered(
    scenes: Iterable[tuple[str, Rendered]], config: Config, known_count: bool = True, method: Masking = "mask"
) -> list[Row]:
    """Detect in scenes that are rendered already, and score the results.

    Parameters
    ----------
    scenes
        (family, rendered scene) each, as yielded by `render_scenes`.
    config
        the configuration of the detection, of a 3-D mode.
    known_count
        True gives the detection the true number of cables; False lets it decide from the data.
    method
        how the cables are segmented. "mask": by the true mask, unless the config names another method than auto or mask.
        "ragged": the same, by the true mask spoiled as by `ragged_mask`, the same for every call.
        "hsv": by HSV boxes round the cables' true colors. "auto": as the config says, without the true mask.

    Returns
    -------
    A row for each scene, in the order of `scenes`.

    Raises
    ------
    ConfigError : the config is for 2-D.
    """
    cases = [Case(scene.frame.name, family, lambda scene=scene: known_frame(scene)) for family, scene in scenes]  # type: ignore[misc]
    return evaluate(cases, config, known_count, method)


def evaluate_captures(folder: str | Path, config: Config, known_count: bool = True) -> list[Row]:
    """Detect in all captures and clouds below a folder that have a truth file, and score the results.

    Parameters
    ----------
    folder
        searched at any depth for truth.json in a capture's folder and <name>.truth.json beside a cloud.
    config
        the configuration of the detection, of a 3-D mode.
    known_count
        True gives the detection the true number of cables; False lets it decide from the data.

    Returns
    -------
    A row for each frame that a truth file names.

    Raises
    ------
    InputError : there is no truth file below the folder, or a capture, cloud or truth file cannot be read.
    ConfigError : the config is for 2-D.
    """
    return evaluate(folder_cases(folder), config, known_count)


def case_config(config: Config, truths: tuple[Truth, ...], known_count: bool, method: Masking) -> Config:
    """Return the settings for one frame: with the number of its cables if it is given, and for "hsv" with their colors.

    Parameters
    ----------
    config
        the settings of all frames.
    truths
        the cables of the frame.
    known_count, method
        as for `evaluate`.
    """
    merge = config.merge.model_copy(update={"chains": max(len(truths), 1) if known_count else None})
    segment = config.segment
    if method == "hsv":
        ranges = tuple(_hsv_range(color) for color in sorted(_colors(truths)))
        segment = segment.model_copy(update={"method": "hsv", "ranges": ranges})
    return config.model_copy(update={"merge": merge, "segment": segment})


def _colors(truths: tuple[Truth, ...]) -> set[Color]:
    """Return the colors of cables, with those of their stripes."""
    return {truth.color for truth in truths} | {truth.stripe.color for truth in truths if truth.stripe is not None}


def _hsv_range(color: Color) -> HsvRange:
    """Return a box round an RGB color that holds it from shadow to highlight."""
    hue = int(cv2.cvtColor(np.array([[color]], dtype=np.uint8), cv2.COLOR_RGB2HSV)[0, 0, 0])
    return HsvRange(low=((hue - HUE_HALF_WIDTH) % 180, MIN_SATURATION, MIN_VALUE), high=((hue + HUE_HALF_WIDTH) % 180, 255, 255))
