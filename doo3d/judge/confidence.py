"""Measure the evidence against each chain, and compute its confidence from it (logistic regression, see `evidence`)."""

import math
from collections.abc import Collection, Sequence
from copy import copy
from dataclasses import replace

import numpy as np

from ..geometry.curves import Curves
from ..geometry.limits import MAX_SAMPLES
from ..geometry.order_statistics import finite_percentiles
from ..geometry.polyline import unit
from ..geometry.projection import Projection
from ..geometry.radii import ACROSS_RADII, STEP_RADII
from ..scene.depth_support import DepthSupport
from ..scene.scene import Scene
from ..types import Chain, Floats
from ..types.stopwatch import timed
from .clutter import clutter_features
from .deviations import MAX_RESIDUAL_RADII, deviations_of
from .evidence import Evidence

BEND_SAMPLES = round(2 / STEP_RADII)
"""Samples on either side of a sample between which the turn of a chain is measured: two radii."""

SUPPORTED_SHARE = 0.5
"""Share of a segment's samples that must agree with a depth reading; below it, the segment counts as unsupported."""

RESIDUAL_PERCENTILE = np.array((90.0,))
"""Percentile over the segments of a chain that is taken as its residual."""

AHEAD_RADII = np.linspace(1.5, 4.0, 6)
"""Distances ahead of an end, in radii, at which the mask is sampled: beyond the rounded tip of a cable."""

END_SAMPLES = 2 * BEND_SAMPLES
"""Samples from an end over which its direction is taken: four radii."""

FRAGMENT_RATIO = 5.0
"""A chain is a small fragment (a stub, a blob of noise, clutter) if the most slender object of the frame is this many times as
slender, by the ratio of length to radius."""

MAX_DROPPED_RADII = 20.0
"""Length in radii, dropped because of the wanted number of chains, from which the evidence is 1: clutter is shorter."""


@timed("crossings")
def with_confidence(
    chains: Sequence[Chain],
    dropped: float,
    scene: Scene,
    bodies: Sequence[Sequence[int]] = (),
    joined: Collection[tuple[int, int]] = (),
) -> tuple[list[Chain], list[Evidence]]:
    """Return the chains with their confidence and the standard deviations of their joints, and the evidence against each.

    Parameters
    ----------
    chains
        the chains of one frame, m (px in 2-D).
    dropped
        length of the pieces dropped because of the wanted number of chains, m (px in 2-D).
    scene
        what was captured, with the settings: `segment.max_width` says how wide an object may be.
    bodies
        indices of the chains of each branched object; a chain in none of them is an object by itself.
    joined
        the chain ends, (index of the chain, 0 for its first joint or 1 for its last), that meet at junctions.

    Returns
    -------
    The chains in the same order, and for each its evidence.
    """
    if not chains:
        return [], []
    curves = Curves.of([chain.joints for chain in chains])
    support = scene.depth_support(curves, [chain.radius for chain in chains])
    is_deep = curves.points.shape[1] == 3
    deviations = deviations_of(curves, chains, support, scene) if is_deep else [None] * len(chains)
    evidence = _evidence(chains, curves, support, dropped, scene, bodies, joined)
    return [_with_confidence(*each) for each in zip(chains, evidence, deviations, strict=True)], evidence


def _evidence(
    chains: Sequence[Chain],
    curves: Curves,
    support: DepthSupport,
    dropped: float,
    scene: Scene,
    bodies: Sequence[Sequence[int]],
    joined: Collection[tuple[int, int]],
) -> list[Evidence]:
    """Return the evidence against each chain; curves : the joints of the chains; support : of their segments by readings."""
    lengths = _object_lengths(chains, bodies)
    slender = [length / chain.radius if chain.radius > 0 else math.inf for length, chain in zip(lengths, chains, strict=True)]
    most_slender = max(filter(math.isfinite, slender), default=0.0)
    view, reach = _samples(curves, chains, scene.view)
    doubts = _depth_doubts(curves, chains, support)
    turns, unclaimed = _sharpest_turns(view).tolist(), np.sqrt(scene.unclaimed(view, reach)).tolist()
    ahead = _mask_ahead(view, reach, chains, scene, joined)
    evidence = []
    for i, chain in enumerate(chains):
        unsupported, residual = doubts[i]
        features = clutter_features(chain, lengths[i], view[i], reach[view.parts[i]], scene)
        evidence.append(
            Evidence(
                joins=math.log1p(sum(1 - connection.confidence for connection in chain.connections)),
                unsupported=math.sqrt(unsupported),
                residual=residual,
                bend=turns[i],
                unclaimed=unclaimed[i],
                dropped=min(dropped / (MAX_DROPPED_RADII * scene.radius), 1.0),
                mask_ahead=ahead[i],
                **features._asdict(),
                small_fragment=float(FRAGMENT_RATIO * slender[i] <= most_slender),
                is_wide=scene.is_wide(chain.radius),
                object_given=scene.object_given,
            )
        )
    if scene.object_given:
        return evidence
    narrow = [each for each in evidence if not each.is_wide]
    frame_doubt = min(sum(each.losses().values()) for each in narrow or evidence)
    return [replace(each, frame_doubt=frame_doubt) for each in evidence]


