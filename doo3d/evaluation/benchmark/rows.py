"""The scores of many frames: a row each, and their summary."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from ...types import Detection
from ..metrics.score import FrameScore
from .cases import Case

DOUBTFUL_FRACTION = 0.1
"""Fraction of the frames, those of least confidence, that is left out to see how much more often the rest is correct."""


@dataclass(frozen=True)
class Row:
    """The score of one frame.

    seconds : of the detection. error, code : sentence and code of the error that ended it; None where it ended well.
    confidence : of the detection, 0 to 1. detection, case : the detection and its frame; None where they are unknown.
    """

    name: str
    family: str
    score: FrameScore
    seconds: float
    error: str | None = None
    code: str | None = None
    confidence: float = 1.0
    detection: Detection | None = None
    case: Case | None = None

    def to_dict(self) -> dict[str, Any]:
        """Return plain values, in the order of the columns of the CSV file."""
        values = asdict(self.score)
        reasons = "; ".join(values.pop("reasons"))
        name = {"family": self.family, "frame": self.name}
        timing = {"confidence": self.confidence, "ms": 1e3 * self.seconds}
        return name | values | timing | {"reasons": reasons, "error": self.error, "code": self.code}


@dataclass(frozen=True)
class Summary:
    """Totals over rows, of each count and of the correct ones, and medians over the frames of the other values.

    count_correct : frames with as many chains as objects. confident : frames without the tenth of least confidence.
    """

    frames: int
    frames_correct: int
    count_correct: int
    confident: int
    confident_correct: int
    occlusions: int
    occlusions_correct: int
    merges: int
    merges_correct: int
    connections: int
    connections_correct: int
    crossings: int
    crossings_correct: int
    crossings_extra: int
    rms_seen: float
    rms_hidden: float
    node_error: float
    end_error: float
    radius_ratio: float
    ms: float

    def to_dict(self) -> dict[str, Any]:
        """Return plain values, with the number of incorrect ones and the fraction of correct ones, 0 to 1."""
        result = asdict(self) | {"frames_accuracy": _accuracy(self.frames, self.frames_correct)}
        for kind in ("occlusions", "merges", "connections"):
            total, correct = getattr(self, kind), getattr(self, f"{kind}_correct")
            result |= {f"{kind}_incorrect": total - correct, f"{kind}_accuracy": _accuracy(total, correct)}
        return result


def summary(rows: Sequence[Row]) -> Summary:
    """Return the summary of the rows of a family, or of all."""
    scores, confident = [row.score for row in rows], most_confident(rows)

    def total(value: Callable[[FrameScore], int]) -> int:
        return sum(map(value, scores))

    return Summary(
        frames=len(rows),
        frames_correct=total(lambda item: item.correct),
        count_correct=total(lambda item: item.chains == item.objects),
        confident=len(confident),
        confident_correct=sum(row.score.correct for row in confident),
        occlusions=total(lambda item: item.occlusions),
        occlusions_correct=total(lambda item: item.occlusions_correct),
        merges=total(lambda item: item.merges),
        merges_correct=total(lambda item: item.merges - item.merges_wrong),
        connections=total(lambda item: item.connections),
        connections_correct=total(lambda item: item.connections - item.connections_wrong),
        crossings=total(lambda item: item.crossings),
        crossings_correct=total(lambda item: item.crossings_correct),
        crossings_extra=total(lambda item: item.crossings_extra),
        rms_seen=_median([item.rms_seen for item in scores]),
        rms_hidden=_median([item.rms_hidden for item in scores]),
        node_error=_median([item.node_error for item in scores]),
        end_error=_median([item.end_error for item in scores]),
        radius_ratio=_median([item.radius_ratio for item in scores]),
        ms=_median([1e3 * row.seconds for row in rows]),
    )


def by_family(rows: Sequence[Row]) -> dict[str, list[Row]]:
    """Return the rows of each family, in the order in which families first appear."""
    return {family: [row for row in rows if row.family == family] for family in dict.fromkeys(row.family for row in rows)}


def most_confident(rows: Sequence[Row]) -> list[Row]:
    """Return the rows without the tenth of least confidence; of equal ones the later are left out."""
    order = sorted(range(len(rows)), key=lambda k: (-rows[k].confidence, k))
    return [rows[k] for k in sorted(order[: len(rows) - math.ceil(DOUBTFUL_FRACTION * len(rows))])]


def worst(rows: Sequence[Row], count: int) -> list[Row]:
    """Return the `count` worst rows, worst first: wrong before correct, then by the number of faults, then by the RMS."""

    def badness(row: Row) -> tuple[bool, int, float, float]:
        score = row.score
        faults = score.connections_wrong + score.occlusions - score.occlusions_correct + abs(score.chains - score.objects)
        faults += score.crossings - score.crossings_correct + score.crossings_extra
        missing = 0.0 if score.correct else 1 - score.coverage + score.off_fraction
        return not score.correct, faults, missing, max(filter(math.isfinite, (0.0, score.rms_seen, score.rms_hidden)))

    return sorted(rows, key=badness, reverse=True)[:count]


def _accuracy(total: int, correct: int) -> float:
    return correct / total if total else math.nan


def _median(values: Sequence[float]) -> float:
    finite = [value for value in values if math.isfinite(value)]
    return float(np.median(finite)) if finite else math.nan
