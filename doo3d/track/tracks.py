"""Collect the open chains of a capture by object id, and select whole ones."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field

import numpy as np

from ..config import TrackingConfig
from ..geometry.limits import FRAME_RATE, MAX_AGE
from ..types import Chain, Floats
from .chain_direction import reversed_chain
from .chain_matching import pair_chains
from .junction_vote import OPEN, ChainInFrame, Pattern, pattern_of
from .observations import LENGTH_ERROR, MIN_JOINED_CONFIDENCE, Observation
from .strand_ends import CUT_OFF

JUNCTION_SLACK_RADII = 1.5
"""Difference allowed in the length of a chain for each junction at its ends, in radii: junctions shift by as much from frame
to frame."""

FILLED_ERROR = 0.05
"""Relative error of the filled length of a chain, hidden or without depth, in addition to LENGTH_ERROR of the whole: in 24
sequences of moving cables the median of this error is 1 to 9 %, except where strands were joined wrongly."""

MIN_FRAMES = 3
"""Smallest number of frames in which an object is seen whole; all frames in a shorter capture."""

LEAP_NODES = 20
"""Number of points of a chain at which its positions in two frames are compared."""

WINDOW = 10 * FRAME_RATE
"""Number of frames that are followed, and whose depth is smoothed, together: 10 s of video."""

CONTEXT = 3 * FRAME_RATE
"""Maximum gap in frames for re-identifying a lost object by its length, regardless of position, and number of frames that are
read before and after a window: 3 s of video."""


@dataclass
class Track:
    """The open chains of one id, in one direction.

    Attributes
    ----------
    items
        (frame, index of the chain in it, chain in the direction of tracking), in the order of frames.
    backwards
        for each frame whether its chain runs in the opposite direction.
    patterns, pattern
        which ends of the chain are at junctions: for each frame, and by a vote of all frames.
    ending
        the frames in which both ends are tips or junctions, as far as the image shows: neither is hidden or continues.
    """

    items: list[tuple[int, int, Chain]]
    backwards: dict[int, bool]
    patterns: dict[int, Pattern]
    pattern: Pattern = OPEN
    ending: set[int] = field(default_factory=set)

    @property
    def lengths(self) -> tuple[Floats, Floats]:
        """Lengths (K,) m of chains with both ends visible, and their unmeasured parts.

        Chains at other junctions than the vote are left out. If enough frames have a tip at both ends, the other frames are
        left out, too: a visible end may be where an occluder begins. Without such chains, all are taken.
        """
        items = [item for item in self.items if self.patterns[item[0]] == self.pattern]
        shown = [item for item in items if _shows_both_ends(item[2], self.pattern)]
        whole = [item for item in shown if item[0] in self.ending]
        return lengths_of([item[2] for item in (whole if len(whole) >= MIN_FRAMES else shown or items or self.items)])

    def is_whole(self, item: tuple[int, int, Chain], length: float) -> bool:
        """Return whether an item of the track is the whole object, of a length in m.

        A chain that is visible in the image but partly without depth may differ more in length. A hidden part may be joined
        wrongly, which only its length reveals.
        """
        frame, _, chain = item
        if self.patterns[frame] != self.pattern or not _shows_both_ends(chain, self.pattern):
            return False
        slack = JUNCTION_SLACK_RADII * sum(self.pattern) * np.nan_to_num(chain.radius)
        torn = FILLED_ERROR * np.count_nonzero(chain.depth_filled & ~chain.occluded) * chain.segment_length
        return bool(abs(chain.length - length) <= np.hypot(LENGTH_ERROR * length, torn) + slack)

    @property
    def tracked(self) -> list[ChainInFrame]:
        """The chains with the voted pattern of junctions, by frame and index."""
        return [
            ChainInFrame(frame, chain, self.backwards[frame])
            for frame, chain, _ in self.items
            if self.patterns[frame] == self.pattern
        ]


def lengths_of(chains: Sequence[Chain]) -> tuple[Floats, Floats]:
    """Return the lengths (K,) m of chains, and of their unmeasured parts."""
    filled = [chain.depth_filled.sum() * chain.segment_length for chain in chains]
    return np.array([chain.length for chain in chains]), np.array(filled, dtype=float)


def tracks_of(
    observations: Sequence[Observation], tracking: TrackingConfig, taken: Collection[tuple[int, int]] = ()
) -> dict[int, Track]:
    """Return the open chains of all frames by id, those of one id in one direction.

    observations : frames, in order. taken : (frame, chain) of the chains to leave out.
    """
    tracks: dict[int, Track] = {}
    last: dict[int, tuple[int, Chain]] = {}  # by id, frame of the last chain, without empty frames, and that chain
    nodes: dict[int, Floats] = {}  # by id, points along the last chain
    sure: dict[int, Floats] = {}  # and along the last certain chain, for the direction of the next one
    count = 0
    for frame, observation in enumerate(observations):
        all_chains = enumerate(observation.detection.chains)
        numbers = [number for number, chain in all_chains if not chain.closed and (frame, number) not in taken]
        if not numbers:
            continue
        count += 1
        ids = sorted(id for id, (at, _) in last.items() if count - at <= MAX_AGE + 1)
        chains = [observation.detection.chains[number] for number in numbers]
        for number, chain, (known, match) in zip(
            numbers, chains, pair_chains([last[id][1] for id in ids], chains, tracking), strict=True
        ):
            id = len(tracks) if known is None else ids[known]
            track = tracks.setdefault(id, Track([], {}, {}))
            pattern, backwards = pattern_of(observation.detection, number, match.backwards), match.backwards
            given = chain.nodes(LEAP_NODES)
            if id in sure and pattern == OPEN:
                backwards = _runs_backwards(given, (nodes[id], sure[id]))
            last[id] = count, reversed_chain(chain, backwards)[0]
            nodes[id] = given[::-1] if backwards else given
            if chain.confidence >= MIN_JOINED_CONFIDENCE:
                sure[id] = nodes[id]
            track.items.append((frame, number, last[id][1]))
            track.backwards[frame], track.patterns[frame] = backwards, pattern
            tips = [tip for strand in observation.strands if strand.chain == number for tip in strand.tips]
            if tips and tips[0] > CUT_OFF and tips[-1] > CUT_OFF:
                track.ending.add(frame)
    return tracks


def _runs_backwards(nodes: Floats, before: Sequence[Floats]) -> bool:
    """Return whether a chain runs against the direction of the nearest earlier chain.

    nodes, before : (LEAP_NODES, 3) m, evenly spaced points along the chain, and along each of the earlier ones.
    """
    earlier = np.array(before)
    forward, backward = (np.linalg.norm(earlier - way, axis=2).mean(axis=1).min() for way in (nodes, nodes[::-1]))
    return bool(backward < forward)


def drop_leaps(items: list[tuple[int, int, Chain]], tracking: TrackingConfig) -> list[tuple[int, int, Chain]]:
    """Remove whole chains whose position leaps between its neighbors in time.

    The farthest is removed first. One frame that joins strands wrongly would bend the object in all frames in which a part of
    it is hidden.
    """
    kept = list(items)
    nodes = [chain.nodes(LEAP_NODES) for _, _, chain in items]
    leaps = [_leap(kept, nodes, k) for k in range(len(kept))] if len(kept) > MIN_FRAMES else []
    while len(kept) > MIN_FRAMES and max(leaps) > tracking.max_motion_lengths:
        farthest = int(np.argmax(leaps))
        del kept[farthest], nodes[farthest], leaps[farthest]
        for k in range(max(0, farthest - 1), min(len(kept), farthest + 1)):
            leaps[k] = _leap(kept, nodes, k)
    return kept


def _leap(items: Sequence[tuple[int, int, Chain]], nodes: Sequence[Floats], k: int) -> float:
    """Return the mean distance of a chain from its interpolated position.

    The position is interpolated between the items before and after item k; the unit is the length of
    the chain. nodes : (LEAP_NODES, 3) m, of each item.
    """
    frame, _, chain = items[k]
    beside = [n for n in (k - 1, k + 1) if 0 <= n < len(items)]
    if len(beside) == 1:
        return _mean_distance(nodes[k], nodes[beside[0]]) / abs(items[beside[0]][0] - frame) / chain.length
    first, last = (items[n][0] for n in beside)
    share = (frame - first) / (last - first)
    return _mean_distance(nodes[k], (1 - share) * nodes[k - 1] + share * nodes[k + 1]) / chain.length


def _mean_distance(first: Floats, second: Floats) -> float:
    """Return the mean distance between corresponding points (K, 3)."""
    return float(np.linalg.norm(first - second, axis=1).mean())


def _shows_both_ends(chain: Chain, pattern: Pattern) -> bool:
    """Return whether both ends of a chain are visible or at a junction.

    The position of an end at a junction is given by the other strands that meet there.
    """
    return not (chain.occluded[0] and not pattern[0]) and not (chain.occluded[-1] and not pattern[1])
