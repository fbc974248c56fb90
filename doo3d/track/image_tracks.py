"""Track chains by their image, where torn depth makes lengths and motions wrong."""

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
    """Return the open chains of all frames by id, tracked in the image.

    A chain that is seen end on, as a point, is left out.

    Parameters
    ----------
    observations
        frames in order, of one camera, in its frame.
    tracking
        the section `tracking` of a Config.
    """
    chains = ((frame, *each) for frame, seen in enumerate(observations) for each in enumerate(seen.detection.chains))
    end_on = {(frame, number) for frame, number, chain in chains if _is_end_on(chain)}
    return tracks_of([_in_image(seen, k, end_on) for k, seen in enumerate(observations)], tracking, end_on)


def is_of_camera(observations: Sequence[Observation]) -> bool:
    """Return whether all observations are in a camera frame, with depth along rays."""
    return all(observation.detection.coordinates == "camera" for observation in observations)


def _in_image(observation: Observation, frame: int, end_on: set[tuple[int, int]]) -> Observation:
    """Return an observation with its open chains projected onto the unit sphere.

    frame : index of the observation. end_on : (frame, chain) of the chains that stay unchanged.
    """
    given = enumerate(observation.detection.chains)
    chains = tuple(chain if chain.closed or (frame, number) in end_on else _on_sphere(chain) for number, chain in given)
    return replace(observation, detection=replace(observation.detection, chains=chains))


def _on_sphere(chain: Chain) -> Chain:
    """Return a chain projected onto the unit sphere around the camera.

    The number of segments stays; lengths become angles, rad.
    """
    distance = np.linalg.norm(chain.joints, axis=1)
    return resampled(chain, chain.joints / distance[:, None], chain.radius / float(np.median(distance)))


def _is_end_on(chain: Chain) -> bool:
    """Return whether a chain is seen as a point, without length in the image."""
    width = angles_along(chain.joints)[-1] * np.linalg.norm(chain.joints, axis=1).max()
    return bool(width <= LENGTH_TOLERANCE * chain.segment_length)


def angles_along(joints: Floats) -> Floats:
    """Return the angle along a chain as seen from the camera, at each joint: (M,) rad.

    joints : (M, 3) m, in the frame of the camera. The angles turned from joint to joint are added up.
    """
    return arc_length(unit(joints))


def resampled(chain: Chain, line: Floats, radius: float) -> Chain:
    """Return a chain resampled along a line, with the same number of equal segments.

    line : (M + 1, 3) m, for M segments. radius : m, of the new chain.
    """
    count = len(line)
    nodes = resample(line, np.linspace(0.0, steps(line).sum(), count))
    segment = float(steps(nodes).mean())
    joints = exact_lengths(nodes, segment)
    return replace(chain, joints=joints, segment_length=segment, radius=radius)
