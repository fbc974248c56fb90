"""Score chains in the image against the instance labels of a photograph."""

from collections.abc import Sequence

import cv2
import numpy as np
from scipy.optimize import linear_sum_assignment
from scipy.spatial import cKDTree

from ...errors import require
from ...types import Bools, Chain, Detection, Floats, Ints
from ..metrics.record import Record
from .datasets import MIN_CABLE_PIXELS

SAMPLE_SPACING_PX = 0.5
"""Spacing in px of the chain samples that distances are measured to; the error is 0.03 px at a distance of 1 px."""

MAX_DISTANCE_PX = 5.0
"""Distance in px from a center line within which a chain follows it."""

MIN_TRACED = 0.95
"""Recall and precision above which a cable is traced."""

BRIDGE_PX = 41
"""Greatest width in px of another cable that separates two regions of one cable."""

_MAX_BOX_PIXELS = 4_000_000
"""Greatest number of pixels in boxes that are drawn together, to bound the memory."""


def score_photo(detection: Detection, labels: Ints, numbers: Ints | None = None) -> Record:
    """Score the chains of one photograph against the labels of its cables.

    `drawn` and `instances` are DICE coefficients, 0 to 1, between the labelled pixels of each cable and the pixels of the chain
    matched with it, averaged over the cables (1 if there are no cables, 0 if there are no chains). `drawn` counts the pixels that
    the chain covers when it is drawn with its own width, `instances` those that `Detection.instance_labels` gives it.

    Parameters
    ----------
    detection
        the detected 2-D chains, joints and radii in px.
    labels
        (H, W) int: i from 1 at the pixels that show cable i, 0 for background.
    numbers
        (H, W) int, k + 1 at the pixels of chain k, 0 for none; None for those of `Detection.instance_labels`.

    Returns
    -------
    Record
        the two coefficients; `cables` and `chains`, the numbers of both; `correct`, whether these numbers are equal;
        `match`, index of the chain matched with each cable for `drawn`, -1 for none.
    """
    cables, chains, shape = int(labels.max(initial=0)), len(detection.chains), (labels.shape[0], labels.shape[1])
    covered = [labels[drawn_pixels(chain, shape)] for chain in detection.chains]
    drawn, match = match_of(dice_of(labels, cables, covered))
    if numbers is None:
        numbers = detection.instance_labels() if chains else labels
    instances, _ = match_of(dice_of(labels, cables, [labels[numbers == k + 1] for k in range(chains)]))
    counts = {"cables": cables, "chains": chains, "correct": cables == chains}
    return Record(counts | {"drawn": drawn, "instances": instances, "match": match.tolist()})


def trace_cable(chain: Chain | None, labels: Ints, cable: int) -> Record:
    """Score a chain that was detected in the labelled pixels of one cable alone.

    The cable's center line is the skeleton of its labelled pixels, without regions of fewer than 30 px. Where another cable
    covers this one, the center line is unknown; there, the chain counts as near it at any of the covering pixels (those of other
    cables that a morphological closing with a disc of 41 px adds to the pixels of this cable).

    Parameters
    ----------
    chain
        the chain, joints in px; None if nothing was detected, which scores 0.
    labels
        (H, W) int: i from 1 at the pixels that show cable i, 0 for background.
    cable
        number of the cable in the labels, from 1.

    Returns
    -------
    Record
        recall: fraction of the center line within 5 px of the chain; precision: fraction of the chain within 5 px of the center
        line or of a covering pixel; traced: whether both are above 0.95.

    Raises
    ------
    MissingDependency : scikit-image is not installed.
    """
    if chain is None:
        return Record(recall=0.0, precision=0.0, traced=False)
    skeletonize = require("skimage.morphology", "test").skeletonize
    cable_pixels = _without_specks(labels == cable)
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (BRIDGE_PX, BRIDGE_PX))
    padded = np.pad(cable_pixels, BRIDGE_PX).astype(np.uint8)
    closed = cv2.morphologyEx(padded, cv2.MORPH_CLOSE, disc)[BRIDGE_PX:-BRIDGE_PX, BRIDGE_PX:-BRIDGE_PX] > 0
    center, bridge = _pixel_positions(skeletonize(cable_pixels)), _pixel_positions(closed & ~cable_pixels & (labels > 0))
    line = sample_chain(chain)
    recall, precision = _near_fraction(center, line), _near_fraction(line, np.concatenate((center, bridge)))
    return Record(recall=recall, precision=precision, traced=min(recall, precision) > MIN_TRACED)


def sample_chain(chain: Chain) -> Floats:
    """Return P evenly spaced points along a 2-D chain, at most 0.5 px apart: (P, 2) px."""
    return chain.nodes(max(2, int(np.ceil(chain.length / SAMPLE_SPACING_PX)) + 1))


