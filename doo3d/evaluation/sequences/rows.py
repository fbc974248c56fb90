"""The results of sequences: a row for each frame of each variant, and the summary of a group of rows."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from ...types import Bools, Detection, Floats
from ..metrics.score import FrameScore

VARIANTS = {
    "single": "each frame for itself",
    "forward": "with earlier frames only, as a tracker",
    "sequence": "with earlier and later frames",
}
"""What the rows of a sequence compare, and what is known in each."""


@dataclass(frozen=True)
class Row:
    """The result for one frame of a sequence in one variant.

    Attributes
    ----------
    sequence, frame
        name of the sequence, index of the frame in it.
    time
        s, of the frame in the sequence.
    variant
        a key of VARIANTS.
    score
        the score of the chains against the true cable.
    detection
        the chains.
    distances
        (K,) m, of each node from its point of the material; NaN if there is no chain.
    measured
        (K,) bool, whether the sensor measured that point of the material.
    jumps, nodes_compared
        number of nodes that jump since the frame before, of those that can be compared with one.
    """

    sequence: str
    frame: int
    time: float
    variant: str
    score: FrameScore
    detection: Detection
    distances: Floats
    measured: Bools
    jumps: int
    nodes_compared: int

    def to_dict(self) -> dict[str, Any]:
        """Return the row as a flat dict of column name -> plain value, as in the CSV file; lengths are in mm."""
        return {
            "sequence": self.sequence,
            "frame": self.frame,
            "time": self.time,
            "variant": self.variant,
            "correct": self.score.correct,
            "chains": self.score.chains,
            "hidden_share": float((~self.measured).mean()),
            "node_error": _mean_mm(self.distances),
            "node_error_hidden": _mean_mm(self.distances[~self.measured]),
            "node_error_seen": _mean_mm(self.distances[self.measured]),
            "rms_hidden": self.score.rms_hidden,
            "jumps": self.jumps,
            "nodes_compared": self.nodes_compared,
            "confidence": self.detection.confidence,
            "reasons": "; ".join(self.score.reasons),
        }


@dataclass(frozen=True)
class SequenceResult:
    """The results of one sequence.

    Attributes
    ----------
    name
        name of the sequence.
    rows
        a row for each frame and variant.
    true_length, found_length
        m, of the cable, mean over frames; and as found from all frames, NaN if none was found.
    seconds
        variant -> s of processor time for all frames. Those of the first pass count in all variants.
    """

    name: str
    rows: tuple[Row, ...]
    true_length: float
    found_length: float
    seconds: dict[str, float]


@dataclass(frozen=True)
class Summary:
    """What the frames of one variant come to.

    Attributes
    ----------
    frames, frames_correct, frames_missing
        number of frames; those correct by the strict rule (see `FrameScore`); those without any chain, which have no nodes.
    node_error
        mm, mean distance of all nodes from their points of the material.
    hidden_median, hidden_mean
        mm, distance of nodes where the sensor measured nothing.
    seen_median
        mm, distance of the other nodes.
    rms_hidden
        mm, RMS distance of hidden parts from the true axis, median over frames.
    jumps
        of 1,000 nodes in a frame, those that jump since the frame before.
    ms
        processor time per frame, ms.
    time_ratio
        processor time as a multiple of that of single frames.
    """

    frames: int
    frames_correct: int
    frames_missing: int
    node_error: float
    hidden_median: float
    hidden_mean: float
    seen_median: float
    rms_hidden: float
    jumps: float
    ms: float
    time_ratio: float

    def to_dict(self) -> dict[str, Any]:
        """Return all fields and `frames_accuracy`, the fraction of frames that are correct."""
        return asdict(self) | {"frames_accuracy": self.frames_correct / self.frames if self.frames else float("nan")}


def summary(results: Sequence[SequenceResult], variant: str) -> Summary:
    """Return what the frames of some sequences come to in one variant; nodes of all sequences count alike."""
    rows = [row for result in results for row in result.rows if row.variant == variant]
    distances = np.concatenate([row.distances for row in rows] or [np.zeros(0)])
    measured = np.concatenate([row.measured for row in rows] or [np.zeros(0, dtype=bool)])
    known = np.isfinite(distances)
    compared = sum(row.nodes_compared for row in rows)
    seconds = sum(result.seconds[variant] for result in results)
    single = sum(result.seconds["single"] for result in results)
    return Summary(
        frames=len(rows),
        frames_correct=sum(row.score.correct for row in rows),
        frames_missing=sum(row.score.chains == 0 for row in rows),
        node_error=_mean_mm(distances),
        hidden_median=_mm(distances[known & ~measured], np.median),
        hidden_mean=_mean_mm(distances[~measured]),
        seen_median=_mm(distances[known & measured], np.median),
        rms_hidden=_mm(np.array([row.score.rms_hidden for row in rows]) / 1e3, np.median),
        jumps=1e3 * sum(row.jumps for row in rows) / compared if compared else float("nan"),
        ms=1e3 * seconds / len(rows) if rows else float("nan"),
        time_ratio=seconds / single if single else float("nan"),
    )


def _mean_mm(distances: Floats) -> float:
    return _mm(distances, np.mean)


def _mm(distances: Floats, average: Callable[[Floats], Any]) -> float:
    """Return an average of the finite distances (K,) m in mm; NaN if there are none."""
    known = distances[np.isfinite(distances)]
    return 1e3 * float(average(known)) if len(known) else float("nan")
