"""The detection run over frames of known truth."""

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
from .cases import Case, Known, folder_cases, known, scene_cases
from .rows import Row, surest
from .tables import format_table

__all__ = [
    "Row",
    "detected",
    "evaluate",
    "evaluate_captures",
    "evaluate_rendered",
    "evaluate_scenes",
    "format_table",
    "render_scenes",
    "surest",
]

Masking = Literal["mask", "hsv", "auto"]
HUE, SATURATION, VALUE = 10, 90, 25  # half-width in hue, least saturation and value of a cable's HSV box, OpenCV's units


def evaluate(
    cases: Sequence[Case],
    config: Config,
    chains_wanted: bool = True,
    method: Masking = "mask",
    report: Callable[[Row], None] = lambda row: None,
) -> list[Row]:
    """Detect in every case and score; the first is run twice and counts once, since compiling is not detecting.

    A frame that cannot be read counts as wrong, as does one in which the detection fails; its row says why.

    Parameters
    ----------
    chains_wanted : tell the detection how many cables there are; else it decides from the data.
    method : mask: the mask of the case is given, unless the config names another way; hsv: boxes round the cables' colour;
    auto: whatever the config does by itself.
    report : called with each row when it is done.

    Raises
    ------
    ConfigError : the config is for 2-D.
    """
    if config.mode == "2d":
        raise ConfigError(
            "the truth is in 3-D, the config for 2-D, for which there are evaluate mbest and evaluate cset", code="config-mode"
        )
    rows: list[Row] = []
    warm = False
    for case in cases:
        try:
            there = case.load()
        except InputError as error:
            rows.append(unreadable(case, str(error)))
        else:
            if not warm:
                detected(case, there, config, chains_wanted, method)
            warm = True
            rows.append(detected(case, there, config, chains_wanted, method))
        report(rows[-1])
    return rows


def unreadable(case: Case, error: str) -> Row:
    """The row of a case that cannot be read: nothing was found, and it is wrong though nothing is there."""
    got = replace(score((), case.truths, ()), correct=False, reasons=("cannot be read",))
    return Row(case.name, case.family, got, float("nan"), error)


def detected(case: Case, there: Known, config: Config, chains_wanted: bool = True, method: Masking = "mask") -> Row:
    """The row of one case that is loaded; arguments as of `evaluate`."""
    from ...pipeline import detect

    used = _config(config, there.truths, chains_wanted, method)
    mask = there.mask if method == "mask" and used.segment.method in ("auto", "mask") else None
    run: Callable[..., Detection] = detect
    start = time.perf_counter()
    try:
        found, error = run(there.data, used, mask=mask), None
    except DooError as failure:
        found, error = Detection(()), str(failure)
    seconds = time.perf_counter() - start
    crossings = found.crossings if isinstance(there.data, Frame) else None
    got = score(found.chains, there.truths, crossings)
    return Row(case.name, case.family, got, seconds, error, found.confidence, found, case)


def evaluate_scenes(
    families: Iterable[str],
    seeds: Iterable[int],
    config: Config,
    sensor: str = "d435",
    chains_wanted: bool = True,
    method: Masking = "mask",
    size: tuple[int, int] = (1280, 720),
) -> list[Row]:
    """Render scenes, detect and score, as `evaluate` does."""
    return evaluate(scene_cases(families, seeds, sensor, size), config, chains_wanted, method)


def render_scenes(
    families: Iterable[str], seeds: Iterable[int], sensor: str = "d435", size: tuple[int, int] = (1280, 720)
) -> Iterator[tuple[str, Rendered]]:
    """(family, rendered scene) of every family and seed, one at a time; make a list of them to try several configs.

    Of a family that is read from a file, the file's name is the family.
    """
    seeds = list(seeds)
    for family in families:
        for seed in seeds:
            yield family.rpartition("/")[2], render(make_scene(family, seed, size), sensor)


def evaluate_rendered(
    scenes: Iterable[tuple[str, Rendered]], config: Config, chains_wanted: bool = True, method: Masking = "mask"
) -> list[Row]:
    """The same over scenes that are rendered already."""
    cases = [Case(scene.frame.name, family, lambda scene=scene: known(scene)) for family, scene in scenes]  # type: ignore[misc]
    return evaluate(cases, config, chains_wanted, method)


def evaluate_captures(folder: str | Path, config: Config, chains_wanted: bool = True) -> list[Row]:
    """Detect and score all captures and clouds below `folder` that have their truth beside them.

    Raises
    ------
    InputError : there are none.
    """
    return evaluate(folder_cases(folder), config, chains_wanted)


def _config(config: Config, truths: tuple[Truth, ...], chains_wanted: bool, method: Masking) -> Config:
    merge = config.merge.model_copy(update={"chains": max(len(truths), 1) if chains_wanted else None})
    segment = config.segment
    if method == "hsv":
        ranges = tuple(_hsv_range(color) for color in sorted({truth.color for truth in truths}))
        segment = segment.model_copy(update={"method": "hsv", "ranges": ranges})
    return config.model_copy(update={"merge": merge, "segment": segment})


def _hsv_range(color: Color) -> HsvRange:
    """A box round a colour that holds it from shadow to highlight."""
    hue = int(cv2.cvtColor(np.array([[color]], dtype=np.uint8), cv2.COLOR_RGB2HSV)[0, 0, 0])
    return HsvRange(low=((hue - HUE) % 180, SATURATION, VALUE), high=((hue + HUE) % 180, 255, 255))
