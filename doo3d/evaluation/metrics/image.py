"""Project chains and true cables into the image, to score them there without depth."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...kernels import lay_equal_chords
from ...types import Camera, Chain, Floats
from ..scenes.model import Truth

SPACING = 0.0005
"""Greatest distance in m between the samples of a projected axis; equal to that of a rendered axis."""

MIN_SEGMENT = 1e-4
"""Least segment length in m of a projected chain; along the line of sight, the projected length would be 0."""

SHORTER = (1.0, 0.998, 0.995, 0.99, 0.98, 0.95, 0.9)
"""Factors of the segment length of a projected chain, tried in order until its chords reach the end of the curve."""


@dataclass(frozen=True)
class ImageView:
    """Chains and true cables as lines in the image.

    Lengths are px multiplied by `metres_per_pixel`, so that the limits of the score, in metres, apply unchanged at the median
    depth of the cables. All z are 0.

    Attributes
    ----------
    chains
        the chains that are in front of the camera, in equal segments.
    truths
        the true cables, evenly sampled.
    metres_per_pixel
        m per px at the median depth of the cables.
    """

    chains: tuple[Chain, ...]
    truths: tuple[Truth, ...]
    metres_per_pixel: float


def project(chains: Sequence[Chain], truths: Sequence[Truth], camera: Camera) -> ImageView:
    """Project chains and true cables into the image.

    A chain along the line of sight, shorter than a segment in the image, becomes one short segment.

    Parameters
    ----------
    chains
        the detected chains, m, in the camera's optical frame.
    truths
        the true cables in the same frame; at least one.
    camera
        the intrinsics.
    """
    depth = float(np.median(np.concatenate([truth.axis[:, 2] for truth in truths])))
    scale = depth / camera.fx
    lines = [(chain, _to_plane(chain.joints, camera, scale)) for chain in chains if (chain.joints[:, 2] > 0).all()]
    return ImageView(
        tuple(_flat_chain(chain, line) for chain, line in lines),
        tuple(_flat_truth(truth, camera, depth) for truth in truths),
        scale,
    )


def _to_plane(points: Floats, camera: Camera, scale: float) -> Floats:
    """Return the pixel positions of points (N, 3) m, multiplied by a scale in m per px: (N, 3) with z = 0."""
    pixels = camera.project(points) * (scale, scale * camera.fx / camera.fy)
    return np.column_stack((pixels, np.zeros(len(pixels))))


def _flat_chain(chain: Chain, line: Floats) -> Chain:
    """Return a chain of equal segments along a projected line; its radius is that of `chain`."""
    length = float(np.linalg.norm(np.diff(line, axis=0), axis=1).sum())
    count = max(1, round(length / chain.segment_length))
    segment, joints = MIN_SEGMENT, line[:1]
    for shorter in SHORTER:
        segment = max(shorter * length / count, MIN_SEGMENT)
        joints = lay_equal_chords(line, segment)[0]
        if len(joints) > count:
            break
    if len(joints) < 2:
        joints = np.vstack((line[0], line[0] + (segment, 0.0, 0.0)))
    return Chain(joints, segment, chain.radius, closed=chain.closed and bool(np.allclose(joints[0], joints[-1])))


def _flat_truth(truth: Truth, camera: Camera, depth: float) -> Truth:
    """Return a projected cable, resampled evenly, with its apparent radius at the cable's own median depth."""
    line = _to_plane(truth.line, camera, depth / camera.fx)
    arcs = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))))
    count = max(2, int(np.ceil(arcs[-1] / SPACING)))
    even = np.linspace(0, arcs[-1], count + 1)[: -1 if truth.closed else None]
    points = np.column_stack([np.interp(even, arcs, line[:, k]) for k in range(3)])
    nearest = np.round(np.interp(even, arcs, np.arange(len(arcs)))).astype(int) % len(truth.axis)
    seen = None if truth.seen is None else truth.seen[nearest]
    return Truth(points, truth.radius * depth / float(np.median(truth.axis[:, 2])), truth.closed, truth.color, seen)
