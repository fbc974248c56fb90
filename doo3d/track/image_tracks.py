"""Recognize chains from frame to frame where the camera measures well: in the image.

What depth says of the length of a chain, and of how far it moved, is wrong where it is torn; the image shows both.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..config import TrackingConfig
from ..geometry.polyline import arc_length, resample, steps, unit
from ..types import Chain, Floats
from .observations import Observation
from .registration import LENGTH_TOLERANCE, exact_lengths
from .tracks import Track, tracks_of


def image_tracks(observations: Sequence[Observation], tracking: TrackingConfig) -> dict[int, Track]:
    """Return the open chains of all frames by the id that tracking in the image gives them, each as it is seen there.

    A chain that is seen end on, as a point, is left out.

    observations : frames in order, of one camera, in its frame. tracking : how a chain is recognized from frame to frame.
    """
    chains = ((frame, *each) for frame, seen in enumerate(observations) for each in enumerate(seen.detection.chains))
    end_on = {(frame, number) for frame, number, chain in chains if _is_end_on(chain)}
    return tracks_of([_in_image(seen, k, end_on) for k, seen in enumerate(observations)], tracking, end_on)


def is_of_camera(observations: Sequence[Observation]) -> bool:
    """Tell whether observations are in the frame of a camera, whose errors of depth are along the line of sight."""
    return all(observation.detection.coordinates == "camera" for observation in observations)


def _in_image(observation: Observation, frame: int, end_on: set[tuple[int, int]]) -> Observation:
    """Return an observation with its open chains as the image shows them, where depth is of no matter: at a distance of 1."""
    given = enumerate(observation.detection.chains)
    chains = tuple(chain if chain.closed or (frame, number) in end_on else _on_sphere(chain) for number, chain in given)
    return replace(observation, detection=replace(observation.detection, chains=chains))


def _on_sphere(chain: Chain) -> Chain:
    """Return a chain on the unit sphere around the camera, with as many segments; lengths are angles, rad."""
    distance = np.linalg.norm(chain.joints, axis=1)
    return resampled(chain, chain.joints / distance[:, None], chain.radius / float(np.median(distance)))


def _is_end_on(chain: Chain) -> bool:
    """Tell whether a chain has no length in the image: none beside the error that segments may have."""
    width = angles_along(chain.joints)[-1] * np.linalg.norm(chain.joints, axis=1).max()
    return bool(width <= LENGTH_TOLERANCE * chain.segment_length)


def angles_along(joints: Floats) -> Floats:
    """Return the angle between the ray to the first joint and that to each of the joints (M, 3), along the chain, rad: (M,)."""
    return arc_length(unit(joints))


def resampled(chain: Chain, line: Floats, radius: float) -> Chain:
    """Return a chain laid anew along a line (M + 1, 3) m, with as many segments, equally long, and with another radius, m."""
    count = len(line)
    nodes = resample(line, np.linspace(0.0, steps(line).sum(), count))
    segment = float(steps(nodes).mean())
    joints = exact_lengths(nodes, segment)
    return replace(chain, joints=joints, segment_length=segment, radius=radius)
