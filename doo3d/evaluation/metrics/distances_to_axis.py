"""Measure the RMS distance of chains from the true axes, where they are seen and where they are hidden."""

from __future__ import annotations

from typing import Any

from .correct import IMAGE_RMS
from .distances import rms_mm
from .observed import Observed
from .record import Metric, number


def measure(match: Observed) -> dict[str, Any]:
    """Return the RMS distances in mm; NaN where there is no such part."""
    return {
        "rms_seen": rms_mm([part.distance[part.seen] for part in match.distances]),
        "rms_hidden": rms_mm([part.distance[~part.seen] for part in match.distances]),
    }


METRIC = Metric(measure, (number(("RMS seen", "mm"), 9, "rms_seen", 2), number(("hidden", "mm"), 7, "rms_hidden", 2), IMAGE_RMS))
