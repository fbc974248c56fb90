"""Which of two strands that cross in the view is on top: by the depth of their surfaces, and by their colors.

Letters: C crossings, two strands each; S samples along a strand; A samples across it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ...evidence.strand_colors import CORE_OFFSETS, PROFILE_OFFSETS, color_profiles, colors_at, first_strand_log_odds, medians
from ...geometry.curves import Curves
from ...geometry.intersections import Intersections
from ...geometry.noise import DEVIATIONS
from ...types import Array, Floats, Ints

SAMPLE_DISTANCES = np.linspace(0.0, 5.0, 16)
"""Half-widths beyond the overlap, on both sides, of the samples along a strand."""

OVERLAP_MARGIN = 1.2
"""Half-lengths of the overlap that are left out of what counts as beyond it."""

MIN_ANGLE = 0.3
"""rad; strands that cross at less are taken to cross at this, or their overlap would have no end."""

MIN_MEASURED = 4
"""Samples on both sides of a crossing together that must have been measured, to extrapolate a strand's surface."""

Lookup = Callable[[Floats], Floats]
"""Positions (..., 2) in the view -> values (...) there, NaN where there are none."""


@dataclass(frozen=True)
class CrossingStrands:
    """Samples of the two strands at each of C crossings: S per strand, before and after the place where they overlap in the view.

    The second axis of the arrays, of length 2, is the strand: the first or the second of the crossing. Positions and lengths in
    the view are in its unit: px for a camera and in 2-D, tangents of angles for a cloud with a viewpoint, m otherwise.

    Attributes
    ----------
    middle
        (C, 2, S, 2), positions (u, v) in the view of the samples on the strand's axis: S / 2 before the overlap, then S / 2 after
        the overlap. NaN for samples beyond the strand's ends.
    depth
        (C, 2, S) m, distance of the axis along the viewing direction at the samples; 0 in 2-D. NaN beyond the strand's ends.
    side
        (C, 2, S, 2) unit, direction across the strand in the view at the samples. NaN beyond the strand's ends.
    along
        (C, 2, S), distance of the samples from the crossing along their strand, in half-widths of that strand; negative before
        the crossing.
    half_width
        (C, 2), half the width of each strand in the view.
    point
        (C, 2), position (u, v) of the crossing in the view.
    normal
        (C, 2, 2) unit, direction (u, v) across each strand in the view at the crossing.
    """

    middle: Floats
    depth: Floats
    side: Floats
    along: Floats
    half_width: Floats
    point: Floats
    normal: Floats


def sample_strands(crossings: Intersections, chains: Curves, half_width: Floats) -> CrossingStrands:
    """Take samples along both strands of each crossing, on both sides of the area where they overlap.

    Parameters
    ----------
    crossings
        C intersections of the chains in the view.
    chains
        the joints of all chains as (u, v, distance): position in the view and distance along the viewing direction.
    half_width
        (C, 2), half the width of each strand at the crossing, in the unit of u and v.

    Returns
    -------
    The samples: 16 on either side of each crossing along each strand, up to 5 half-widths beyond the overlap.
    """
    joint = crossings.segment + crossings.t
    step = _segment_vectors(chains, crossings.chain, crossings.segment)
    size = np.maximum(np.linalg.norm(step, axis=-1), 1e-12)
    overlap = OVERLAP_MARGIN * half_width[:, ::-1] / np.sin(np.maximum(crossings.angle, MIN_ANGLE))[:, None]
    beyond = overlap[..., None] + SAMPLE_DISTANCES * half_width[..., None]
    along = np.concatenate((-beyond[..., ::-1], beyond), axis=-1)
    chain = np.broadcast_to(crossings.chain[..., None], along.shape)
    at = joint[..., None] + along / size[..., None]
    middle = chains.interpolate(chain, at)
    side = _normals(_segment_vectors(chains, chain, np.floor(at)))
    in_half_widths = along / half_width[..., None]
    return CrossingStrands(middle[..., :2], middle[..., 2], side, in_half_widths, half_width, crossings.point, _normals(step))


def _segment_vectors(chains: Curves, chain: Ints, segment: Array) -> Floats:
    """Return the vectors (..., 2) from one joint to the next in the view; NaN beyond the ends."""
    return np.asarray((chains.interpolate(chain, segment + 1.0) - chains.interpolate(chain, segment + 0.0))[..., :2])


def _normals(vectors: Floats) -> Floats:
    size = np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-12)
    return np.asarray(np.stack((-vectors[..., 1], vectors[..., 0]), axis=-1) / size)


