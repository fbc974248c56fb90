"""The standard deviation of each joint, across the viewing ray and along it."""

from collections.abc import Sequence

import numpy as np

from ..geometry.curves import Curves
from ..scene.depth_support import DepthSupport
from ..scene.scene import Scene
from ..types import Bools, Chain, Floats

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
"""Weights, across and along the ray, of the terms in a frame, in their order. Fitted by docs/fit_deviations.py, so that 90 % of
the errors of right chains are within 1.645 deviations."""

CLOUD_WEIGHTS = {"pitch": (0.477, 1.75), "bulge": (1.3, 0.15), "roughness": (0.24, 0.215), "hidden": (0.128, 0)}
"""The same for a cloud, whose pitch is the spacing of its points; fitted by the same script to the points of the frames."""

MAX_RESIDUAL_RADII = 3.0
"""Upper limit of the residual of a segment in radii; also its value where it was not measured."""

MAX_OFFSET_RADII = 1.0
"""Upper limit of the offset of a segment in radii; also its value where none was measured."""

IN_FRAME, IN_CLOUD = (
    np.array([weights.get(term, (0, 0)) for term in FRAME_WEIGHTS]) for weights in (FRAME_WEIGHTS, CLOUD_WEIGHTS)
)


def deviations_of(
    curves: Curves, chains: Sequence[Chain], support: DepthSupport, scene: Scene, weights: Floats | None = None
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
        how well the depth readings support their segments; not measured for a cloud.
    scene
        what was captured.
    weights
        (8, K), in place of those of frames and clouds: the results have K columns then.
    """
    weights = (IN_FRAME if len(support.share) else IN_CLOUD) if weights is None else weights
    result, start = [], 0
    for joints, chain in zip(curves, chains, strict=True):
        depth, end = joints[:, 2], start + len(joints) - 1
        of_depth = np.column_stack((*scene.ray_noise(depth), np.zeros((len(joints), 3))))
        if len(support.share):
            own = slice(start, end)
            of_depth[:, 2:] = _depth_terms(chain.radius, support.share[own], support.residual[own], support.offset[own])
        deviations = np.sqrt(np.column_stack((of_depth, _shape_terms(chain))) ** 2 @ weights**2)
        if scene.viewpoint is None:
            deviations[:] = deviations.max(axis=1, keepdims=True)
        deviations.flags.writeable = False
        result.append(deviations)
        start = end
    return result


def _depth_terms(radius: float, share: Floats, residual: Floats, offset: Floats) -> Floats:
    """Return the terms of the depth readings, (N + 1, 3) m: unsupported, residual and spread."""
    share, residual = (np.pad(values, 1, mode="edge") for values in (share, np.fmin(residual, MAX_RESIDUAL_RADII)))
    unsupported = 1 - (share[:-1] + share[1:]) / 2
    offset = np.minimum(np.abs(offset[~np.isnan(offset)]), MAX_OFFSET_RADII)
    spread = np.sqrt(np.mean(offset**2)) if len(offset) else MAX_OFFSET_RADII
    terms = np.column_stack((unsupported, np.fmax(residual[:-1], residual[1:]), np.full(len(unsupported), spread)))
    return np.asarray(terms * np.nan_to_num(radius, posinf=0.0))


def _shape_terms(chain: Chain) -> Floats:
    """Return the terms of the shape, (N + 1, 3) m: bulge, roughness, and hidden, the length to the next seen segment."""
    bulge = np.nan_to_num(chain.radii - np.nan_to_num(chain.radius, posinf=0.0), posinf=0.0, neginf=0.0)
    hidden = chain.segment_length * _steps_to_seen(chain.occluded, chain.closed)
    return np.column_stack((bulge, np.full(len(bulge), np.sqrt(np.mean(bulge**2))), hidden))


def _steps_to_seen(occluded: Bools, closed: bool) -> Floats:
    """Return the number of segments from each of the N + 1 joints to the nearest seen segment; N if none is seen."""
    count = len(occluded)
    seen = np.flatnonzero(~np.append(occluded, True) | ~np.append(True, occluded))
    steps = np.abs(np.arange(count + 1)[:, None] - seen)
    return np.asarray((np.minimum(steps, count - steps) if closed else steps).min(axis=1, initial=count))
