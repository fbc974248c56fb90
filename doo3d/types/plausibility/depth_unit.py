"""Check the unit of depth, by the range of depth cameras and by the step between depth values."""

import numpy as np

from .. import Array, Camera, Floats

MAX_DEPTH_M = 30.0
"""Greatest distance that depth cameras measure, m."""

MIN_DEPTH_M, MIN_DEPTH_NARROW_M = 0.07, 0.15
"""Least distance that depth cameras measure, m: of wide-angle cameras made for short distances, and of the others."""

NARROW_FOCAL_WIDTHS = 0.6
"""Focal length, in image widths, above which MIN_DEPTH_NARROW_M applies; cameras for short distances have 0.5."""

MAX_STEP_MM = 3.5
"""Greatest step between depth values of a camera, mm; drivers write 1 mm or less."""

FINE_STEPS_MM = {0.2: 0.35, 0.1: 0.14}
"""Step of depth values in mm -> distance in m below which such a fine step suggests that the unit is too small.

Values in 1 mm that are read as 5000 or 10000 units per metre have these steps. Cameras that really have such steps are farther
away: 0.2 mm is the unit of recordings of the Kinect, which measures from 0.4 m.
"""

USUAL_DEPTH_M = 0.6
"""Usual distance of a depth camera from a cable, m."""

MAX_EMPTY_DEPTH_M = 3.5
"""Median depth in m above which a frame without chains is doubtful; a usual cable, 8 mm thick, is only 1 or 2 px wide there."""

UNITS = {
    4.0: "0.25 mm as a RealSense L515 writes, depth_scale=4000",
    5.0: "0.2 mm as in TUM's data sets, depth_scale=5000",
    8.0: "0.125 mm as a RealSense SR300 writes, depth_scale=8000",
    10.0: "0.1 mm as a RealSense D405 writes, depth_scale=10000",
    100.0: "0.01 mm, depth_scale=100000",
    1000.0: "1 mm where metres are expected, depth_scale=1000",
}
"""Factor by which lengths are too large -> true unit of the values, if they were read as 1 mm; for 1000, they were read as m."""

SAMPLES = (48, 64)
"""Numbers of sampled rows and columns of a depth image from which its step is computed."""

MIN_DISTINCT = 10
"""Least number of different depth values for a step; by chance, ten are all multiples of 5 mm once in ten million images."""

_UNIT_MM = 0.1  # the finest unit of depth images
_TOLERANCE_UNITS = 0.05  # of a whole number of units; float32 is exact to 0.01 at 10 m


def depth_samples(depth: Array) -> Floats:
    """Return the readings of a depth image at about 48 x 64 pixels, spread evenly: (N,) m.

    depth : (H, W) float m, 0 = no reading.
    """
    rows, columns = (max(1, size // count) for size, count in zip(depth.shape, SAMPLES, strict=True))
    sampled = depth[rows // 2 :: rows, columns // 2 :: columns].ravel()
    return sampled[sampled > 0].astype(float)


def depth_step(samples: Floats) -> float | None:
    """Return the step between depth values in mm: the greatest length, at least 0.1 mm, of which all are multiples.

    samples : (N,) m, above 0. Returns None if values are not multiples of 0.1 mm, or if too few of them differ.
    """
    units = samples * (1000 / _UNIT_MM)
    levels = np.rint(units)
    if not len(samples) or np.abs(units - levels).max() > _TOLERANCE_UNITS or levels.max() > 1e9:
        return None
    distinct = np.unique(levels.astype(np.int64))
    return float(np.gcd.reduce(distinct) * _UNIT_MM) if len(distinct) >= MIN_DISTINCT else None


def unit_notes(distance: float, near: float, step: float | None, camera: Camera | None, subject: str) -> list[str]:
    """Return a sentence if depth seems to have been read in a wrong unit.

    Parameters
    ----------
    distance
        typical distance from the camera, m.
    near
        least distance from the camera, m; at most `distance`.
    step
        step between depth values in mm, from `depth_step`; None if unknown.
    camera
        the intrinsics; None for a cloud.
    subject
        name of `distance` in the sentence, such as "the median depth".
    """
    if step is not None and step > MAX_STEP_MM:
        return [
            f"check the depth unit: all depths are multiples of {step:.4g} mm, coarser than a depth camera's 1 mm, as if "
            f"the unit were wrong by a factor of {step:.4g} (then {subject} is {distance / step:.3g} m, not {distance:.3g} m): "
            + _remedy(step)
        ]
    narrow = camera is not None and camera.fx / camera.width > NARROW_FOCAL_WIDTHS
    for fine, limit in FINE_STEPS_MM.items():
        if step is not None and abs(step - fine) < _UNIT_MM / 10 and near < limit and narrow:
            return [
                f"check the depth unit: depths come in steps of {fine:g} mm, {near:.3g} m away, as values in millimetres do when "
                f"they are read as {1000 / fine:.0f} units per metre (then {subject} is {distance / fine:.3g} m, not "
                f"{distance:.3g} m): {_remedy(fine)}"
            ]
    least = MIN_DEPTH_NARROW_M if narrow else MIN_DEPTH_M
    large = distance > MAX_DEPTH_M and camera is not None  # laser scanners measure farther
    if large or distance < least:
        factor = _decimal_factor(distance if large else 1 / distance)
        return [
            f"check the depth unit: {subject} is {distance:.4g} m, too {'large' if large else 'small'} for a depth camera, as if "
            f"the unit were wrong by a factor of about {factor:g}: {_remedy(factor if large else 1 / factor)}"
        ]
    return []


def far_notes(median: float) -> list[str]:
    """Return a sentence for a frame without chains if its median depth (m) is too large for cables to be seen."""
    if median <= MAX_EMPTY_DEPTH_M:
        return []
    factor = nearest_factor(median / USUAL_DEPTH_M)
    return [
        f"check the depth unit: nothing is found, and the median depth is {median:.3g} m, where a cable is hardly seen, as if "
        f"the unit were wrong by a factor of about {factor:g} ({UNITS[factor]}): {_remedy(factor)}"
    ]


def nearest_factor(ratio: float) -> float:
    """Return the factor of UNITS nearest to the ratio of a length to a usual one."""
    return min(UNITS, key=lambda factor: abs(np.log(ratio / factor)))


def _decimal_factor(ratio: float) -> float:
    """Return the power of ten, 10 or more, nearest to the ratio of a distance to about a metre."""
    return float(10 ** max(1, round(np.log10(ratio))))


def _remedy(factor: float) -> str:
    """Return the remedy for depth that is `factor` times too large."""
    scale = f"{factor:.4g} times as large" if factor > 1 else f"smaller by a factor of {1 / factor:.4g}"
    return f"check the units per metre (--input-option depth_scale=..., {scale}; 1000 for millimetres); clouds are in metres"
