"""The detection run over scenes or captures of known truth, and the table of the paper."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import cv2
import numpy as np

from ..config import Config, HsvRange
from ..errors import DooError, InputError
from ..types import Array, Cloud, Detection, Frame, Image
from .model import Color, Truth
from .renderer import Rendered, render
from .scenes import make_scene
from .score import FrameScore, score
from .truthfile import read_truth

Masking = Literal["mask", "hsv", "auto"]
DOUBTFUL = 0.1  # share of the frames that are left out to see what the surest are worth
HUE, SATURATION, VALUE = 10, 90, 25  # half-width in hue, least saturation and value of a cable's HSV box, OpenCV's units


@dataclass(frozen=True)
class Row:
    """One frame: its name and family, the score, seconds that the detection took, and the error that ended it, if any.

    sure : 0 to 1, how sure the detection is.
    """

    name: str
    family: str
    score: FrameScore
    seconds: float
    error: str | None = None
    sure: float = 1.0


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


def evaluate_scenes(
    families: Iterable[str],
    seeds: Iterable[int],
    config: Config,
    sensor: str = "d435",
    chains_wanted: bool = True,
    method: Masking = "mask",
    size: tuple[int, int] = (1280, 720),
) -> list[Row]:
    """Render scenes, detect and score.

    Parameters
    ----------
    chains_wanted : tell the detection how many cables there are; else it decides from the data.
    method : mask: the true mask is given; hsv: boxes round the cables' colour; auto: whatever the config does by itself.
    """
    return evaluate_rendered(render_scenes(families, seeds, sensor, size), config, chains_wanted, method)


def evaluate_rendered(
    scenes: Iterable[tuple[str, Rendered]], config: Config, chains_wanted: bool = True, method: Masking = "mask"
) -> list[Row]:
    """The same over scenes that are rendered already."""
    rows: list[Row] = []
    for family, scene in scenes:
        used = _config(config, scene.truths, chains_wanted, method)
        mask = scene.mask if method == "mask" else None
        if not rows:  # compiling is not detecting
            _row(scene.frame.name, family, scene.frame, mask, used, scene.truths)
        rows.append(_row(scene.frame.name, family, scene.frame, mask, used, scene.truths))
    return rows


def evaluate_captures(folder: str | Path, config: Config, chains_wanted: bool = True) -> list[Row]:
    """Detect and score all captures and clouds below `folder` that have their truth beside them.

    Raises
    ------
    InputError : there are none.
    """
    from ..inputs import open_capture

    folder, rows = Path(folder), list[Row]()
    for path in sorted(folder.rglob("*truth.json")):
        frames = read_truth(path)
        data = path.parent if path.name == "truth.json" else _cloud_beside(path)
        for entry in open_capture(data).frames:
            if entry.name not in frames:
                raise InputError(f"{path}: has no frame {entry.name}, which {data} holds")
            shot, truths = entry.load(), frames[entry.name]
            used = _config(config, truths, chains_wanted, "auto")
            name = data.relative_to(folder).as_posix()
            if not rows:
                _row(entry.name, name, shot.data, shot.mask, used, truths)
            rows.append(_row(entry.name, name, shot.data, shot.mask, used, truths))
    if not rows:
        raise InputError(f"{folder}: nothing below it has a truth.json or <name>.truth.json beside it")
    return rows


def _cloud_beside(path: Path) -> Path:
    stem = path.name.removesuffix(".truth.json")
    found = [file for file in sorted(path.parent.glob(f"{stem}.*")) if not file.name.endswith(".json")]
    if not found:
        raise InputError(f"{path}: there is no cloud {stem}.* beside it")
    return found[0]


def _row(
    name: str, family: str, data: Frame | Cloud | Image, mask: Array | None, config: Config, truths: tuple[Truth, ...]
) -> Row:
    from ..pipeline import detect

    run: Callable[..., Detection] = detect
    start = time.perf_counter()
    try:
        found, error = run(data, config, mask=mask), None
    except DooError as failure:
        found, error = Detection(()), str(failure)
    seconds = time.perf_counter() - start
    crossings = found.crossings if isinstance(data, Frame) else None
    return Row(name, family, score(found.chains, truths, crossings), seconds, error, found.sure)


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


COLUMNS = (
    ("frames correct", "", 18),
    ("surest 90 %", "correct", 12),
    ("occlusions correct", "", 20),
    ("connections correct", "", 24),
    ("upper", "", 16),
    ("RMS seen", "mm", 9),
    ("hidden", "mm", 7),
    ("radius", "ratio", 7),
    ("ends", "mm", 6),
    ("time", "ms", 7),
)


def format_table(rows: Sequence[Row]) -> str:
    """Per family and in all: counts by the paper's strict rule; medians over frames of distances, radius and time.

    surest 90 %: the correct ones of the frames without the tenth whose connections are least sure. upper: the crossings at
    which the right strand is on top, of all that the camera sees.
    """
    families = list(dict.fromkeys(row.family for row in rows))
    wide = max(map(len, [*families, "all"]))
    lines = [" ".join([" " * wide, *(f"{column[k]:>{column[2]}s}" for column in COLUMNS)]) for k in (0, 1)]
    lines += [_line(family, wide, [row for row in rows if row.family == family]) for family in families]
    if len(families) > 1:
        lines += ["-" * len(lines[0]), _line("all", wide, rows)]
    return "\n".join(lines)


def _line(name: str, wide: int, rows: Sequence[Row]) -> str:
    scores = [row.score for row in rows]
    occlusions = sum(item.occlusions for item in scores)
    connections = sum(item.connections for item in scores)
    cells = (
        _share(sum(item.correct for item in scores), len(scores), 1),
        _percent([row.score.correct for row in surest(rows)]),
        _share(sum(item.occlusions_correct for item in scores), occlusions, 1),
        _share(connections - sum(item.connections_wrong for item in scores), connections, 2),
        _share(sum(item.crossings_right for item in scores), sum(item.crossings for item in scores), 1),
        _median([item.rms_seen for item in scores], 2),
        _median([item.rms_hidden for item in scores], 2),
        _median([item.radius_ratio for item in scores], 2),
        _median([item.end_error for item in scores], 1),
        _median([1e3 * row.seconds for row in rows], 0),
    )
    return " ".join([f"{name:{wide}s}", *(f"{cell:>{column[2]}s}" for cell, column in zip(cells, COLUMNS, strict=True))])


def surest(rows: Sequence[Row]) -> list[Row]:
    """The rows without the tenth that is least sure; of equals the later go."""
    order = sorted(range(len(rows)), key=lambda k: (-rows[k].sure, k))
    return [rows[k] for k in sorted(order[: len(rows) - math.ceil(DOUBTFUL * len(rows))])]


def _percent(good: list[bool]) -> str:
    return f"{100 * np.mean(good):.1f} %" if good else "-"


def _share(good: int, total: int, digits: int) -> str:
    return f"{good}/{total} {100 * good / total:.{digits}f} %" if total else "-"


def _median(values: list[float], digits: int) -> str:
    known = [value for value in values if np.isfinite(value)]
    return f"{np.median(known):.{digits}f}" if known else "-"
