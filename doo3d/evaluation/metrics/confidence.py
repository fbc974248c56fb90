"""Measure the reliability of the confidence: the share of right frames at each level of confidence."""

import itertools
import math

import numpy as np

from .record import Record, Records, decimals

DOUBTFUL_FRACTION = 0.1
"""Fraction of the frames, those with the least confidence, that `most_confident` leaves out."""

RELIABILITY_BINS = (0.0, 0.5, 0.8, 0.9, 0.95, 0.98, 1.0)
"""Bounds of the confidence bins, 0 to 1: narrow near 1, where users choose thresholds."""

MOST_CONFIDENT_FRACTION = 0.75
"""Fraction of the frames, those with the most confidence, whose share of correct frames is reported besides the bins."""


def reliability(rows: Records) -> list[Record]:
    """Return a reliability curve: the numbers of frames and right frames in each bin of confidence, lowest bin first.

    rows : a record for each frame.

    Returns
    -------
    A record for each bin. low, high: its bounds; the bin includes low, and the last also 1. frames: number of frames. confidence:
    their mean confidence, NaN without frames. correct: number of frames correct by the strict rule. image_frames, image_correct:
    number of frames that are also scored in the image, and of those right there.
    """
    return [
        _bin(low, high, [row for row in rows if low <= row.confidence < high or row.confidence == high == 1.0])
        for low, high in itertools.pairwise(RELIABILITY_BINS)
    ]


def most_confident_part(rows: Records, fraction: float = MOST_CONFIDENT_FRACTION) -> Record:
    """Return the numbers of frames and right frames among the most confident fraction of the rows, rounded up."""
    order = sorted(rows, key=lambda row: -row.confidence)[: math.ceil(fraction * len(rows))]
    return _bin(min((row.confidence for row in order), default=math.nan), 1.0, order)


def _bin(low: float, high: float, rows: Records) -> Record:
    in_image = [row.image_correct for row in rows if row.image_correct is not None]
    mean = float(np.mean([row.confidence for row in rows])) if rows else math.nan
    counts = {"frames": len(rows), "confidence": mean, "correct": sum(row.correct for row in rows)}
    return Record({"low": low, "high": high} | counts | {"image_frames": len(in_image), "image_correct": sum(in_image)})


def most_confident(rows: Records) -> list[Record]:
    """Return the rows without the tenth that has the least confidence, in their order.

    The tenth is rounded up; of rows of equal confidence, the later ones are removed.
    """
    order = sorted(range(len(rows)), key=lambda k: (-rows[k].confidence, k))
    return [rows[k] for k in sorted(order[: len(rows) - math.ceil(DOUBTFUL_FRACTION * len(rows))])]


def format_reliability(rows: Records) -> str:
    """Return the reliability curve as a text table.

    It has a line for each bin of confidence, highest first: number of frames, their mean confidence, share of correct frames, and
    share of frames right in the image. The last line is of the 75 % of the frames with the most confidence.
    """
    lines = [f"{'confidence':<22s} {'frames':>6s} {'mean':>5s} {'frames correct':>15s} {'right in image':>15s}"]
    bins = [(f"{each.low:g} to {each.high:g}", each) for each in reversed(reliability(rows)) if each.frames]
    for name, each in (*bins, (f"{100 * MOST_CONFIDENT_FRACTION:.0f} % most confident", most_confident_part(rows))):
        correct, in_image = ratio(each.correct, each.frames), ratio(each.image_correct, each.image_frames)
        lines.append(f"{name:<22s} {each.frames:>6d} {decimals(each.confidence, 2):>5s} {correct:>15s} {in_image:>15s}")
    return "\n".join(lines)


def ratio(correct: int, total: int) -> str:
    """Return a count of correct items of a total as text, with the share in %; "-" if the total is 0."""
    return f"{correct}/{total} {100 * correct / total:.1f} %" if total else "-"
