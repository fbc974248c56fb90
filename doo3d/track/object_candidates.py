"""Tracks that may be objects: those of one cable that was lost for a while, or shortened by an occluder, are one."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
from scipy.spatial.distance import cdist

from ..config import TrackingConfig
from ..types import Chain
from .chain_direction import reversed_chain
from .junction_vote import OPEN
from .observations import LENGTH_ERROR
from .tracks import CONTEXT, LEAP_NODES, Track


@dataclass
class Candidate:
    """A track that may be an object: its length, the items in which it is whole, and whether it may be a part of another."""

    length: float
    track: Track
    whole: list[tuple[int, int, Chain]]
    is_part: bool

    @property
    def seen(self) -> float:
        """How much is seen of it where it is whole, m: median over these frames."""
        return float(np.median([np.count_nonzero(~chain.occluded) * chain.segment_length for _, _, chain in self.whole]))

    @property
    def parts(self) -> tuple[tuple[int, int], ...]:
        """The (frame, chain) of the chains that are no longer than the whole, but not the whole."""
        whole = {(frame, chain) for frame, chain, _ in self.whole}
        longest = (1 + LENGTH_ERROR) * self.length
        return tuple((frame, n) for frame, n, chain in self.track.items if chain.length <= longest and (frame, n) not in whole)


def link_candidates(candidates: list[Candidate]) -> list[Candidate]:
    """Return the candidates, one for those of the same length that may be one object, which moved while it was hidden.

    Of several that were lost, such as branches of one length, the nearest is taken.
    """
    result: list[Candidate] = []
    for candidate in sorted(candidates, key=lambda candidate: candidate.whole[0][0]):
        alike = [former for former in result if _same_object(former, candidate)]
        if alike and candidate.track.pattern == OPEN:
            _append(alike[0], candidate)
        elif alike:
            _append(min(alike, key=lambda former: _distance(former, candidate)), candidate)
        else:
            result.append(candidate)
    return result


def _same_object(former: Candidate, later: Candidate) -> bool:
    """Tell whether two candidates of one length follow each other, or in no frame show more of a cable together than its length.

    Tracking gives the two parts of a cable that a hand divides one id each, and later the whole either of them.
    """
    is_alike = later.track.pattern in (former.track.pattern, former.track.pattern[::-1])
    if not is_alike or abs(later.length - former.length) > 2 * LENGTH_ERROR * former.length:
        return False
    gap = later.track.items[0][0] - former.track.items[-1][0]
    if gap > 0 or later.track.pattern != OPEN:
        return 0 < gap <= CONTEXT
    seen = {frame: chain.length for frame, _, chain in former.track.items}
    longest = (1 + LENGTH_ERROR) * former.length
    return all(seen.get(frame, 0.0) + chain.length <= longest for frame, _, chain in later.track.items if frame in seen)


def drop_shortened(candidates: list[Candidate], tracking: TrackingConfig) -> list[Candidate]:
    """Return the candidates without those that show another one shortened, as where an occluder hides a loop of it.

    Tracking loses a chain whose joints leap along the object, and so gives the same cable another id there.
    """
    longest_first = sorted(candidates, key=lambda candidate: -candidate.seen)
    shortened = set()
    for k, shorter in enumerate(longest_first):
        for longer in longest_first[:k]:
            if id(longer) not in shortened and _is_shortened(shorter, longer, tracking):
                _append(longer, shorter)
                shortened.add(id(shorter))
                break
    return [candidate for candidate in candidates if id(candidate) not in shortened]


def _is_shortened(shorter: Candidate, longer: Candidate, tracking: TrackingConfig) -> bool:
    """Tell whether a candidate lies where a longer one lay, and both never show more than that one's length in one frame."""
    if shorter.track.pattern != OPEN or longer.track.pattern != OPEN:
        return False
    shown = {frame: chain.length for frame, _, chain in longer.track.items}
    most = (1 + LENGTH_ERROR) * longer.length
    if any(shown[frame] + chain.length > most for frame, _, chain in shorter.track.items if frame in shown):
        return False
    pairs = itertools.product((shorter.track.items[0], shorter.track.items[-1]), longer.whole)
    (frame, _, chain), (other, _, whole) = min(pairs, key=lambda pair: abs(pair[0][0] - pair[1][0]))
    away = cdist(chain.nodes(LEAP_NODES), whole.joints).min(axis=1).mean()
    frames = max(1, abs(frame - other))
    return frames <= CONTEXT and float(away) <= frames * tracking.max_motion_lengths * longer.length


def _reverse_items(items: list[tuple[int, int, Chain]]) -> list[tuple[int, int, Chain]]:
    """Return the chains of frames in the opposite direction."""
    return [(frame, number, reversed_chain(chain, True)[0]) for frame, number, chain in items]


def _distance(former: Candidate, later: Candidate) -> float:
    """Return how far apart the middles of two candidates are, where one was lost and the other comes, m."""
    return float(np.linalg.norm(former.whole[-1][2].joints.mean(axis=0) - later.whole[0][2].joints.mean(axis=0)))


def _append(former: Candidate, later: Candidate) -> None:
    """Add a candidate to a former one, with the junction at the same end or in the direction in which it lies nearer.

    Of a frame in which both have a chain, the longer is kept.
    """
    start = later.whole[0]
    nearest = min(former.whole, key=lambda item: abs(item[0] - start[0]))
    last, first = nearest[2].joints[[0, -1]], start[2].joints[[0, -1]]
    is_nearer_backwards = bool(np.linalg.norm(first[::-1] - last) < np.linalg.norm(first - last))
    pattern = later.track.pattern
    if is_nearer_backwards if pattern[0] == pattern[1] else pattern != former.track.pattern:
        later.track.backwards = {frame: not value for frame, value in later.track.backwards.items()}
        later.track.patterns = {frame: value[::-1] for frame, value in later.track.patterns.items()}
        later.track.items, later.whole = _reverse_items(later.track.items), _reverse_items(later.whole)
    kept = {item[0]: (item, former.track) for item in former.track.items}
    for item in later.track.items:
        if item[0] not in kept or item[2].length > kept[item[0]][0][2].length:
            kept[item[0]] = item, later.track
    items = [kept[frame][0] for frame in sorted(kept)]
    backwards = {frame: track.backwards[frame] for frame, (_, track) in kept.items()}
    patterns = {frame: track.patterns[frame] for frame, (_, track) in kept.items()}
    ending = {frame for frame, (_, track) in kept.items() if frame in track.ending}
    former.track = Track(items, backwards, patterns, former.track.pattern, ending)
    former.whole = sorted([*former.whole, *later.whole], key=lambda item: item[0])
