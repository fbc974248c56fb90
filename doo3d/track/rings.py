"""Track rings over time, and align the joints of a ring from frame to frame.

A ring has no ends to mark its first joint. So its first joint is carried from frame to frame: of all rotations of a ring onto
the previous one, the one with the least bending, turning and sliding is taken. Where a ring is hidden, it is cut open in the
middle of the hidden part, and its strands are registered as those of a cable.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..config import TrackingConfig
from ..geometry.equal_segments import close_ring
from ..types import Bools, Chain, Floats
from .observations import LENGTH_ERROR, MIN_JOINED_CONFIDENCE, Observation, ObservedStrand
from .registration import STEPS_PER_SEGMENT, TURN_WEIGHT, Placed, fit_joints, place_strands
from .strand_ends import CUT_OFF
from .tracking import Tracker


@dataclass(frozen=True)
class RingTrack:
    """The chains of one ring: (frame, index, chain), in the order of frames."""

    items: tuple[tuple[int, int, Chain], ...]

    @property
    def closed(self) -> list[Chain]:
        """The closed chains."""
        return [chain for _, _, chain in self.items if chain.closed]

    def is_whole(self, chain: Chain, length: float) -> bool:
        """Return whether a chain of the track is the whole ring, of a length in m."""
        is_known = chain.closed and chain.confidence >= MIN_JOINED_CONFIDENCE
        return is_known and abs(chain.length - length) <= LENGTH_ERROR * length


def ring_tracks(observations: Sequence[Observation], tracking: TrackingConfig, least: int) -> list[RingTrack]:
    """Return the rings of a capture, with the chains that show a part of one.

    A track is a ring if at least `least` of its chains are closed, and more than its open chains of the same length whose ends
    are apart: the ends of a cable may touch for a while.
    """
    if not any(chain.closed for observation in observations for chain in observation.detection.chains):
        return []
    tracker, tracks = Tracker(tracking), dict[int, list[tuple[int, int, Chain]]]()
    for frame, observation in enumerate(observations):
        if not observation.detection.chains:
            continue
        tracked = tracker.update(replace(observation.detection, crossings=(), junctions=(), objects=()))
        for number, chain in enumerate(tracked.chains):
            assert chain.id is not None
            tracks.setdefault(chain.id, []).append((frame, number, observation.detection.chains[number]))
    return [track for track in map(RingTrack, map(tuple, tracks.values())) if _is_ring(track, least)]


def _is_ring(track: RingTrack, least: int) -> bool:
    """Return whether a track is a ring, as `ring_tracks` defines it."""
    lengths = [chain.length for chain in track.closed]
    if len(lengths) < least:
        return False
    length = float(np.median(lengths))
    long = [chain.joints for _, _, chain in track.items if not chain.closed and chain.length >= (1 - LENGTH_ERROR) * length]
    apart = [joints for joints in long if np.linalg.norm(joints[-1] - joints[0]) > 2 * LENGTH_ERROR * length]
    return len(lengths) > len(apart)


def align_rings(
    track: RingTrack, observations: Sequence[Observation], length: float, segments: int, tolerance: float
) -> list[tuple[bool, float]]:
    """Align the whole chains of a ring from frame to frame.

    Each chain is aligned with the ring in the previous frame, which is followed by its strands where a frame does not show it
    whole.

    Parameters
    ----------
    track
        the chains of the ring; its first joint is that of the first whole chain.
    observations
        all frames of the capture.
    length, segments
        length of the ring, m, and its number of segments.
    tolerance
        m, largest RMS distance of a strand from the ring in the previous frame.

    Returns
    -------
    For each whole chain whether it runs backwards, and the position of its first joint as a fraction of the ring, 0 to 1.
    """
    result = list[tuple[bool, float]]()
    last: Floats | None = None
    for frame, number, chain in track.items:
        if track.is_whole(chain, length):
            result.append((False, 0.0) if last is None else _align_with(last[:-1], chain))
            last = ring_joints(chain, *result[-1], segments)
        elif last is not None:
            strands = [strand for strand in observations[frame].strands if strand.chain == number]
            placed = place_on_ring(strands, last, length, tolerance)
            last = fit_ring(last, placed, length)[0] if placed else last
    return result


def ring_joints(chain: Chain, backwards: bool, start: float, segments: int) -> Floats:
    """Return the joints (segments + 1, 3) m of an aligned ring, closed.

    The last joint equals the first. backwards, start : alignment of the chain, from `align_rings`.
    """
    at = np.linspace(0.0, 1.0, segments + 1)[:-1] - start
    return _on_ring(chain.joints, -at if backwards else at)


def _on_ring(joints: Floats, shares: Floats) -> Floats:
    """Return points of a ring at fractions of its length, and the first again."""
    count = len(joints) - 1
    at = (shares % 1.0) * count
    low = np.minimum(at.astype(np.int64), count - 1)
    part = (at - low)[:, None]
    points = joints[low] * (1 - part) + joints[low + 1] * part
    return np.concatenate((points, points[:1]))


def _align_with(before: Floats, chain: Chain) -> tuple[bool, float]:
    """Align a chain with the joints (M, 3) m of its ring in an earlier frame.

    Over all rotations and both directions, the cost is the squared distance that remains after a rigid alignment (Kabsch
    algorithm), which is bending, plus TURN_WEIGHT times the squared distance before it. The minimum is refined by a parabola.

    Returns
    -------
    backwards, start : as of `align_rings`.
    """
    count = len(before)
    steps = STEPS_PER_SEGMENT * count
    reference = before - before.mean(axis=0)
    own = np.linspace(0.0, 1.0, steps + 1)[:-1]
    found: list[tuple[float, bool, float]] = []
    for backwards in (False, True):
        dense = _on_ring(chain.joints, -own if backwards else own)[:-1]
        index = (np.arange(steps)[:, None] + STEPS_PER_SEGMENT * np.arange(count)) % steps
        rotations = dense[index]
        rotations = rotations - rotations.mean(axis=1, keepdims=True)
        product = np.einsum("ski,kj->sij", rotations, reference)
        squares = (rotations**2).sum(axis=(1, 2)) + (reference**2).sum()
        moved = squares - 2 * np.trace(product, axis1=1, axis2=2)
        strength = np.linalg.svd(product, compute_uv=False)
        strength[:, 2] *= np.sign(np.linalg.det(product))
        cost = squares - 2 * strength.sum(axis=1) + moved * TURN_WEIGHT
        k = int(np.argmin(cost))
        left, middle, right = cost[k - 1], cost[k], cost[(k + 1) % steps]
        bow = left - 2 * middle + right
        finer = k + (0.5 * (left - right) / bow if bow > 0 else 0.0)
        found.append((float(middle), backwards, float(finer / steps)))
    _, backwards, first = min(found)  # the ring's first joint is at this fraction of the chain
    return backwards, -first % 1.0


def place_on_ring(strands: Sequence[ObservedStrand], expected: Floats, length: float, tolerance: float) -> list[Placed]:
    """Find the position of each strand of a frame along a ring.

    As `place_strands` along a cable, with the ring cut open opposite the middle of the longest strand; no end of a strand is a
    tip. Strands without depth do not determine how far a ring turned, and are left out.

    Parameters
    ----------
    strands
        the strands of the frame.
    expected
        (M + 1, 3) m, expected joints of the ring, the last equal to the first.
    length, tolerance
        m, as for `place_strands`.
    """
    strands = [replace(strand, tips=(CUT_OFF, CUT_OFF)) for strand in strands if not strand.is_flat]
    if not strands:
        return []
    count = len(expected) - 1
    segment = length / count
    longest = max(strands, key=lambda strand: strand.length)
    twice = place_strands([longest], np.concatenate((expected[:-1], expected)), 2 * length, tolerance)
    if not twice:
        return []
    seam = round((sum(twice[0].span) / 2 + length / 2) / segment) % count
    opened = np.concatenate((expected[seam:-1], expected[: seam + 1]))
    placed = place_strands(strands, opened, length, tolerance)
    return [replace(item, arcs=(_slid(item, opened, segment) + seam * segment) % length) for item in placed]


def _slid(item: Placed, expected: Floats, segment: float) -> Floats:
    """Return arc lengths (K,) m of a strand after sliding along the ring.

    Positions are tried in steps of a third of a segment, which suffices for a cable, whose ends fix its position; a ring is
    fixed by the previous frame alone. Slide and turn are solved by least squares. segment : m, length of a segment.
    """
    low = np.clip((item.arcs / segment).astype(np.int64), 0, len(expected) - 2)
    along = (expected[low + 1] - expected[low]) / segment
    there = expected[low] + (item.arcs - low * segment)[:, None] * along
    off, along, there = (each - each.mean(axis=0) for each in (item.points - there, along, there))
    turned = [np.cross(axis, there) for axis in np.eye(3)]
    moves = np.array([along, *turned]).reshape(4, -1).T
    normal = moves.T @ moves
    normal[1:, 1:] *= 1 + TURN_WEIGHT
    slide = float(np.linalg.lstsq(normal, moves.T @ off.ravel(), rcond=None)[0][0])
    return np.asarray(item.arcs + np.clip(slide, -segment, segment))


def fit_ring(expected: Floats, placed: Sequence[Placed], length: float) -> tuple[Floats, Bools, Bools]:
    """Fit the joints of a ring to the strands placed on it.

    As `fit_joints` for a cable, applied to three turns of the ring, of which the middle one is used.

    Parameters
    ----------
    expected
        (M + 1, 3) m, expected joints, the last equal to the first.
    placed
        the strands, with arc lengths from 0 to `length` along the ring.
    length
        m, length of the ring.

    Returns
    -------
    joints : (M + 1, 3) m, neighbors exactly `length` / M apart, the last equal to the first.
    seen, measured : (M + 1,) bool, as of `fit_joints`.
    """
    count = len(expected) - 1
    turns = np.concatenate((expected[:-1], expected[:-1], expected))
    around = [replace(item, arcs=item.arcs + turn * length) for item in placed for turn in range(3)]
    joints, *known = fit_joints(turns, around, 3 * length)
    seen, measured = (np.append(each[count : 2 * count], each[count]) for each in known)
    return close_ring(joints[count : 2 * count], length / count), seen, measured