def drawn_pixels(chain: Chain, shape: tuple[int, int]) -> Bools:
    """Return the pixels that a 2-D chain covers when it is drawn with its own width: (H, W) bool.

    A pixel is covered if its center is inside the drawing. The width changes linearly along a segment between the radii at its
    two joints; unknown radii (NaN) count as 0. The drawing is round at inner joints, and cut off flat at the ends of an open
    chain.

    Parameters
    ----------
    chain
        the chain, joints and radii in px.
    shape
        (height, width) of the image.
    """
    out = np.zeros(shape, dtype=bool)
    radii = np.clip(np.nan_to_num(chain.radii), 0, np.hypot(*shape))
    count = len(chain.joints) - 1
    half_box = chain.segment_length / 2 + float(radii.max())
    low = np.floor((chain.joints[:-1] + chain.joints[1:]) / 2 - half_box).astype(int)
    box = np.arange(int(np.ceil(2 * half_box)) + 2)
    at_once = max(1, _MAX_BOX_PIXELS // len(box) ** 2)
    for start in range(0, count, at_once):
        segments = np.arange(start, min(start + at_once, count))
        u, v = low[segments, 0, None, None] + box, low[segments, 1, None, None] + box[:, None]
        inside = _in_segments(chain, radii, segments, u, v)
        inside &= (u >= 0) & (u < shape[1]) & (v >= 0) & (v < shape[0])
        segment, row, column = np.nonzero(inside)
        out[v[segment, row, 0], u[segment, 0, column]] = True
    return out


def _in_segments(chain: Chain, radii: Floats, segments: Ints, u: Ints, v: Ints) -> Bools:
    """Return which pixels of a box around each segment lie in the segment.

    Parameters
    ----------
    chain, radii
        the chain, and its radii (N + 1,) px.
    segments
        (K,) indices.
    u, v
        columns (K, 1, B) and rows (K, B, 1) of the boxes' pixels, px.

    Returns
    -------
    (K, B, B) bool.
    """
    joints, step = chain.joints[segments], np.diff(chain.joints, axis=0)[segments]
    x, y = u - joints[:, 0, None, None], v - joints[:, 1, None, None]
    step_u, step_v = step[:, 0, None, None], step[:, 1, None, None]
    t = (x * step_u + y * step_v) / chain.segment_length**2
    clipped = np.clip(t, 0, 1)
    radius = radii[segments, None, None] + clipped * (radii[segments + 1] - radii[segments])[:, None, None]
    inside: Bools = (x - clipped * step_u) ** 2 + (y - clipped * step_v) ** 2 <= radius**2
    if not chain.closed:
        inside &= (t >= 0) | (segments > 0)[:, None, None]
        inside &= (t <= 1) | (segments < len(chain.joints) - 2)[:, None, None]
    return inside


def dice_of(labels: Ints, cables: int, chain_labels: Sequence[Ints]) -> Floats:
    """Return the DICE coefficient of each cable with each chain, (cables, chains), from the labels at each chain's pixels."""
    sizes = np.bincount(labels.ravel(), minlength=cables + 1)[1:]
    dice = np.zeros((cables, len(chain_labels)))
    for i, numbers in enumerate(chain_labels):
        dice[:, i] = 2 * np.bincount(numbers, minlength=cables + 1)[1:] / (sizes + len(numbers))
    return dice


def match_of(dice: Floats) -> tuple[float, Ints]:
    """Match cables and chains one to one so that the sum of their DICE coefficients is greatest.

    dice : (cables, chains), 0 to 1.

    Returns
    -------
    mean : mean DICE coefficient over the cables.
    match : (cables,) index of the chain of each cable, -1 for none.
    """
    rows, columns = linear_sum_assignment(dice, maximize=True)
    match = np.full(len(dice), -1)
    match[rows] = np.where(dice[rows, columns] > 0, columns, -1)
    return float(dice[rows, columns].sum() / len(dice)) if len(dice) else 1.0, match


def _without_specks(pixels: Bools) -> Bools:
    _, regions, stats, _ = cv2.connectedComponentsWithStats(pixels.astype(np.uint8), connectivity=8)
    return np.asarray(pixels & (stats[:, cv2.CC_STAT_AREA] >= MIN_CABLE_PIXELS)[regions])


def _near_fraction(points: Floats, line: Floats) -> float:
    """Return the fraction of the points within MAX_DISTANCE_PX of the points of a line."""
    if not len(points) or not len(line):
        return 0.0
    return float(np.isfinite(cKDTree(line).query(points, distance_upper_bound=MAX_DISTANCE_PX)[0]).mean())


def _pixel_positions(pixels: Bools) -> Floats:
    """Return the positions (x, y) of the true pixels, row by row: (P, 2) px."""
    row, column = np.nonzero(pixels)
    return np.column_stack((column, row)).astype(float)
