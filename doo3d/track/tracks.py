"""Collect the open chains of a capture by object, and merge tracks of one object."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..config import TrackingConfig
from ..geometry.limits import FRAME_RATE, MAX_AGE
from ..types import Chain, Floats
from .chain_direction import reversed_chain
from .chain_matching import pair_chains
from .junction_vote import OPEN, ChainInFrame, Pattern, pattern_of, vote_pattern
from .object_length import FILLED_ERROR, MIN_FRAMES, vote_length
from .observations import LENGTH_ERROR, Observation
from .strand_ends import CUT_OFF, TIP

JUNCTION_SLACK_RADII = 1.5
"""Difference allowed in the length of a chain for each junction at its ends, in radii: junctions shift by as much from frame
to frame."""

WINDOW = 10 * FRAME_RATE
"""Number of frames that are followed together: 10 s of video."""

CONTEXT = 3 * FRAME_RATE
"""Maximum gap in frames between two tracks of a branch, and number of frames that are read before and after a window: 3 s of
video."""


@dataclass(frozen=True)
class Track:
    """The open chains of one object, in one direction.

    Attributes
    ----------
    items
        the chains, in the order of frames.
    pattern
        which ends of the object are at junctions, by a vote of all frames.
    """

    items: list[ChainInFrame]
    pattern: Pattern = OPEN

    def length(self, given: float | None) -> float:
        """Return the length of the object, m.

        Chains at other junctions than the vote are left out, and those with a hidden end if others have none. If chains end at
        two tips, the others are left out, too: a visible end may be where an occluder begins. given : m,
        `sequence.length`, which is the length of objects without junctions; None decides by a vote.
        """
        if given is not None and self.pattern == OPEN:
            return given
        items = [item for item in self.items if item.pattern == self.pattern] or self.items
        shown = [item for item in items if self._shows_both_ends(item)]
        whole = [item for item in shown if item.ends > CUT_OFF]
        return vote_length(*lengths_of([item.chain for item in whole or shown or items]))

    def whole(self, length: float) -> list[ChainInFrame]:
        """Return the chains that show the whole object, of a length in m.

        A chain that is visible in the image but partly without depth may differ more in length.
        """
        result = []
        for item in self.items:
            chain = item.chain
            slack = JUNCTION_SLACK_RADII * sum(self.pattern) * np.nan_to_num(chain.radius)
            torn = FILLED_ERROR * np.count_nonzero(chain.depth_filled & ~chain.occluded) * chain.segment_length
            is_long = abs(chain.length - length) <= np.hypot(LENGTH_ERROR * length, torn) + slack
            if is_long and item.pattern == self.pattern and self._shows_both_ends(item):
                result.append(item)
        return result

    def _shows_both_ends(self, item: ChainInFrame) -> bool:
        """Return whether both ends of a chain are visible or at a junction, where other strands give their position."""
        first, last = self.pattern[::-1] if item.backwards else self.pattern
        return bool((first or not item.chain.occluded[0]) and (last or not item.chain.occluded[-1]))


def lengths_of(chains: Sequence[Chain]) -> tuple[Floats, Floats]:
    """Return the lengths (K,) m of chains, and of their unmeasured parts."""
    filled = [chain.depth_filled.sum() * chain.segment_length for chain in chains]
    return np.array([chain.length for chain in chains]), np.array(filled, dtype=float)


def tracks_of(
    observations: Sequence[Observation], tracking: TrackingConfig, taken: Collection[tuple[int, int]] = ()
) -> list[Track]:
    """Return the open chains of all frames as tracks: chains that follow each other from frame to frame.

    observations : frames, in order. taken : (frame, chain) of the chains to leave out.
    """
    tracks: list[list[ChainInFrame]] = []
    last: list[tuple[int, Chain]] = []  # of each track, frame of the last chain, without empty frames, and that chain
    count = 0
    for frame, observation in enumerate(observations):
        all_chains = enumerate(observation.detection.chains)
        numbers = [number for number, chain in all_chains if not chain.closed and (frame, number) not in taken]
        if not numbers:
            continue
        count += 1
        ids = [id for id, (at, _) in enumerate(last) if count - at <= MAX_AGE + 1]
        chains = [observation.detection.chains[number] for number in numbers]
        pairs = pair_chains([last[id][1] for id in ids], chains, tracking)
        for number, chain, (known, match) in zip(numbers, chains, pairs, strict=True):
            id = len(tracks) if known is None else ids[known]
            if known is None:
                tracks.append([])
                last.append((count, chain))
            pattern = pattern_of(observation.detection, number, match.backwards)
            tips = [tip for strand in observation.strands if strand.chain == number for tip in strand.tips]
            ends = min(tips[0], tips[-1]) if tips else CUT_OFF
            tracks[id].append(ChainInFrame(frame, number, chain, match.backwards, pattern, id, ends))
            last[id] = count, reversed_chain(chain, match.backwards)[0]
    least = min(MIN_FRAMES, len(observations))
    return [Track(items, vote_pattern([item.pattern for item in items], least)) for items in tracks]


def merge_tracks(tracks: Sequence[Track], length: float | None, least: int) -> list[Track]:
    """Merge tracks that may be one object.

    Two tracks are two objects if enough frames show them side by side (`are_side_by_side`). Otherwise an object was
    lost and found again, was seen in pieces on both sides of an occluder, or its ends were hidden for a while. Branches are
    merged only if they end at the same junctions, are of one length, and follow each other in time.

    Parameters
    ----------
    tracks
        the tracks of a capture.
    length
        m, `sequence.length`; None if not given.
    least
        smallest number of frames that must show two objects at once.
    """
    merged: list[tuple[Track, float]] = []
    measured = ((track, track.length(length)) for track in tracks)
    for track, own in sorted(measured, key=lambda pair: (pair[0].pattern == OPEN, -pair[1])):
        same = [k for k, former in enumerate(merged) if _may_be_one(former, (track, own), least)]
        if not same:
            merged.append((track, own))
            continue
        nearest = min(same, key=lambda k: _distance(merged[k][0], track))
        if merged[nearest][0].pattern == track.pattern or track.pattern != OPEN:
            joined = _joined(merged[nearest][0], track)
            merged[nearest] = joined, joined.length(length)
    return sorted((track for track, _ in merged), key=lambda track: track.items[0].frame)


def are_side_by_side(first: Track, second: Track, longest: float, least: int) -> bool:
    """Return whether enough frames show two tracks as two objects.

    These are frames that show more of both than the longer object is long, or both from tip to tip. longest : length of the
    longer object, m. least : smallest number of frames.
    """
    shown = [{item.frame: item for item in track.items} for track in (first, second)]
    pairs = [(shown[0][frame], shown[1][frame]) for frame in shown[0].keys() & shown[1].keys()]
    return (
        sum(sum(map(_visible, pair)) > (1 + LENGTH_ERROR) * longest or all(map(_shows_two_tips, pair)) for pair in pairs) >= least
    )


def _visible(item: ChainInFrame) -> float:
    """Return the visible length of a chain, m."""
    return np.count_nonzero(~item.chain.occluded) * item.chain.segment_length


def _shows_two_tips(item: ChainInFrame) -> bool:
    """Return whether both ends of a chain are tips in plain view."""
    return item.ends == TIP and item.pattern == OPEN


def _may_be_one(former: tuple[Track, float], later: tuple[Track, float], least: int) -> bool:
    """Return whether two tracks, each with the length of its object in m, may be one object, as `merge_tracks` defines it."""
    (first, one), (track, other) = former, later
    if track.pattern == OPEN:
        return not are_side_by_side(first, track, max(one, other), least)
    if track.pattern not in (first.pattern, first.pattern[::-1]):
        return False
    gap = max(track.items[0].frame - first.items[-1].frame, first.items[0].frame - track.items[-1].frame)
    return abs(one - other) <= 2 * LENGTH_ERROR * one and 0 < gap <= CONTEXT


def _distance(former: Track, later: Track) -> float:
    """Return the distance between the centroids of the chains of two tracks that are nearest in time, m."""
    first, second = _nearest_in_time(former, later)
    return float(np.linalg.norm(first.chain.joints.mean(axis=0) - second.chain.joints.mean(axis=0)))


def _nearest_in_time(former: Track, later: Track) -> tuple[ChainInFrame, ChainInFrame]:
    """Return the chains of two tracks that are nearest in time."""
    frames = [np.array([item.frame for item in track.items]) for track in (former, later)]
    apart = np.abs(frames[0][:, None] - frames[1])
    first, second = np.unravel_index(apart.argmin(), apart.shape)
    return former.items[first], later.items[second]


def _joined(former: Track, later: Track) -> Track:
    """Return a track with the chains of a second one, turned to the same junctions, or else to the nearer ends."""
    is_turned = later.pattern != former.pattern
    if later.pattern[0] == later.pattern[1]:
        first, second = (item.nodes(2) for item in _nearest_in_time(former, later))
        is_turned = bool(np.linalg.norm(first - second[::-1]) < np.linalg.norm(first - second))
    turned = [item.reversed() for item in later.items] if is_turned else later.items
    return replace(former, items=sorted([*former.items, *turned], key=lambda item: (item.frame, item.number)))
