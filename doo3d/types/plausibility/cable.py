"""Check radii and distances of chains against those of real cables."""

from collections.abc import Sequence

import numpy as np

from .. import Chain, Floats
from .depth_unit import UNITS, USUAL_DEPTH_M, nearest_factor

RADIUS_RANGE_M = (0.0003, 0.04)
"""Range of the radii of cables, ropes and hoses, m; depth cameras do not see thinner wires."""

LONG_M, MAX_RADIUS_LONG_M = 20.0, 0.2
"""Length in m above which radii up to the second number (m) are plausible, since scans of overhead wires make them thick."""

SHORT_M, MIN_RADIUS_SHORT_M = 0.15, 0.0006
"""Length in m below which radii under the second number (m) are implausible: nobody captures such a small piece of wire."""

FAR_M, MAX_FAR_RADIUS_M2 = 1.5, 0.025
"""Distance in m from which on a product of radius and distance above the second number (m²) is doubtful.

A thick hose is also long, so that it is captured from some metres. A thin cable at the usual 0.6 m whose depth is four times too
large has the same size, and is far more frequent. The largest product in 80 correct captures is 0.011, of a hose.
"""

USUAL_RADIUS_M = 0.004


def distance_of(chains: Sequence[Chain], viewpoint: Floats) -> float | None:
    """Return the median distance of the longest chain from a point, m; None without chains."""
    if not chains:
        return None
    return float(np.median(np.linalg.norm(chains[0].joints - viewpoint, axis=1)))


def radius_notes(chains: Sequence[Chain], distance: float | None) -> list[str]:
    """Return a sentence if the longest chain is thicker or thinner than any cable, with the factor that would explain it.

    Parameters
    ----------
    chains
        chains of one frame, longest first; 3-D, m.
    distance
        distance in m from the sensor to the longest chain; None if unknown.
    """
    if not chains or not 0 < chains[0].radius < np.inf:
        return []
    radius, (low, high) = chains[0].radius, RADIUS_RANGE_M
    low = MIN_RADIUS_SHORT_M if chains[0].length < SHORT_M else low
    high = MAX_RADIUS_LONG_M if chains[0].length > LONG_M else high
    far = distance is not None and FAR_M < distance and distance * radius > MAX_FAR_RADIUS_M2 and chains[0].length <= LONG_M
    if low <= radius <= high and not far:
        return []
    away = "," if distance is None else f", {distance:.3g} m from the sensor,"
    large = radius > high or far
    ratio = radius / USUAL_RADIUS_M if large else USUAL_RADIUS_M / radius
    factor = nearest_factor(np.sqrt(ratio * distance / USUAL_DEPTH_M) if far and distance is not None else ratio)
    unit = f" ({UNITS[factor]})" if far else ""
    likeness = "is thick for a cable" if low <= radius <= high else f"is {'thicker' if large else 'thinner'} than any cable"
    return [
        f"check the radius: the longest chain, {chains[0].length:.3g} m long with a radius of {1000 * radius:.3g} mm{away} "
        f"{likeness}, as if lengths were {factor:g} times too {'large' if large else 'small'}{unit}: check the unit of depth "
        "(--input-option depth_scale=...; clouds are in metres) and the focal length"
    ]
