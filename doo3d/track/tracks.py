"""The open chains of a capture by the id that tracking gives them, and which of them show an object whole."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field

import numpy as np

from ..config import TrackingConfig
from ..geometry.limits import FRAME_RATE, MAX_AGE
from ..types import Chain, Floats
from .chain_direction import reversed_chain
from .chain_matching import pair_chains
from .depth_readings import torn_share
from .junction_vote import OPEN, ChainInFrame, Pattern, pattern_of
from .observations import LENGTH_ERROR, MIN_JOINED_CONFIDENCE, Observation
from .strand_ends import CUT_OFF

JUNCTION_SLACK_RADII = 1.5
"""Radii per junction at its ends by which a chain's length may differ further: so far junctions shift from frame to frame."""

FILLED_ERROR = 0.05
"""Share of what is filled in a chain, hidden or without depth, by which its length is uncertain, beside LENGTH_ERROR of the
whole: in 24 sequences of moving cables the median of this error is 1 to 9 %, but where strands were joined wrongly."""

MIN_FRAMES = 3
"""Fewest frames in which an object is seen whole; all frames in a shorter capture."""

LEAP_NODES = 20
"""Points of a chain at which its place in one frame is compared with that in others."""

WINDOW = 10 * FRAME_RATE
"""Frames of a window, which are followed and whose depth is smoothed together: 10 s of video."""

CONTEXT = 3 * FRAME_RATE
"""Frames over which an object is followed though it is not seen: up to so many frames after a chain was lost, one of its length
is taken for it, wherever it lies, and so many are read before and after a window. 3 s of video."""


@dataclass
class Track:
    """The open chains of one id, in one direction.

    Attributes
    ----------
    items
        in the order of their frames: the frame, the index of the chain in it, and the chain in the direction of tracking.
    backwards
        by frame, whether the chain in the frame runs the other way.
    patterns, pattern
        which ends of the chain are at junctions: by frame, and as most frames say.
    ending
        the frames in which the chain ends at tips or junctions, as far as the image tells: no end is hidden or goes on.
    """

    items: list[tuple[int, int, Chain]]
    backwards: dict[int, bool]
    patterns: dict[int, Pattern]
    pattern: Pattern = OPEN
    ending: set[int] = field(default_factory=set)

    @property
    def lengths(self) -> tuple[Floats, Floats]:
        """The lengths (K,) m of the chains that show both ends, of all if there are none, and how much of each was not measured.

        Chains that end at other junctions than most are left out. Where enough frames show both ends as tips, the others are
        left out too: an end may be seen up to what hides the rest.
        """
        items = [item for item in self.items if self.patterns[item[0]] == self.pattern]
        shown = [item for item in items if _shows_both_ends(item[2], self.pattern)]
        whole = [item for item in shown if item[0] in self.ending]
        return lengths_of([item[2] for item in (whole if len(whole) >= MIN_FRAMES else shown or items or self.items)])

    def is_whole(self, item: tuple[int, int, Chain], length: float) -> bool:
        """Tell whether one of its chains is the whole object, of a length in m.

        Where the image shows the chain, and its depth was not measured, its length may differ more. What is hidden may be joined
        wrongly, which only the length tells.
        """
        frame, _, chain = item
        if self.patterns[frame] != self.pattern or not _shows_both_ends(chain, self.pattern):
            return False
        slack = JUNCTION_SLACK_RADII * sum(self.pattern) * np.nan_to_num(chain.radius)
        torn = FILLED_ERROR * torn_share(chain) * chain.length
        return bool(abs(chain.length - length) <= np.hypot(LENGTH_ERROR * length, torn) + slack)

    @property
    def tracked(self) -> list[ChainInFrame]:
        """The chains that end at junctions as most do, by frame and index."""
        return [
            ChainInFrame(frame, chain, self.backwards[frame])
            for frame, chain, _ in self.items
            if self.patterns[frame] == self.pattern
        ]


def lengths_of(chains: Sequence[Chain]) -> tuple[Floats, Floats]:
    """Return the lengths (K,) m of chains, and the lengths (K,) m of those of their parts whose depth was not measured."""
    filled = [chain.depth_filled.sum() * chain.segment_length for chain in chains]
    return np.array([chain.length for chain in chains]), np.array(filled, dtype=float)


def tracks_of(
    observations: Sequence[Observation], tracking: TrackingConfig, taken: Collection[tuple[int, int]] = ()
) -> dict[int, Track]:
    """Return the open chains of all frames by the id that tracking gives them, all of one id in one direction.

    taken : (frame, chain) of the chains to leave out.
    """
    tracks: dict[int, Track] = {}
    last: dict[int, tuple[int, Chain]] = {}  # by id, the frame that showed its chain last, counted without empty ones, and this
    nodes: dict[int, Floats] = {}  # by id, points along its last chain
    sure: dict[int, Floats] = {}  # and along its last sure chain: a doubtful one alone does not tell how the next one runs
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
    """Tell whether a chain runs against that of some earlier ones which it lies nearest to.

    nodes, before : (LEAP_NODES, 3) m, evenly spaced points along the chain, and along each of the earlier ones.
    """
    earlier = np.array(before)
    forward, backward = (np.linalg.norm(earlier - way, axis=2).mean(axis=1).min() for way in (nodes, nodes[::-1]))
    return bool(backward < forward)


def drop_leaps(items: list[tuple[int, int, Chain]], tracking: TrackingConfig) -> list[tuple[int, int, Chain]]:
    """Return whole chains without those that lie elsewhere than the ones before and after, the farthest first.

    One frame that joins the strands wrongly would bend the object in all frames in which a part of it is hidden.
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
    """Return how far a chain lies from where those before and after say, mean over its nodes, in lengths of the chain."""
    frame, _, chain = items[k]
    beside = [n for n in (k - 1, k + 1) if 0 <= n < len(items)]
    if len(beside) == 1:
        return _mean_distance(nodes[k], nodes[beside[0]]) / abs(items[beside[0]][0] - frame) / chain.length
    first, last = (items[n][0] for n in beside)
    share = (frame - first) / (last - first)
    return _mean_distance(nodes[k], (1 - share) * nodes[k - 1] + share * nodes[k + 1]) / chain.length


def _mean_distance(first: Floats, second: Floats) -> float:
    """Return the mean distance of points (K, 3) from others of the same number."""
    return float(np.linalg.norm(first - second, axis=1).mean())


def _shows_both_ends(chain: Chain, pattern: Pattern) -> bool:
    """Tell whether both ends are seen in the image; one at a junction is where the strands that meet there say."""
    return not (chain.occluded[0] and not pattern[0]) and not (chain.occluded[-1] and not pattern[1])
