"""The scores of many frames: a row each, and what they come to."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from ...types import Detection
from ..metrics.score import FrameScore
from .cases import Case

DOUBTFUL = 0.1  # share of the frames that are left out to see what the surest are worth


@dataclass(frozen=True)
class Row:
    """One frame: its name and family, the score, seconds that the detection took, and the error that ended it, if any.

    confidence : 0 to 1, how sure the detection is. detection, case : what was found and in what; None where that is not known.
    """

    name: str
    family: str
    score: FrameScore
    seconds: float
    error: str | None = None
    confidence: float = 1.0
    detection: Detection | None = None
    case: Case | None = None

    def to_dict(self) -> dict[str, Any]:
        """Plain values, in the order of the columns of the CSV file."""
        values = asdict(self.score)
        reasons = "; ".join(values.pop("reasons"))
        name = {"family": self.family, "frame": self.name}
        return name | values | {"confidence": self.confidence, "ms": 1e3 * self.seconds, "reasons": reasons, "error": self.error}


@dataclass(frozen=True)
class Summary:
    """What rows come to: numbers of things, and of those that are right; medians over the frames of the rest.

    number_right : frames with as many chains as objects. surest : frames without the tenth that is least sure.
    """

    frames: int
    frames_correct: int
    number_right: int
    surest: int
    surest_correct: int
    occlusions: int
    occlusions_correct: int
    merges: int
    merges_correct: int
    connections: int
    connections_correct: int
    crossings: int
    crossings_right: int
    crossings_extra: int
    rms_seen: float
    rms_hidden: float
    node_error: float
    end_error: float
    radius_ratio: float
    ms: float

    def to_dict(self) -> dict[str, Any]:
        """Plain values, with how many are wrong and the share of those that are right, 0 to 1."""
        wrong = {
            f"{what}_{kind}": count
            for what in ("occlusions", "merges", "connections")
            for kind, count in _wrong(getattr(self, what), getattr(self, f"{what}_correct"))
        }
        return asdict(self) | wrong | {"frames_accuracy": _accuracy(self.frames, self.frames_correct)}


def summary(rows: Sequence[Row]) -> Summary:
    """Of the rows of a family, or of all."""
    scores, surest_rows = [row.score for row in rows], surest(rows)

    def total(value: Callable[[FrameScore], int]) -> int:
        return sum(map(value, scores))

    return Summary(
        frames=len(rows),
        frames_correct=total(lambda item: item.correct),
        number_right=total(lambda item: item.chains == item.objects),
        surest=len(surest_rows),
        surest_correct=sum(row.score.correct for row in surest_rows),
        occlusions=total(lambda item: item.occlusions),
        occlusions_correct=total(lambda item: item.occlusions_correct),
        merges=total(lambda item: item.merges),
        merges_correct=total(lambda item: item.merges - item.merges_wrong),
        connections=total(lambda item: item.connections),
        connections_correct=total(lambda item: item.connections - item.connections_wrong),
        crossings=total(lambda item: item.crossings),
        crossings_right=total(lambda item: item.crossings_right),
        crossings_extra=total(lambda item: item.crossings_extra),
        rms_seen=_median([item.rms_seen for item in scores]),
        rms_hidden=_median([item.rms_hidden for item in scores]),
        node_error=_median([item.node_error for item in scores]),
        end_error=_median([item.end_error for item in scores]),
        radius_ratio=_median([item.radius_ratio for item in scores]),
        ms=_median([1e3 * row.seconds for row in rows]),
    )


def by_family(rows: Sequence[Row]) -> dict[str, list[Row]]:
    """The rows of each family, in the order in which families first come."""
    return {family: [row for row in rows if row.family == family] for family in dict.fromkeys(row.family for row in rows)}


def surest(rows: Sequence[Row]) -> list[Row]:
    """The rows without the tenth that is least sure; of equals the later go."""
    order = sorted(range(len(rows)), key=lambda k: (-rows[k].confidence, k))
    return [rows[k] for k in sorted(order[: len(rows) - math.ceil(DOUBTFUL * len(rows))])]


def worst(rows: Sequence[Row], count: int) -> list[Row]:
    """The `count` worst rows, the worst first: wrong ones before right ones, by how much is wrong, then by the greater RMS."""

    def badness(row: Row) -> tuple[bool, int, float, float]:
        score = row.score
        wrong = score.connections_wrong + score.occlusions - score.occlusions_correct + abs(score.chains - score.objects)
        wrong += score.crossings - score.crossings_right + score.crossings_extra
        missing = 0.0 if score.correct else 1 - score.coverage + score.off
        return not score.correct, wrong, missing, max(filter(math.isfinite, (0.0, score.rms_seen, score.rms_hidden)))

    return sorted(rows, key=badness, reverse=True)[:count]


def _wrong(total: int, correct: int) -> list[tuple[str, Any]]:
    return [("incorrect", total - correct), ("accuracy", _accuracy(total, correct))]


def _accuracy(total: int, correct: int) -> float:
    return correct / total if total else math.nan


def _median(values: Sequence[float]) -> float:
    finite = [value for value in values if math.isfinite(value)]
    return float(np.median(finite)) if finite else math.nan
