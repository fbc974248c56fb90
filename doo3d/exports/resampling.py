"""Resample chains to another number of segments, for simulators that are slow with many joints."""

import numpy as np

from ..errors import InputError
from ..geometry.equal_segments import equal_ring
from ..kernels import lay_equal_chords
from ..types import Chain, Floats

BISECTIONS = 60
MIN_RING = 3  # segments of a ring
RING_TRIALS = 50
"""Number of segment lengths that are tried for a ring, in steps of 0.5 % to both sides."""


def resampled(chain: Chain, count: int) -> Chain:
    """Return a 3-D chain with another number of equal segments, from the first joint to the last.

    The new joints are on the given segments, so that a chain with fewer segments is slightly shorter. Radii are interpolated; a
    segment is occluded if its middle is.

    Parameters
    ----------
    chain
        the chain.
    count
        number of segments: at least 1, for a ring at least 3.

    Raises
    ------
    InputError : the number of segments is too small for a ring.
    """
    if count == len(chain.occluded):
        return chain
    joints = _ring(chain, count) if chain.closed else _open(chain.joints, count)
    positions = np.linspace(0, len(chain.occluded), count + 1)
    middles = ((positions[1:] + positions[:-1]) / 2).astype(int)
    return Chain(
        joints,
        float(np.linalg.norm(joints[1] - joints[0])),
        chain.radius,
        radii=np.interp(positions, np.arange(len(chain.radii)), chain.radii),
        occluded=chain.occluded[middles],
        closed=chain.closed,
        id=chain.id,
    )


def _open(points: Floats, count: int) -> Floats:
    """Return joints (count + 1, 3) along a polyline (P, 3), equally far apart, the last one at its end."""
    low, high = 0.0, float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())
    for _ in range(BISECTIONS):
        length = (low + high) / 2
        enough = len(lay_equal_chords(points, length)[0]) > count
        low, high = (length, high) if enough else (low, length)
    return np.asarray(lay_equal_chords(points, low)[0][: count + 1])


def _ring(chain: Chain, count: int) -> Floats:
    """Return joints (count + 1, 3) around a closed chain, the last equal to the first."""
    for trial in range(RING_TRIALS):
        factor = 1 - 0.005 * ((trial + 1) // 2) * (-1) ** trial
        joints = equal_ring(chain.joints[:-1], factor * chain.length / count)
        if len(joints) == count + 1:
            return joints
    raise InputError(f"segments={count}: a ring cannot be made of so few segments", code="value-out-of-bounds")
