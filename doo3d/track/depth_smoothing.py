"""Smooth the depth of an object over the frames that show the same stretch of it.

A stereo camera measures the position of a strand in the image to a fraction of a pixel, but its depth has errors in waves of
many radii along the strand, which a single frame cannot distinguish from bends. From frame to frame these waves change, while
the bends change smoothly. So the inverse range is smoothed over time and along the object together, mostly the change of its
bends over time, according to the noise of this change. The rate at which bends change is known across the line of sight, where
the image measures well.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scipy.interpolate import interp1d

from ..config import TrackingConfig
from ..geometry.polyline import unit
from ..types import Bools, Chain, Floats, Ints
from .chain_direction import reversed_chain
from .depth_readings import NODES, PER_NODE, TORN_SHARE, torn_share
from .image_tracks import angles_along, image_tracks, is_of_camera, resampled
from .inverse_range_smoother import UNSEEN_WEIGHT, smooth_inverse_range
from .junction_vote import vote_pattern
from .object_length import track_length
from .observations import Observation, ObservedStrand, bounds
from .torn_depth import WINDOW_FRAMES, correct_torn_depth
from .tracks import MIN_FRAMES, WINDOW, Track

MAX_LENGTH_CHANGE = 0.1
"""Largest relative change of an object's length in the image between successive frames of a stretch: beyond it an occluder
came or went. Within a stretch, equal fractions of the length are the same places of the object."""

WHOLE_TOLERANCE = 0.03
"""Largest relative difference between an object's length in the image and its median over WINDOW_FRAMES frames on either side.
Beyond it an end is hidden; the image decides this better than depth."""


def smooth_depth_over_time(
    observations: Sequence[Observation], tracking: TrackingConfig, length: float | None = None
) -> list[Observation]:
    """Return observations with the depth of chains and strands smoothed over time.

    Frames that show the same stretch of an object are smoothed together. Chains are tracked in the image, where errors of
    depth do not change their lengths.

    Parameters
    ----------
    observations
        frames in order, of one camera, in its frame. Observations in another frame, such as of clouds, are returned unchanged.
    tracking
        the section `tracking` of a Config.
    length
        m, `sequence.length`; None to decide it by the frames.
    """
    result = list(observations)
    if not is_of_camera(observations):
        return result
    for track in image_tracks(observations, tracking).values():
        stretches = [_Stretch.of(items, track, observations) for items in _stretches(track.items)]
        steady = [smooth_chains(stretch.frames, stretch.chains) for stretch in stretches]
        torn = [k for k, stretch in enumerate(stretches) if stretch.is_torn]
        longest = _length(track, stretches, steady, length) if torn else np.inf
        for k in torn:
            steady[k] = smooth_chains(stretches[k].frames, stretches[k].chains, stretches[k].readings, longest)
        for stretch, chains in zip(stretches, steady, strict=True):
            for frame, number, chain in zip(stretch.frames, stretch.numbers, chains, strict=True):
                own = reversed_chain(chain, track.backwards[frame])[0]
                result[frame] = _with_chain(result[frame], number, own)
    return result


class _Stretch(NamedTuple):
    """Successive frames that show the same stretch of an object.

    Attributes
    ----------
    frames
        indices of the frames.
    numbers
        index of the chain in the detection of each frame.
    chains
        the chains, in one direction.
    readings
        the depth along each chain, from `readings_along`, in the same direction; None if its depth is not torn.
    """

    frames: list[int]
    numbers: list[int]
    chains: list[Chain]
    readings: list[Floats | None]

    @staticmethod
    def of(items: Sequence[tuple[int, int, Chain]], track: Track, observations: Sequence[Observation]) -> _Stretch:
        """Return the stretch of (frame, index, chain) items of a track."""
        stretch = _Stretch([], [], [], [])
        for frame, number, _ in items:
            observation, backwards = observations[frame], track.backwards[frame]
            own = observation.readings[number] if observation.readings else None
            stretch.frames.append(frame)
            stretch.numbers.append(number)
            stretch.chains.append(reversed_chain(observation.detection.chains[number], backwards)[0])
            stretch.readings.append(own[:, ::-1, ::-1] if own is not None and backwards else own)
        return stretch

    @property
    def is_torn(self) -> bool:
        """Whether the mean fraction of visible segments without depth exceeds TORN_SHARE."""
        if all(each is None for each in self.readings):
            return False
        return bool(np.mean([torn_share(chain) for chain in self.chains]) > TORN_SHARE)


def _length(track: Track, stretches: Sequence[_Stretch], chains: Sequence[Sequence[Chain]], given: float | None) -> float:
    """Return the length of a track's object, m, from its chains with smoothed depth.

    given : m, `sequence.length`, which replaces the vote for objects without junctions; None if not given.
    """
    both = zip(stretches, chains, strict=True)
    items = [item for each, steady in both for item in zip(each.frames, each.numbers, steady, strict=True)]
    pattern = vote_pattern(list(track.patterns.values()), min(MIN_FRAMES, len(items)))
    return track_length(replace(track, items=items, pattern=pattern), given)


def _stretches(items: Sequence[tuple[int, int, Chain]]) -> list[Sequence[tuple[int, int, Chain]]]:
    """Return the items of a track in stretches of similar length in the image.

    A stretch is within one WINDOW of frames.
    """
    starts = [
        number
        for number, (last, item) in enumerate(pairwise(items), 1)
        if item[0] // WINDOW != last[0] // WINDOW or abs(item[2].length - last[2].length) > MAX_LENGTH_CHANGE * last[2].length
    ]
    return [items[first:end] for first, end in pairwise([0, *starts, len(items)])]


def _with_chain(observation: Observation, number: int, chain: Chain) -> Observation:
    """Return an observation with one chain replaced, and its strands moved along.

    The new chain has the same number of segments.
    """
    detection = observation.detection
    before = detection.chains[number]
    chains = (*detection.chains[:number], chain, *detection.chains[number + 1 :])
    strands = (_move_strand(each, before, chain) if each.chain == number else each for each in observation.strands)
    return replace(observation, detection=replace(detection, chains=chains), strands=tuple(strands))


def _move_strand(strand: ObservedStrand, before: Chain, chain: Chain) -> ObservedStrand:
    """Return a strand of one chain at the same joints of another one.

    before, chain : the two chains, with the same number of segments.
    """
    start = int(np.argmin(np.linalg.norm(before.joints - strand.points[0], axis=1)))
    at = start + np.rint((strand.arcs - strand.arcs[0]) / before.segment_length).astype(np.int64)
    share = chain.segment_length / before.segment_length
    return replace(strand, points=chain.joints[at], arcs=strand.arcs * share, length=strand.length * share)


def smooth_chains(
    frames: Sequence[int], chains: Sequence[Chain], readings: Sequence[Floats | None] | None = None, longest: float = np.inf
) -> list[Chain]:
    """Return the chains of one object with their depth smoothed over time.

    Positions across the line of sight stay.

    Parameters
    ----------
    frames
        index in the capture of the frame of each chain, ascending.
    chains
        the chains, each the whole object or nearly so, in one direction and in the camera frame. Fewer than MIN_FRAMES (3) are
        returned unchanged, and so is a chain whose length in the image differs from that of its neighbors in time.
    readings
        for each chain the depth along it, from `readings_along`, to correct torn depth; None keeps the detected depth.
    longest
        m, length of the object.

    Returns
    -------
    Chains with the same numbers of segments, of equal length in each.
    """
    turned = [angles_along(chain.joints) for chain in chains]
    angle = np.array([angles[-1] for angles in turned])
    usual = np.array([np.median(angle[max(0, k - WINDOW_FRAMES) : k + WINDOW_FRAMES + 1]) for k in range(len(chains))])
    whole = np.flatnonzero(np.abs(angle - usual) <= WHOLE_TOLERANCE * usual).tolist()
    if len(whole) < MIN_FRAMES:
        return list(chains)
    at = np.array([frames[k] for k in whole]) - frames[whole[0]]
    given = [chains[k] for k in whole]
    in_image = [turned[k] for k in whole]
    read = None if readings is None else _at_frames(at, [readings[k] for k in whole])
    lines = _smooth_lines(at, given, in_image, read, longest)
    result = list(chains)
    for k, line in zip(whole, lines, strict=True):
        result[k] = resampled(chains[k], line, chains[k].radius)
    return result


def _at_frames(at: Ints, readings: Sequence[Floats | None]) -> Floats:
    """Return readings arranged by frame, (2, T, NODES, PER_NODE).

    at : indices of the frames, ascending from 0; T is the last one plus 1. readings : (2, NODES, PER_NODE) each, or None.
    Frames without readings have NaN.
    """
    result = np.full((2, at[-1] + 1, NODES, PER_NODE), np.nan)
    for row, each in zip(at.tolist(), readings, strict=True):
        if each is not None:
            result[:, row] = each
    return result


def _smooth_lines(
    at: Ints, chains: Sequence[Chain], arcs: Sequence[Floats], readings: Floats | None, longest: float
) -> list[Floats]:
    """Return the joints of chains with their depth smoothed over time.

    Parameters
    ----------
    at
        (N,) indices of the frames of the chains, ascending from 0.
    chains
        N chains.
    arcs
        for each chain the position of its joints along it, in any unit.
    readings
        (2, T, NODES, PER_NODE) 1/m, from `_at_frames`; None keeps the detected depth.
    longest
        m, length of the object.
    """
    distances = [np.linalg.norm(chain.joints, axis=1) for chain in chains]
    weights = [np.where(bounds(~chain.depth_filled), 1.0, UNSEEN_WEIGHT) for chain in chains]
    known = [np.column_stack((1 / distance, weight)) for distance, weight in zip(distances, weights, strict=True)]
    rays = _at_places(at, arcs, [unit(chain.joints) for chain in chains])  # give the transverse bending
    inverse, weight = np.moveaxis(np.nan_to_num(_at_places(at, arcs, known)), 2, 0)
    right = inverse
    if readings is not None:
        radius = float(np.median([chain.radius for chain in chains]))
        right, weight = correct_torn_depth(inverse, weight, rays, readings, radius, longest)
    smooth = smooth_inverse_range(right, weight, rays, longest)
    places, lines = np.linspace(0.0, 1.0, NODES), []
    for row, arc, distance, chain in zip(at.tolist(), arcs, distances, chains, strict=True):
        share = arc / arc[-1]
        is_right = np.interp(share, places, right[row] != inverse[row]) == 0
        change = distance * np.interp(share, places, smooth[row] - inverse[row])
        nearer = np.where(is_right, change, distance * np.interp(share, places, smooth[row]) - 1)
        lines.append(chain.joints / (1 + nearer)[:, None])
    return lines


def _at_places(at: Ints, arcs: Sequence[Floats], values: Sequence[Floats]) -> Floats:
    """Return values of joints interpolated at evenly spaced places, (T, NODES, C).

    values : (M, C) for each chain. at, arcs : as for `_smooth_lines`. Frames without a chain have NaN.
    """
    result = np.full((at[-1] + 1, NODES, values[0].shape[1]), np.nan)
    places = np.linspace(0.0, 1.0, NODES)
    for row, arc, each in zip(at.tolist(), arcs, values, strict=True):
        share = arc / arc[-1]
        low = np.clip(share.searchsorted(places), 1, len(arc) - 1) - 1
        slope = (each[low + 1] - each[low]) / (share[low + 1] - share[low])[:, None]
        result[row] = slope * (places - share[low])[:, None] + each[low]
    return result


def smooth_joint_depth(joints: Floats, seen: Bools) -> Floats:
    """Return the joints of successive frames with their depth smoothed over time.

    joints : (T, M + 1, 3) m, in the camera frame, as the result. seen : (T, M + 1) bool, True for visible joints.
    """
    if len(joints) < MIN_FRAMES:
        return joints
    distance = np.linalg.norm(joints, axis=2)
    places, at = np.linspace(0.0, 1.0, NODES), np.linspace(0.0, 1.0, joints.shape[1])
    values = np.dstack((1 / distance, np.where(seen, 1.0, UNSEEN_WEIGHT), joints / distance[:, :, None]))
    inverse, weight, *rays = np.moveaxis(interp1d(at, values, axis=1)(places), 2, 0)
    change = smooth_inverse_range(inverse, weight, np.stack(rays, axis=2)) - inverse
    nearer = distance * interp1d(places, change, axis=1)(at)
    return np.asarray(joints / (1 + nearer)[:, :, None])