def _with_confidence(chain: Chain, evidence: Evidence, deviations: Floats | None) -> Chain:
    """Return a chain with confidence and deviations, without the checks of its constructor, which it passed before."""
    result = copy(chain)
    object.__setattr__(result, "confidence", evidence.confidence)
    if deviations is not None:
        object.__setattr__(result, "deviations", deviations)
    return result


def _sharpest_turns(view: Curves) -> Floats:
    """Return the sharpest turn of each curve (u, v) px, (C,) radians; 0 for curves shorter than two windows."""
    at = np.arange(BEND_SAMPLES, len(view.points) - BEND_SAMPLES)
    at = at[view.owner[at - BEND_SAMPLES] == view.owner[at + BEND_SAMPLES]]
    before, after = (view.points[at + k] - view.points[at + k - BEND_SAMPLES] for k in (0, BEND_SAMPLES))
    cosine, least = (unit(before) * unit(after)).sum(axis=1), np.ones(len(view))
    np.minimum.at(least, view.owner[at], cosine)
    return np.arccos(np.maximum(least, -1.0))


def _object_lengths(chains: Sequence[Chain], bodies: Sequence[Sequence[int]]) -> Floats:
    """Return the length of the object that each chain belongs to, (C,) m (px in 2-D)."""
    lengths = np.array([chain.length for chain in chains])
    for body in bodies:
        lengths[list(body)] = lengths[list(body)].sum()
    return lengths


def _samples(curves: Curves, chains: Sequence[Chain], view: Projection) -> tuple[Curves, Floats]:
    """Return samples half a radius apart along chains, as curves in the view, and the radius in the view at each, (S,).

    Those behind the camera are left out; there are about MAX_SAMPLES at most.
    """
    radius = np.array([chain.radius if chain.radius > 0 else chain.segment_length for chain in chains])
    spacing = np.maximum(STEP_RADII * radius, sum(chain.length for chain in chains) / MAX_SAMPLES)
    samples, _ = curves.sampled(spacing, np.ceil(curves.lengths / spacing).astype(int), curves.closed)
    positions = view.project(samples.points)
    seen = np.isfinite(positions).all(axis=1)
    owner = samples.owner[seen]
    reach = radius[owner] * view.scale(view.distance(samples.points[seen]))
    starts = np.searchsorted(owner, np.arange(len(chains) + 1))
    return Curves(np.ascontiguousarray(positions[seen]), starts, curves.closed), reach


def _depth_doubts(curves: Curves, chains: Sequence[Chain], support: DepthSupport) -> list[tuple[float, float]]:
    """Return for each chain the share of unsupported segments, and the residual of the depth readings in radii."""
    doubts, bounds = [], curves.segment_bounds.tolist()
    for i, chain in enumerate(chains):
        if not (len(support.share) and chain.radius > 0):
            doubts.append((float(chain.occluded.mean()), 0.0))
            continue
        part = slice(bounds[i], bounds[i + 1])
        residual = float(finite_percentiles(support.residual[part], RESIDUAL_PERCENTILE)[0])
        unsupported = float(((support.share[part] < SUPPORTED_SHARE) | chain.occluded).mean())
        doubts.append((unsupported, min(MAX_RESIDUAL_RADII, residual)))
    return doubts


def _mask_ahead(
    view: Curves, reach: Floats, chains: Sequence[Chain], scene: Scene, joined: Collection[tuple[int, int]]
) -> list[float]:
    """Return for each chain the fraction of pixels ahead of an end that are in the mask, summed over both ends, 0 to 2.

    A mask that continues ahead of an end shows that it is no tip: the object continues, or the end touches another strand.
    Ends that are `joined` at a junction do not count.
    """
    shares = [0.0] * len(chains)
    is_open = [not chain.closed and view.counts[i] > 1 for i, chain in enumerate(chains)]
    ends = [(i, side) for i in range(len(chains)) for side in (0, 1) if is_open[i] and (i, side) not in joined]
    if not ends:
        return shares
    owner, side = np.array(ends).T
    tips = np.where(side, view.bounds[owner + 1] - 1, view.bounds[owner])
    inward = np.minimum(END_SAMPLES, view.counts[owner] - 1)
    forward = unit(view.points[tips] - view.points[tips + np.where(side, -inward, inward)])
    across = forward[:, ::-1] * (-1, 1)
    offsets = AHEAD_RADII[:, None, None] * forward[:, None, None] + ACROSS_RADII[:, None] * across[:, None, None]
    pixels = np.rint(view.points[tips, None, None] + reach[tips, None, None, None] * offsets)
    for i, share in zip(owner.tolist(), scene.in_mask(pixels).mean(axis=(1, 2)).tolist(), strict=True):
        shares[i] += share
    return shares
