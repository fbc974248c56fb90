"""Merge tracks of one object that was lost or shortened for a while."""

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
    """A track that may be an object of the capture.

    Attributes
    ----------
    length
        m, length of the object.
    track
        the chains of the track.
    whole
        (frame, index, chain) of the chains that show the object whole.
    is_part
        whether the track may be a part of another object.
    """

    length: float
    track: Track
    whole: list[tuple[int, int, Chain]]
    is_part: bool

    @property
    def seen(self) -> float:
        """Median visible length of the whole chains, m."""
        return float(np.median([np.count_nonzero(~chain.occluded) * chain.segment_length for _, _, chain in self.whole]))

    @property
    def parts(self) -> tuple[tuple[int, int], ...]:
        """(frame, index) of the chains that show only a part of the object.

        Chains that are longer than the whole are left out.
        """
        whole = {(frame, chain) for frame, chain, _ in self.whole}
        longest = (1 + LENGTH_ERROR) * self.length
        return tuple((frame, n) for frame, n, chain in self.track.items if chain.length <= longest and (frame, n) not in whole)


def link_candidates(candidates: list[Candidate]) -> list[Candidate]:
    """Merge candidates of one length that may be one object, lost and found again.

    A cable that moved while it was hidden has two tracks. Of several candidates, such as branches of one length, the nearest
    is taken.
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
    """Return whether two candidates of one length may be the same object.

    Either the second one starts after the first one ends, or no frame shows more of a cable in both than its length: when a
    hand divides a cable, tracking gives each part an id, and later the whole cable one of the two.
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
    """Merge each candidate that an occluder shortened into the longer one.

    Where an occluder hides a loop of a cable, its joints leap along the cable, tracking loses the chain, and the cable gets
    another id.
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
    """Return whether a candidate is a shortened view of a longer one.

    It is at the place of the longer one, and no frame shows more in both than the length of the longer one.
    """
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
    """Return the chains of (frame, index, chain) items in the opposite direction."""
    return [(frame, number, reversed_chain(chain, True)[0]) for frame, number, chain in items]


def _distance(former: Candidate, later: Candidate) -> float:
    """Return the distance between the centroids of two candidates, m.

    The last whole chain of the former candidate is compared with the first whole chain of the later one.
    """
    return float(np.linalg.norm(former.whole[-1][2].joints.mean(axis=0) - later.whole[0][2].joints.mean(axis=0)))


def _append(former: Candidate, later: Candidate) -> None:
    """Add the chains of a later candidate to a former one, in the same direction.

    The junctions of the ends decide the direction, or else the nearer end positions. If both have a chain in one frame, the
    longer chain is kept.
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
