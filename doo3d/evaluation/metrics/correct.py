"""Decide whether a frame is correct by the strict rule of Keipour et al. (RA-L 2022), in space and in the image."""

from typing import Any

from .confidence import most_confident
from .distances import rms_mm
from .observed import Observed
from .record import Metric, flags, number, share

MIN_COVERAGE, MAX_OFF_FRACTION = 0.94, 0.03
"""Least fraction of an object that its chain must cover; fraction of a chain off its object from which on it is wrong."""

NAN = float("nan")


def reasons(match: Observed) -> tuple[str, ...]:
    """Return the reasons why a frame is wrong, one phrase for each broken rule; empty if it is correct.

    The rules are: one chain for each object, no wrong connection, at least 94 % of each object covered, and less than 3 % of each
    chain off its object.
    """
    chains, objects = len(match.chains), len(match.truths)
    wrong = sum(alignment.wrong for alignment in match.alignments)
    coverage, off = min(match.coverage, default=1.0), _off_fraction(match)
    found = {
        f"{chains} chains for {objects} objects": chains != objects,
        f"{objects - len(match.pairs)} objects without a chain": len(match.pairs) < min(chains, objects),
        f"{wrong} wrong connections": wrong > 0,
        f"{coverage:.0%} covered": coverage < MIN_COVERAGE,
        f"{off:.0%} off": off >= MAX_OFF_FRACTION,
    }
    return tuple(phrase for phrase, broken in found.items() if broken)


def _off_fraction(match: Observed) -> float:
    return max((distances.off_fraction for distances in match.distances), default=0.0)


def measure(match: Observed) -> dict[str, Any]:
    """Return whether the frame is correct, the reasons, the numbers of objects and chains, and the worst fractions.

    The worst fractions are the least coverage of an object, and the greatest part of a chain off its object.
    """
    phrases = reasons(match)
    counts = {"objects": len(match.truths), "chains": len(match.chains)}
    counts["count_correct"] = counts["objects"] == counts["chains"]
    extremes = {"coverage": min(match.coverage, default=1.0), "off_fraction": _off_fraction(match)}
    return {"correct": not phrases, "reasons": phrases} | counts | extremes


def measure_in_image(match: Observed) -> dict[str, Any]:
    """Return whether the frame is right in the image, and the RMS distance there from the seen axes, px.

    The strict rule is applied to the projected chains and cables; its limits in m become px at the median depth of the cables.
    The values are None and NaN if the camera is unknown.
    """
    if match.in_image is None:
        return {"image_correct": None if match.camera is None else not match.chains, "image_rms": NAN}
    view, scale = match.in_image
    rms = rms_mm([part.distance[part.seen] for part in view.distances]) / 1e3 / scale
    return {"image_correct": len(view.chains) == len(match.chains) and not reasons(view), "image_rms": rms}


FRAMES = share(("frames correct", ""), 15, "frames", flags("correct"))
LOOKED_AT, COUNTED = (
    share((title, "correct"), 15, name, lambda rows, own=own: flags("correct")([row for row in rows if row.counted == own]))  # type: ignore[misc]
    for title, name, own in (("looked at", "looked_at", False), ("counted", "counted", True))
)
"""Columns of the correct frames in the two parts of the split: frames that are inspected, and frames that are counted only."""

METRIC = Metric(
    measure,
    (
        FRAMES,
        share(("number", "correct"), 8, "count", flags("count_correct"), "{2:.1f} %"),
        share(("confident", "90 %"), 9, "confident", lambda rows: flags("correct")(most_confident(rows)), "{2:.1f} %"),
    ),
)
IN_IMAGE = Metric(measure_in_image, (share(("right in", "image"), 9, "image", flags("image_correct"), "{2:.1f} %"),))
IMAGE_RMS = number(("image", "px"), 6, "image_rms", 2)
