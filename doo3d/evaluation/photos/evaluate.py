"""The 2-D mode on photographs with instance labels: the detection run over them, and the tables."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...config import Config
from ...types import Array, Bools, Detection
from .datasets import PhotoRef
from .score import PhotoScore, Traced, score_photo, trace

Detector = Callable[[Array, Config, Bools], Detection]


@dataclass(frozen=True)
class Row:
    """One photograph, or one cable of it alone: its score, the detection, and the error that ended it, if any."""

    entry: PhotoRef
    score: PhotoScore
    detection: Detection
    error: str | None = None
    cable: int | None = None
    traced: Traced | None = None

    @property
    def name(self) -> str:
        part = "" if self.cable is None else f" cable {self.cable}"
        return f"{self.entry.subset}/{self.entry.name}{part}"

    @property
    def milliseconds(self) -> float:
        """From the mask to the chains; NaN where there was an error."""
        return float("nan") if self.error else 1e3 * sum(self.detection.seconds.values())

    @property
    def goodness(self) -> float:
        """What the worst are chosen by."""
        return self.traced.recall + self.traced.precision if self.traced else self.score.drawn + self.score.labelled


def evaluate_photos(
    entries: Iterable[PhotoRef], config: Config, known_count: bool = False, detect: Detector | None = None
) -> list[Row]:
    """Detect in every photograph and score. The first of each subset runs twice and counts once: compiling is not detecting.

    Parameters
    ----------
    known_count : tell the detection how many cables there are; else the config stays as it is.
    detect : what is measured, called with image, config and mask; None for this project's own.
    """
    rows = list[Row]()
    for entry in entries:
        photo = entry.load()
        used = _wanting(config, photo.cables) if known_count else config
        if not rows or rows[-1].entry.subset != entry.subset:
            _detected(photo.image, used, photo.mask, detect)
        detection, error = _detected(photo.image, used, photo.mask, detect)
        rows.append(Row(entry, score_photo(detection.chains, photo.labels, photo.mask), detection, error))
    return rows


def evaluate_cables(entries: Iterable[PhotoRef], config: Config, detect: Detector | None = None) -> list[Row]:
    """The same for each cable of each photograph alone: its own labelled pixels are the mask, one chain is wanted."""
    rows, config = list[Row](), _wanting(config, 1)
    for entry in entries:
        photo = entry.load()
        for cable in range(1, photo.cables + 1):
            own = photo.labels == cable
            if not rows or rows[-1].entry.subset != entry.subset:
                _detected(photo.image, config, own, detect)
            detection, error = _detected(photo.image, config, own, detect)
            traced = trace(detection.chains[0] if detection.chains else None, photo.labels, cable)
            score = score_photo(detection.chains, own.astype(np.uint8), own)
            rows.append(Row(entry, score, detection, error, cable, traced))
    return rows


def _wanting(config: Config, chains: int) -> Config:
    return config.model_copy(update={"merge": config.merge.model_copy(update={"chains": max(chains, 1)})})


def _detected(image: Array, config: Config, mask: Bools, detect: Detector | None) -> tuple[Detection, str | None]:
    """The detection, or an empty one and what went wrong: whatever is raised, on a photograph it counts as nothing found."""
    run: Callable[..., Detection]
    if detect is None:
        from ...pipeline import detect as run
    else:
        run = detect
    try:
        return run(image, config, mask=mask), None
    except Exception as failure:
        return Detection((), "2d", "image"), f"{type(failure).__name__}: {failure}"


COLUMNS = (
    ("images", 6),
    ("drawn", 7),
    ("labelled", 9),
    ("ordered", 8),
    ("count right", 18),
    ("ms", 7),
    ("95 %", 7),
    ("errors", 6),
)
CABLE_COLUMNS = (("cables", 6), ("traced", 18), ("recall", 7), ("precision", 9), ("ms", 7), ("95 %", 7), ("errors", 6))


def format_rows(rows: Sequence[Row]) -> str:
    """Per subset and in all: DICE in % averaged over images, counts, ms (median and 95th percentile); then what went wrong."""
    alone = any(row.traced for row in rows)
    columns, cells = (CABLE_COLUMNS, _cable_cells) if alone else (COLUMNS, _cells)
    groups = {subset: [row for row in rows if row.entry.subset == subset] for subset in sorted({r.entry.subset for r in rows})}
    if len(groups) > 1:
        groups["all"] = list(rows)
    lines = [" ".join(["   ", *(f"{title:>{wide}s}" for title, wide in columns)])]
    for name, group in groups.items():
        lines.append(
            " ".join([f"{name:3s}", *(f"{cell:>{wide}s}" for cell, (_, wide) in zip(cells(group), columns, strict=True))])
        )
    for error in dict.fromkeys(row.error for row in rows if row.error):
        lines.append(f"error: {error}: {', '.join(row.name for row in rows if row.error == error)}")
    if wrong := [row for row in rows if not (row.score.count_right or row.error or alone)]:
        named = ", ".join(f"{row.name} {row.score.chains} of {row.score.cables}" for row in wrong)
        lines.append(f"count wrong: {named}")
    if missed := [row.name for row in rows if row.traced and not (row.traced.good or row.error)]:
        lines.append(f"not traced: {', '.join(missed)}")
    return "\n".join(lines)


def worst(rows: Sequence[Row], count: int) -> list[Row]:
    """The rows with the lowest scores, lowest first."""
    return sorted(rows, key=lambda row: row.goodness)[:count]


def caption(row: Row) -> str:
    """A row in a line."""
    if row.traced:
        text = f"recall {100 * row.traced.recall:.1f}   precision {100 * row.traced.precision:.1f}"
    else:
        score = row.score
        dice = f"drawn {100 * score.drawn:.1f}   labelled {100 * score.labelled:.1f}   ordered {100 * score.ordered:.1f}"
        text = f"{dice}   {score.chains} of {score.cables} chains"
    return f"{row.name}   {text}" + (f"   {row.error}" if row.error else "")


def csv_text(rows: Sequence[Row]) -> str:
    """A line per row; numbers in full."""
    file = io.StringIO()
    table = csv.writer(file, lineterminator="\n")
    head = ["subset", "image", "cable", "cables", "chains", "drawn", "labelled", "ordered", "recall", "precision", "ms", "error"]
    table.writerow(head)
    for row in rows:
        share: list[Any] = [row.traced.recall, row.traced.precision] if row.traced else ["", ""]
        score = row.score
        found = [score.cables, score.chains, score.drawn, score.labelled, score.ordered]
        table.writerow([row.entry.subset, row.entry.name, row.cable or "", *found, *share, row.milliseconds, row.error or ""])
    return file.getvalue()


def _cells(rows: Sequence[Row]) -> list[str]:
    scores = [row.score for row in rows]
    dice = [
        f"{100 * float(np.mean([getattr(score, kind) for score in scores])):.2f}" for kind in ("drawn", "labelled", "ordered")
    ]
    return [f"{len(rows)}", *dice, _share([score.count_right for score in scores]), *_last(rows)]


def _cable_cells(rows: Sequence[Row]) -> list[str]:
    traced = [row.traced for row in rows if row.traced]
    recall, precision = (100 * float(np.mean([getattr(item, kind) for item in traced])) for kind in ("recall", "precision"))
    return [f"{len(rows)}", _share([item.good for item in traced]), f"{recall:.2f}", f"{precision:.2f}", *_last(rows)]


def _share(good: Sequence[bool]) -> str:
    return f"{sum(good)}/{len(good)} {100 * sum(good) / len(good):.1f} %"


def _last(rows: Sequence[Row]) -> list[str]:
    times = [row.milliseconds for row in rows if not row.error]
    spread = [f"{np.percentile(times, part):.1f}" for part in (50, 95)] if times else ["-", "-"]
    return [*spread, f"{sum(row.error is not None for row in rows)}"]
