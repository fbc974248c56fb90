"""The standard deviation of each joint across and along the ray to it, from what was measured beside it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...facts.frame_facts import facts_of
from ...geometry.curves import Curves
from ...geometry.depth_support import DepthSupport
from ...kernels import joint_deviations
from ...types import Chain, Floats, Foreground

FRAME_WEIGHTS = {
    "pitch": (0.241, 0.0196),
    "noise": (0.164, 0.23),
    "unsupported": (0.199, 0.1),
    "residual": (0.116, 0.198),
    "spread": (0.0593, 0.387),
    "bulge": (1.01, 0.261),
    "roughness": (1.26, 0.947),
    "hidden": (0.0878, 0.112),
}
"""Weights, across and along the ray, of the terms of `kernels.joint_deviations` in a frame, in the same order. Fitted by
docs/fit_deviations.py, so that 90 % of the errors of right chains are within 1.645 deviations."""

CLOUD_WEIGHTS = {"pitch": (0.477, 1.75), "bulge": (1.3, 0.15), "roughness": (0.24, 0.215), "hidden": (0.128, 0.0)}
"""The same for a cloud, whose pitch is the spacing of its points; fitted by the same script to the points of the frames."""

MAX_RESIDUAL_RADII = 3.0
"""Radii of a segment's residual that count at most, and where it is unknown."""

IN_FRAME, IN_CLOUD = (
    np.array([weights.get(term, (0.0, 0.0)) for term in FRAME_WEIGHTS]) for weights in (FRAME_WEIGHTS, CLOUD_WEIGHTS)
)
NOTHING = np.zeros(0)


def deviations_of(
    curves: Curves, chains: Sequence[Chain], support: DepthSupport | None, foreground: Foreground, weights: Floats | None = None
) -> list[Floats]:
    """Return the standard deviation of the joints of each 3-D chain across and along the ray, (N + 1, 2) m, read-only.

    Without a sensor's position there is no ray, and both columns are the greater one.

    Parameters
    ----------
    curves
        the joints of the chains, m.
    chains
        the chains.
    support
        how well the depth readings support their segments; None for a cloud.
    foreground
        mask, depth and camera of the frame, or the cloud's points.
    weights
        (8, K), in place of those of frames and clouds: the results have K columns then.
    """
    camera, spacing = foreground.camera, 0.0 if foreground.sampling is None else foreground.sampling.spacing
    noise = 0.0 if camera is None else facts_of(foreground).inverse_depth_noise
    if weights is None:
        weights = IN_CLOUD if support is None else IN_FRAME
    share, residual, offset = (NOTHING,) * 3 if support is None else (support.share, support.residual, support.offset)
    deviations = joint_deviations(
        curves.points,
        curves.bounds,
        np.array([chain.radius for chain in chains]),
        np.concatenate([chain.radii for chain in chains]),
        np.concatenate([chain.occluded for chain in chains]),
        share,
        residual,
        offset,
        weights,
        pitch=spacing,
        pitch_per_m=0.0 if camera is None else 1 / camera.fx,
        noise=noise,
        max_residual=MAX_RESIDUAL_RADII,
    )
    if camera is None and foreground.viewpoint is None:
        deviations[:] = deviations.max(axis=1, keepdims=True)
    deviations.flags.writeable = False
    bounds = curves.bounds.tolist()
    return [deviations[bounds[i] : bounds[i + 1]] for i in range(len(chains))]
