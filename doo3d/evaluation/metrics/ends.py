"""Measure nodes, ends and radii of chains against those of the objects that they are matched with."""

from __future__ import annotations

from typing import Any

import numpy as np

from .distances import end_error
from .nodes import node_error
from .observed import Observed
from .record import Metric, number


def measure(match: Observed) -> dict[str, Any]:
    """Return the means over the objects with a chain; NaN if there are none.

    node_error: mm, distance of joint i of a chain from node i of its object, with as many evenly spaced nodes. end_error: mm,
    distance of chain ends from the tips of open objects. radius_ratio: detected over true radius.
    """
    return {
        "node_error": _mean([node_error(chain, truth) for chain, truth in match.matched]),
        "end_error": _mean([end_error(chain, truth) for chain, truth in match.matched if not truth.closed]),
        "radius_ratio": _mean([chain.radius / truth.radius for chain, truth in match.matched]),
    }


def _mean(values: list[float]) -> float:
    return float(np.mean(values)) if values else float("nan")


METRIC = Metric(
    measure,
    (
        number(("nodes", "mm"), 6, "node_error", 1),
        number(("ends", "mm"), 6, "end_error", 1),
        number(("radius", "ratio"), 7, "radius_ratio", 2),
    ),
)
