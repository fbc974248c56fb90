"""Check that chains keep their length during a capture."""

from collections import defaultdict
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from .. import Chain, Frame, Image

MIN_FRAMES = 4
"""Least number of frames for a comparison of a chain's lengths."""

MAX_SPREAD = 0.25
"""Greatest range of a chain's lengths, without 5 % at each end, as a fraction of their median."""

MAX_OCCLUDED = 0.2
"""Greatest fraction of occluded segments for a length to count, since hidden stretches are estimates."""

BORDER_SHARE = 0.03
"""Distance from the border of the image, in image widths, within which an end counts as one that leaves the view."""


class ChainLength(NamedTuple):
    """The length of a chain in one frame.

    Attributes
    ----------
    id
        id of the chain in the capture.
    frame
        name of the frame.
    length
        length of the chain, m (px in 2-D).
    """

    id: int
    frame: str
    length: float


def is_whole(chain: Chain, data: Frame | Image | None) -> bool:
    """Return whether both ends of a chain are in view and it is hardly occluded, so that its length is the cable's.

    Parameters
    ----------
    chain
        the chain, in the coordinates of the camera (of the image, in px, in 2-D).
    data
        the frame or image; None for a cloud, which has no border, so that only occlusion is tested.
    """
    if len(chain.occluded) and chain.occluded.mean() > MAX_OCCLUDED:
        return False
    if data is None or chain.closed:
        return True
    ends = chain.joints[[0, -1]]
    pixels = data.camera.project(ends) if isinstance(data, Frame) else ends
    height, width = (data.depth if isinstance(data, Frame) else data.color).shape[:2]
    margin = BORDER_SHARE * width
    inside = (pixels > margin) & (pixels < np.array([width, height]) - 1 - margin)
    return bool(inside.all())


def length_notes(lengths: Iterable[ChainLength], units: str) -> list[str]:
    """Return a sentence for the chain whose length changes most in a capture, if that is more than a cable's can.

    lengths : lengths of chains that are fully in view, in any order. units : "m" or "px".
    """
    by_id = defaultdict[int, list[ChainLength]](list)
    for each in lengths:
        by_id[each.id].append(each)
    worst, sentence = MAX_SPREAD, list[str]()
    for number, found in sorted(by_id.items()):
        if len(found) < MIN_FRAMES:
            continue
        values = np.array([each.length for each in found])
        low, median, high = np.percentile(values, (5, 50, 95))
        if (high - low) / median > worst:
            worst = (high - low) / median
            shortest, longest = (min(found, key=lambda each: (each.length * sign, each.frame)) for sign in (1, -1))
            digits = 2 if units == "m" else 0
            sentence = [
                f"check the length: chain {number} is {shortest.length:.{digits}f} {units} long in frame {shortest.frame} and "
                f"{longest.length:.{digits}f} {units} in frame {longest.frame} (median {median:.{digits}f} {units} of "
                f"{len(found)} frames), both ends in view, but a cable keeps its length: look at these frames (doo3d explain "
                "--frame), for a part was lost or another cable joined, and give the number of cables (merge.chains)"
            ]
    return sentence
