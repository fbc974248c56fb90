"""The results of many frames: a row for each frame, and the summary of a group."""

from __future__ import annotations

import itertools
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

RELIABILITY_BINS = (0.0, 0.5, 0.8, 0.9, 0.95, 0.98, 1.0)
"""Bounds of the confidences that are counted together: narrow near 1, where thresholds are chosen."""

MOST_CONFIDENT_FRACTION = 0.75
"""Fraction of the frames, those of most confidence, whose share of correct frames is said beside the bins."""


@dataclass(frozen=True)
class Row:
    """The result for one frame: its score, its duration and its errors.

    Attributes
    ----------
    name
        name of the frame.
    family
        name of the group that the frame is counted in.
    score
        the score of the detection against the truth.
    seconds
        duration of the detection, s; NaN if unknown.
    error, code
        message and machine-readable code of the error that ended reading or detection; None if there was none.
    confidence
        confidence of the detection, 0 to 1.
    detection
        the detection; None if the frame could not be read.
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
        """Return the row as a flat dict of column name -> plain value, in the order of the columns of the CSV file.

        The keys are family, frame, the fields of the score, confidence, ms (duration of the detection), reasons (joined to one
        string), error and code.
        """
        values = asdict(self.score)
        reasons = "; ".join(values.pop("reasons"))
        name = {"family": self.family, "frame": self.name}
        timing = {"confidence": self.confidence, "ms": 1e3 * self.seconds}
        return name | values | timing | {"reasons": reasons, "error": self.error, "code": self.code}


@dataclass(frozen=True)
class Summary:
    """Totals and medians over the rows of a group of frames. Medians leave NaN out; they are NaN if nothing else is left.

    Attributes
    ----------
    frames, frames_correct
        number of frames, and number of frames correct by the strict rule of Keipour et al. (RA-L 2022); see `FrameScore.correct`.
    image_frames, image_correct
        number of frames that are scored in the image, too, and number of those that are right there; see `FrameScore`.
    count_correct
        number of frames with as many chains as true cables.
    confident, confident_correct
        number of frames left without the tenth of the frames that has the least confidence, and number of correct frames left.
    image_rms
        median over frames of the RMS distance in the image from the projected axis, px.
    occlusions, occlusions_correct
        number of stretches of 8 mm or more where the cable is hidden but seen on both sides, and number of such stretches that a
        chain passes correctly.
    merges, merges_correct
        number of places where the detection joined two pieces to one chain, and number of such places that are correct.
    connections, connections_correct
        number of pairs of successive joints on cables, and number of such pairs that follow each other along one cable.
    crossings, crossings_correct, crossings_extra
        number of true crossings whose upper cable is seen, number of such crossings detected with the right cable on top, and
        number of detected crossings that do not exist.
    rms_seen, rms_hidden
        median over frames of the RMS distance from the true axis, where the axis is seen and where it is hidden, mm.
    node_error
        median over frames of the mean distance of the chains' joints from the nodes of their cables, mm; see `FrameScore`.
    end_error
        median over frames of the mean distance of the chains' ends from the tips of their cables, mm.
    radius_ratio
        median over frames of detected over true radius.
    ms
        median duration of a detection, ms.
    """

    frames: int
    frames_correct: int
    image_frames: int
    image_correct: int
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
    image_rms: float
    node_error: float
    end_error: float
    radius_ratio: float
    ms: float

    def to_dict(self) -> dict[str, Any]:
        """Return the summary as a flat dict for the JSON file.

        It holds all fields, frames_accuracy and image_accuracy (fractions of frames that are correct, and right in the image).
        For occlusions, merges and connections, it also holds `<kind>_incorrect` (a count) and `<kind>_accuracy` (fraction
        correct, 0 to 1). Fractions are NaN if there is nothing to count.
        """
        result = asdict(self) | {"frames_accuracy": _accuracy(self.frames, self.frames_correct)}
        result |= {"image_accuracy": _accuracy(self.image_frames, self.image_correct)}
        for kind in ("occlusions", "merges", "connections"):
            total, correct = getattr(self, kind), getattr(self, f"{kind}_correct")
            result |= {f"{kind}_incorrect": total - correct, f"{kind}_accuracy": _accuracy(total, correct)}
        return result


def summary(rows: Sequence[Row]) -> Summary:
    """Return the totals and medians over the rows of a group of frames.

    Counts are added. Distances, radius ratio and time are medians without NaN; they are NaN if nothing else is left.
    """
    scores, confident = [row.score for row in rows], most_confident(rows)

    def total(value: Callable[[FrameScore], int]) -> int:
        return sum(map(value, scores))

    return Summary(
        frames=len(rows),
        frames_correct=total(lambda item: item.correct),
        image_frames=total(lambda item: item.image_correct is not None),
        image_correct=total(lambda item: item.image_correct is True),
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
        image_rms=_median([item.image_rms for item in scores]),
        node_error=_median([item.node_error for item in scores]),
        end_error=_median([item.end_error for item in scores]),
        radius_ratio=_median([item.radius_ratio for item in scores]),
        ms=_median([1e3 * row.seconds for row in rows]),
    )


@dataclass(frozen=True)
class ReliabilityBin:
    """The frames of similar confidence, and how many of them are right.

    Attributes
    ----------
    low, high
        bounds of the confidence; `high` itself belongs to the next bin, except for 1.
    frames
        number of frames.
    confidence
        mean confidence of these frames; NaN without frames.
    correct
        number of frames correct by the strict rule.
    image_frames, image_correct
        number of frames that are scored in the image, too, and number of those that are right there.
    """

    low: float
    high: float
    frames: int
    confidence: float
    correct: int
    image_frames: int
    image_correct: int


def reliability(rows: Sequence[Row], bounds: Sequence[float] = RELIABILITY_BINS) -> list[ReliabilityBin]:
    """Return how many frames of each confidence are right: a reliability curve, bin by bin from the lowest confidence.

    Parameters
    ----------
    rows
        a row for each frame.
    bounds
        ascending bounds of the bins, from 0 to 1; the lower bound of each bin belongs to the bin, and 1 to the last.
    """
    bins = []
    for low, high in itertools.pairwise(bounds):
        chosen = [row for row in rows if low <= row.confidence < high or row.confidence == high == bounds[-1]]
        mean = float(np.mean([row.confidence for row in chosen])) if chosen else math.nan
        bins.append(ReliabilityBin(low, high, len(chosen), mean, *_right(chosen)))
    return bins


def most_confident_part(rows: Sequence[Row], fraction: float = MOST_CONFIDENT_FRACTION) -> ReliabilityBin:
    """Return how many frames are right among the given fraction of the rows, rounded up, that has the most confidence."""
    order = sorted(rows, key=lambda row: -row.confidence)[: math.ceil(fraction * len(rows))]
    confidence = [row.confidence for row in order]
    mean = float(np.mean(confidence)) if order else math.nan
    return ReliabilityBin(min(confidence, default=math.nan), 1.0, len(order), mean, *_right(order))


def _right(rows: Sequence[Row]) -> tuple[int, int, int]:
    """Return the number of correct rows, of those scored in the image, and of those right there."""
    in_image = [row.score.image_correct for row in rows if row.score.image_correct is not None]
    return sum(row.score.correct for row in rows), len(in_image), sum(in_image)


def by_family(rows: Sequence[Row]) -> dict[str, list[Row]]:
    """Group rows by family: name of the family -> its rows, in the order in which families first appear."""
    return {family: [row for row in rows if row.family == family] for family in dict.fromkeys(row.family for row in rows)}


def most_confident(rows: Sequence[Row]) -> list[Row]:
    """Return the rows, in their order, without the tenth of them that have the least confidence.

    The tenth is rounded up; of rows of equal confidence, the later ones are removed.
    """
    order = sorted(range(len(rows)), key=lambda k: (-rows[k].confidence, k))
    return [rows[k] for k in sorted(order[: len(rows) - math.ceil(DOUBTFUL_FRACTION * len(rows))])]


def worst(rows: Sequence[Row], count: int) -> list[Row]:
    """Return the `count` worst rows, worst first.

    Wrong frames come before correct ones; then frames with more faults (wrong connections, occlusions, crossings, number of
    chains), then those with less of the cables covered and more of the chains off the cables, then those with the greater RMS
    distance from the true axis.
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