def sample_overlap(strands: CrossingStrands, offsets: Floats) -> tuple[Floats, Floats]:
    """Return positions in the view across both strands of each crossing, outside their overlap and inside it.

    Parameters
    ----------
    strands
        the two strands at C crossings, with S samples along each.
    offsets
        (A,), lateral offsets from the middle of a strand, in half-widths of the strand.

    Returns
    -------
    beyond : (C, 2, S, A, 2), positions (u, v) outside the overlap: [c, strand, s, a] lies offsets[a] half-widths across the
        strand from sample s. NaN for samples beyond the strand's ends.
    inside : (C, A, A, 2), positions (u, v) in the overlap: [c, a, b] lies offsets[a] half-widths from the middle of the first
        strand and offsets[b] half-widths from the middle of the second.
    """
    lateral = (offsets * strands.half_width[..., None])[:, :, None, :, None]
    beyond = strands.middle[..., None, :] + lateral * strands.side[..., None, :]
    n = strands.normal
    sine = n[:, 0, 0] * n[:, 1, 1] - n[:, 0, 1] * n[:, 1, 0]
    sine = np.where(np.abs(sine) < np.sin(MIN_ANGLE), np.copysign(np.sin(MIN_ANGLE), sine), sine)[:, None, None]
    a, b = (offsets * strands.half_width[:, :1])[:, :, None], (offsets * strands.half_width[:, 1:])[:, None, :]
    x = (a * n[:, 1, 1, None, None] - b * n[:, 0, 1, None, None]) / sine
    y = (b * n[:, 0, 0, None, None] - a * n[:, 1, 0, None, None]) / sine
    return beyond, strands.point[:, None, None] + np.stack((x, y), axis=-1)


def depth_order(strands: CrossingStrands, surface: Lookup, radius: Floats) -> Floats:
    """Measure which strand's surface is in front.

    The surface of each strand is measured on both sides of the overlap and extrapolated across the overlap by a parabola.
    Readings on a strand that differ by more than its thickness from its others belong to something else and are left out.

    Parameters
    ----------
    strands
        the two strands at C crossings.
    surface
        function from positions (..., 2) in the view to the distance (...) of the object's surface there along the viewing
        direction, m; NaN without a reading.
    radius
        (C, 2) m, radius of the strands.

    Returns
    -------
    (C,) m, distance of the second strand's surface minus that of the first strand's: positive if the first strand is in front.
    NaN if either strand's surface could not be extrapolated.
    """
    beyond, _ = sample_overlap(strands, CORE_OFFSETS)
    measured = medians(surface(beyond))
    height = strands.depth - measured
    with np.errstate(invalid="ignore"):
        own = np.abs(height - medians(height)[..., None]) < 2 * radius[..., None]
    extrapolated = _parabola_at_crossing(strands.along, np.where(own, measured, np.nan))
    return np.asarray(extrapolated[:, 1] - extrapolated[:, 0])


def _parabola_at_crossing(along: Floats, values: Floats) -> Floats:
    """Return the value at 0 of the least-squares parabola through values (..., S) at positions (..., S).

    Outliers are left out once. NaN where there are too few values, or none on one side.
    """
    good = np.isfinite(values)
    scale = along / np.abs(along).max(axis=-1, keepdims=True)
    powers = np.stack((np.ones_like(scale), scale, scale**2), axis=-1)
    for _ in range(2):
        known = np.where(good, values, 0.0)
        weighted = powers * good[..., None]
        square = np.einsum("...si,...sj->...ij", weighted, powers) + 1e-6 * np.eye(3)
        fit = np.linalg.solve(square, np.einsum("...si,...s->...i", weighted, known)[..., None])[..., 0]
        residual = np.where(good, np.abs(np.einsum("...si,...i->...s", powers, fit) - known), np.nan)
        good = good & (residual <= DEVIATIONS * np.maximum(medians(residual), 1e-9)[..., None])
    enough = (good.sum(axis=-1) >= MIN_MEASURED) & (good & (along < 0)).any(axis=-1) & (good & (along > 0)).any(axis=-1)
    return np.where(enough, fit[..., 0], np.nan)


def color_log_odds(strands: CrossingStrands, image: Array) -> Floats:
    """Return the log-odds that the first strand of each crossing is upper, by the colors in the overlap.

    The colors across the upper strand (bright middle, darker sides) continue through the overlap. So each strand's colors on both
    sides of the overlap are compared with the colors inside it.

    strands : the two strands at C crossings. image : (H, W, 3) uint8 RGB. Returns (C,) nat, 0 if either strand has fewer than two
    samples on one side of the crossing, or the overlap leaves the image.
    """
    beyond, inside = sample_overlap(strands, PROFILE_OFFSETS)
    profile, measured = color_profiles(image, beyond.reshape(-1, 2, 2, beyond.shape[2] // 2, *beyond.shape[3:]))
    profile = profile.mean(axis=2)
    log_odds = first_strand_log_odds(colors_at(image, inside), profile[:, 0][:, :, None], profile[:, 1][:, None])
    return np.where((measured >= MIN_MEASURED // 2).all(axis=(1, 2)), log_odds, 0.0)
