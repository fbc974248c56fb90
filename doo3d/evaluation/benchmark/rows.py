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

    Attributes
    ----------
    name, family
        of the frame, and of the group of frames that it is counted in.
    score
        of the detection against the truth.
    seconds
        duration of the detection; NaN if unknown.
    error, code
        sentence and code of the error that ended reading or detection; None if there was none.
    confidence
        of the detection, 0 to 1.
    detection
        None if the frame could not be read.
    case
        the frame that was scored; None if it is not at hand, as for results read from disk.
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
        """Return the row as a flat dict of plain values, one for each column of the CSV file, in its order.

        Family and frame come first, then the fields of the score, confidence, ms (duration of the detection), reasons joined to
        one string, error and code.
        """
        values = asdict(self.score)
        reasons = "; ".join(values.pop("reasons"))
        name = {"family": self.family, "frame": self.name}
        timing = {"confidence": self.confidence, "ms": 1e3 * self.seconds}
        return name | values | timing | {"reasons": reasons, "error": self.error, "code": self.code}


@dataclass(frozen=True)
class Summary:
    """Totals and medians over the rows of a group of frames.

    Attributes
    ----------
    frames, frames_correct
        number of frames, and of those correct by the strict rule of Keipour et al. (RA-L 2022).
    count_correct
        frames with as many chains as objects.
    confident, confident_correct
        frames left after removing the tenth of least confidence, and the correct ones of these.
    occlusions, occlusions_correct
        hidden runs of 8 mm or more with the cable seen on both sides, and those that a chain passes correctly.
    merges, merges_correct
        places where the detection joined two pieces to one chain, and the correct ones.
    connections, connections_correct
        pairs of successive joints on cables, and those that follow each other along one cable.
    crossings, crossings_correct, crossings_extra
        true crossings whose upper cable is seen, those detected with the right one on top, and detected ones that do not exist.
    rms_seen, rms_hidden
        mm, median over frames of the RMS distance from the true axis, where it is seen and where it is hidden.
    node_error, end_error
        mm, medians over frames of the mean distance of the chains' nodes, and ends, from those of their cables.
    radius_ratio
        median over frames of detected over true radius.
    ms
        median duration of a detection.
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
        """Return the summary as a flat dict for the JSON file.

        It holds all fields and frames_accuracy; for occlusions, merges and connections also `<kind>_incorrect` (a count) and
        `<kind>_accuracy` (fraction correct, 0 to 1; NaN if there are none).
        """
        result = asdict(self) | {"frames_accuracy": _accuracy(self.frames, self.frames_correct)}
        for kind in ("occlusions", "merges", "connections"):
            total, correct = getattr(self, kind), getattr(self, f"{kind}_correct")
            result |= {f"{kind}_incorrect": total - correct, f"{kind}_accuracy": _accuracy(total, correct)}
        return result


def summary(rows: Sequence[Row]) -> Summary:
    """Sum up the rows of a group of frames.

    Counts are added; of the distances, the radius ratio and the time, medians are taken that ignore NaN.
    """
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
    """Group rows by family: name of the family -> its rows, in the order in which families first appear."""
    return {family: [row for row in rows if row.family == family] for family in dict.fromkeys(row.family for row in rows)}


def most_confident(rows: Sequence[Row]) -> list[Row]:
    """Return the rows, in their order, without the tenth of least confidence.

    The tenth is rounded up; of rows of equal confidence the later ones are removed.
    """
    order = sorted(range(len(rows)), key=lambda k: (-rows[k].confidence, k))
    return [rows[k] for k in sorted(order[: len(rows) - math.ceil(DOUBTFUL_FRACTION * len(rows))])]


def worst(rows: Sequence[Row], count: int) -> list[Row]:
    """Return the `count` worst rows, worst first.

    Wrong frames come before correct ones; then more faults (wrong connections, occlusions, crossings, number of chains), then
    less coverage of the cables, then the greater RMS distance from the true axis.
    """

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
