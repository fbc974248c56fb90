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
from ..rendering.renderer import Rendered, render
from ..scenes.model import Color, Truth
from ..scenes.registry import make_scene
from .cases import Case, KnownFrame, folder_cases, known_frame, scene_cases
from .rows import Row

Masking = Literal["mask", "hsv", "auto"]

HUE_HALF_WIDTH, MIN_SATURATION, MIN_VALUE = 10, 90, 25
"""The box of a cable's color, in OpenCV's 8-bit HSV."""


def evaluate(
    cases: Sequence[Case],
    config: Config,
    known_count: bool = True,
    method: Masking = "mask",
    report: Callable[[Row], None] = lambda row: None,
) -> list[Row]:
    """Detect in every case and score.

    The first case is run twice and counted once, so that compiling is not timed. A frame that cannot be read counts as
    wrong, as does one in which the detection fails; its row holds the error.

    Parameters
    ----------
    cases, config
        the frames, and the config of the detection.
    known_count
        give the detection the number of cables; else it decides from the data.
    method
        "mask" gives the mask of the case unless the config names another method; "hsv" gives boxes round the cables'
        colors; "auto" leaves the config as it is.
    report
        called with each row when it is done.

    Raises
    ------
    ConfigError : the config is for 2-D.
    """
    if config.mode == "2d":
        raise ConfigError(
            "the truth is in 3-D and the config is for 2-D: use a 3-D config, or evaluate dataset mbest or cset",
            code="config-mode",
        )
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
    """Return the row of a case that cannot be read: it is wrong even if there is no cable in it."""
    empty_score = replace(score((), case.truths, ()), correct=False, reasons=("cannot be read",))
    return Row(case.name, case.family, empty_score, float("nan"), str(error), error.code)


def detect_case(case: Case, known: KnownFrame, config: Config, known_count: bool = True, method: Masking = "mask") -> Row:
    """Return the row of one case.

    Parameters
    ----------
    case, known
        the case, and what it loads.
    config, known_count, method
        as of `evaluate`.
    """
    from ...pipeline import detect

    used = _case_config(config, known.truths, known_count, method)
    mask = known.mask if method == "mask" and used.segment.method in ("auto", "mask") else None
    run: Callable[..., Detection] = detect
    error = code = None
    start = time.perf_counter()
    try:
        detection = run(known.data, used, mask=mask)
    except DooError as failure:
        detection, error, code = Detection(()), str(failure), failure.code
    seconds = time.perf_counter() - start
    crossings = detection.crossings if isinstance(known.data, Frame) else None
    frame_score = score(detection.chains, known.truths, crossings)
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
    """Render scenes, detect and score.

    Parameters
    ----------
    families, seeds, sensor, size
        as of `scene_cases`.
    config, known_count, method
        as of `evaluate`.
    """
    return evaluate(scene_cases(families, seeds, sensor, size), config, known_count, method)


def render_scenes(
    families: Iterable[str], seeds: Iterable[int], sensor: str = "d435", size: tuple[int, int] = (1280, 720)
) -> Iterator[tuple[str, Rendered]]:
    """Yield (family, rendered scene) of every family and seed; make a list of them to try several configs.

    If a family is read from a file, the file's name is the family.

    Parameters
    ----------
    families, seeds, sensor, size
        as of `scene_cases`.
    """
    seeds = list(seeds)
    for family in families:
        for seed in seeds:
            yield family.rpartition("/")[2], render(make_scene(family, seed, size), sensor)


def evaluate_rendered(
    scenes: Iterable[tuple[str, Rendered]], config: Config, known_count: bool = True, method: Masking = "mask"
) -> list[Row]:
    """Detect and score in scenes that are rendered already.

    Parameters
    ----------
    scenes
        as of `render_scenes`.
    config, known_count, method
        as of `evaluate`.
    """
    cases = [Case(scene.frame.name, family, lambda scene=scene: known_frame(scene)) for family, scene in scenes]  # type: ignore[misc]
    return evaluate(cases, config, known_count, method)


def evaluate_captures(folder: str | Path, config: Config, known_count: bool = True) -> list[Row]:
    """Detect and score in all captures and clouds below a folder that have a truth file beside them.

    Parameters
    ----------
    folder
        as of `folder_cases`.
    config, known_count
        as of `evaluate`.

    Raises
    ------
    InputError : there are none.
    """
    return evaluate(folder_cases(folder), config, known_count)


def _case_config(config: Config, truths: tuple[Truth, ...], known_count: bool, method: Masking) -> Config:
    merge = config.merge.model_copy(update={"chains": max(len(truths), 1) if known_count else None})
    segment = config.segment
    if method == "hsv":
        ranges = tuple(_hsv_range(color) for color in sorted({truth.color for truth in truths}))
        segment = segment.model_copy(update={"method": "hsv", "ranges": ranges})
    return config.model_copy(update={"merge": merge, "segment": segment})


def _hsv_range(color: Color) -> HsvRange:
    """Return a box round an RGB color that holds it from shadow to highlight."""
    hue = int(cv2.cvtColor(np.array([[color]], dtype=np.uint8), cv2.COLOR_RGB2HSV)[0, 0, 0])
    return HsvRange(low=((hue - HUE_HALF_WIDTH) % 180, MIN_SATURATION, MIN_VALUE), high=((hue + HUE_HALF_WIDTH) % 180, 255, 255))
