"""How well chains in the image fit the instance labels of a photograph."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from scipy.optimize import linear_sum_assignment
from scipy.spatial import cKDTree

from ...errors import require
from ...types import Array, Bools, Chain, Floats, Ints
from .datasets import SPECK

STEP = 0.5  # px, between the samples of a chain that distances are measured to: wrong by 0.03 px at a distance of 1
NEAR = 5.0  # px: a chain this close to the centre line follows it
TRACED = 0.95  # recall and precision above which a cable is traced
BRIDGE = 41  # px: parts of a cable this far apart, with another cable between them, are one below it
_CELLS = 4_000_000  # pixels of boxes that are looked at together


@dataclass(frozen=True)
class PhotoScore:
    """One photograph.

    drawn, labelled : DICE, 0 to 1, averaged over the cables; of the chains as drawn with their own width, and of the mask
    with each pixel given to the nearest chain. ordered : as labelled, but a pixel that the right chain covers as drawn is
    its own: which of two cables shows at a crossing is no matter of order, and costs even the true lines 0.7 % on S2 and
    1.2 % on S3. cables, chains : how many there are and were found.
    match : (cables,) int, the chain that each cable has as drawn; -1 where it has none.
    """

    drawn: float
    labelled: float
    ordered: float
    cables: int
    chains: int
    match: Ints

    @property
    def count_right(self) -> bool:
        return self.cables == self.chains


@dataclass(frozen=True)
class Traced:
    """One cable alone. recall : share of its centre line that the chain is near to. precision : share of the chain near it."""

    recall: float
    precision: float

    @property
    def good(self) -> bool:
        return self.recall > TRACED and self.precision > TRACED


def score_photo(chains: Sequence[Chain], labels: Ints, mask: Bools) -> PhotoScore:
    """The chains against (H, W) labels, 0 = background; the mask (H, W) is what they were found in."""
    cables, shape = int(labels.max(initial=0)), (labels.shape[0], labels.shape[1])
    covers = np.array([drawn_pixels(chain, shape) for chain in chains], dtype=bool).reshape(len(chains), *shape)
    drawn, match = _matched(_dice(labels, cables, [labels[pixels] for pixels in covers]))
    owner = nearest_chain(chains, _places(mask)) if len(chains) else np.full(mask.sum(), -1)
    labelled, nearest = _matched(_dice(labels, cables, [labels[mask][owner == i] for i in range(len(chains))]))
    for cable, chain in enumerate(nearest, start=1):
        if chain >= 0:
            owner = np.where((labels[mask] == cable) & covers[chain][mask], chain, owner)
    ordered, _ = _matched(_dice(labels, cables, [labels[mask][owner == i] for i in range(len(chains))]))
    return PhotoScore(drawn, labelled, ordered, cables, len(chains), match)


def trace(chain: Chain | None, labels: Ints, cable: int) -> Traced:
    """A chain that was found in the pixels of one cable of (H, W) labels alone.

    Recall is over the skeleton of the cable's own pixels but for specks, which the labels have at other cables' edges.
    Where another cable lies over it the centre line is not known; there a chain is as good as on it within the bridge:
    what closing the cable's pixels adds of other cables'.
    """
    if chain is None:
        return Traced(0.0, 0.0)
    skeletonize = require("skimage.morphology", "test").skeletonize
    own = _without_specks(labels == cable)
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (BRIDGE, BRIDGE))
    closed = cv2.morphologyEx(np.pad(own, BRIDGE).astype(np.uint8), cv2.MORPH_CLOSE, disc)[BRIDGE:-BRIDGE, BRIDGE:-BRIDGE] > 0
    center, bridge = skeletonize(own), closed & ~own & (labels > 0)
    line = samples(chain)
    return Traced(_near(_places(center), line), _near(line, np.concatenate((_places(center), _places(bridge)))))


def samples(chain: Chain) -> Floats:
    """(P, 2) px: points on the chain, evenly spaced, at most STEP apart."""
    return chain.nodes(max(2, int(np.ceil(chain.length / STEP)) + 1))


def drawn_pixels(chain: Chain, shape: tuple[int, int]) -> Bools:
    """(H, W) bool: the pixels whose centre is in the chain drawn with its own width.

    Each segment is as wide as `radii` says at its two joints; joints are round, the two ends of the chain flat.
    """
    out = np.zeros(shape, dtype=bool)
    radii = np.clip(np.nan_to_num(chain.radii), 0, np.hypot(*shape))
    count, along = len(chain.joints) - 1, np.diff(chain.joints, axis=0)
    reach = chain.segment_length / 2 + float(radii.max())
    low = np.floor((chain.joints[:-1] + chain.joints[1:]) / 2 - reach).astype(int)
    box = np.arange(int(np.ceil(2 * reach)) + 2)
    at_once = max(1, _CELLS // len(box) ** 2)
    for start in range(0, count, at_once):
        part = np.arange(start, min(start + at_once, count))
        u, v = low[part, 0, None, None] + box, low[part, 1, None, None] + box[:, None]
        x, y = u - chain.joints[part, 0, None, None], v - chain.joints[part, 1, None, None]
        along_u, along_v = along[part, 0, None, None], along[part, 1, None, None]
        beyond = (x * along_u + y * along_v) / chain.segment_length**2
        at = np.clip(beyond, 0, 1)
        wide = radii[part, None, None] + at * (radii[part + 1] - radii[part])[:, None, None]
        inside = (x - at * along_u) ** 2 + (y - at * along_v) ** 2 <= wide**2
        if not chain.closed:
            inside &= (beyond >= 0) | (part > 0)[:, None, None]
            inside &= (beyond <= 1) | (part < count - 1)[:, None, None]
        inside &= (u >= 0) & (u < shape[1]) & (v >= 0) & (v < shape[0])
        which, row, column = np.nonzero(inside)
        out[v[which, row, 0], u[which, 0, column]] = True
    return out


def nearest_chain(chains: Sequence[Chain], pixels: Array) -> Ints:
    """(P,) int: of each pixel (P, 2) (x, y) the index of the chain whose line is nearest."""
    lines = [samples(chain) for chain in chains]
    owner = np.repeat(np.arange(len(lines)), [len(line) for line in lines])
    return np.asarray(owner[cKDTree(np.concatenate(lines)).query(pixels)[1]])


def _dice(labels: Ints, cables: int, shown: Sequence[Ints]) -> Floats:
    """(cables, chains): DICE of each cable with each chain, of whose pixels `shown` has the labels."""
    sizes = np.bincount(labels.ravel(), minlength=cables + 1)[1:]
    dice = np.zeros((cables, len(shown)))
    for i, numbers in enumerate(shown):
        dice[:, i] = 2 * np.bincount(numbers, minlength=cables + 1)[1:] / (sizes + len(numbers))
    return dice


def _matched(dice: Floats) -> tuple[float, Ints]:
    """Mean over the cables, (cables,) the chain of each, of the one-to-one assignment that has the highest sum."""
    rows, columns = linear_sum_assignment(dice, maximize=True)
    match = np.full(len(dice), -1)
    match[rows] = np.where(dice[rows, columns] > 0, columns, -1)
    return float(dice[rows, columns].sum() / len(dice)) if len(dice) else 1.0, match


def _without_specks(pixels: Bools) -> Bools:
    _, parts, stats, _ = cv2.connectedComponentsWithStats(pixels.astype(np.uint8), connectivity=8)
    return np.asarray(pixels & (stats[:, cv2.CC_STAT_AREA] >= SPECK)[parts])


def _near(points: Floats, line: Floats) -> float:
    """The share of the points that lie within NEAR of the line's."""
    if not len(points) or not len(line):
        return 0.0
    return float(np.isfinite(cKDTree(line).query(points, distance_upper_bound=NEAR)[0]).mean())


def _places(pixels: Bools) -> Floats:
    """(P, 2) (x, y) of the true pixels, row by row."""
    row, column = np.nonzero(pixels)
    return np.column_stack((column, row)).astype(float)
