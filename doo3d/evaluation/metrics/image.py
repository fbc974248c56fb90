"""Project chains and true cables into the image, so that they can be compared there alone."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...kernels import lay_equal_chords
from ...types import Camera, Chain, Floats
from ..scenes.model import Truth

SPACING = 0.0005
"""m at most between the samples of a projected axis, as of a rendered one."""

MIN_SEGMENT = 1e-4
"""m at least of a segment of a projected chain, which has no length where it runs along the line of sight."""

SHORTER = (1.0, 0.998, 0.995, 0.99, 0.98, 0.95, 0.9)
"""Fractions of an even division of a projected chain at which its chords are tried, until the last one reaches its end."""


@dataclass(frozen=True)
class ImageView:
    """Chains and true cables as lines in the image.

    Lengths are in px times `metres_per_pixel`, so that the limits of the score, which are in metres, hold unchanged: they are
    those of the frame's median depth. All z are 0.

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

    A line that is shorter than a segment in the image, since it runs along the line of sight, becomes one short segment.

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
    """Return the pixels of points (N, 3) m times a scale in m per px, (N, 3) with z = 0."""
    pixels = camera.project(points) * (scale, scale * camera.fx / camera.fy)
    return np.column_stack((pixels, np.zeros(len(pixels))))


def _flat_chain(chain: Chain, line: Floats) -> Chain:
    """Return a chain of equal segments along a projected line; its radius is the chain's own."""
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
    """Return a projected cable, resampled evenly; its radius is as wide as it looks at the cable's own median depth."""
    line = _to_plane(truth.line, camera, depth / camera.fx)
    arcs = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))))
    count = max(2, int(np.ceil(arcs[-1] / SPACING)))
    even = np.linspace(0, arcs[-1], count + 1)[: -1 if truth.closed else None]
    points = np.column_stack([np.interp(even, arcs, line[:, k]) for k in range(3)])
    nearest = np.round(np.interp(even, arcs, np.arange(len(arcs)))).astype(int) % len(truth.axis)
    seen = None if truth.seen is None else truth.seen[nearest]
    return Truth(points, truth.radius * depth / float(np.median(truth.axis[:, 2])), truth.closed, truth.color, seen)
