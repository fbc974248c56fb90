"""Run the checks of one frame and its chains that are fast enough for every frame."""

from collections.abc import Sequence

import numpy as np

from .. import Chain, Cloud, Frame, Image, Plane
from .cable import distance_of, radius_notes
from .camera import camera_notes
from .depth_kind import distance_notes, relief_notes
from .depth_unit import depth_samples, depth_step, far_notes, unit_notes

PREFIX = "check "

METHOD = "method"
"""Topic of the notes about the chosen method of segmentation, which are not warnings."""

METHOD_PREFIX = "segment: method "
"""First words of the notes about the method of segmentation that was chosen automatically."""


def frame_notes(data: Frame | Cloud | Image, chains: Sequence[Chain], plane: Plane | None = None) -> tuple[str, ...]:
    """Return sentences about implausible values of a frame and its chains.

    The intrinsics, the unit of depth, and the radius and distance of the longest chain are compared with real cameras and cables;
    the shape of surfaces and the relief of the chain with those in metric depth. Takes about 0.5 ms.

    Parameters
    ----------
    data
        the frame or cloud; nothing is checked of an image.
    chains
        the chains found, longest first, in the coordinates of the data.
    plane
        the plane around the object, in the coordinates of the data; None if unknown.
    """
    if isinstance(data, Image):
        return ()
    viewpoint = np.zeros(3) if isinstance(data, Frame) else data.viewpoint
    distance = None if viewpoint is None else distance_of(chains, viewpoint)
    notes = list[str]()
    if isinstance(data, Frame):
        notes += camera_notes(data.camera)
        samples = depth_samples(data.depth)
        step = depth_step(samples)
        notes += distance_notes(data) or relief_notes(data, chains[0] if chains else None, plane, step is not None)
        if any(topic_of(note) == "depth" for note in notes):  # one sentence for one cause
            return tuple(notes)
        if distance is not None:
            notes += unit_notes(distance, distance, step, data.camera, "the distance of the longest chain")
        elif len(samples):
            near, median = np.percentile(samples, (1, 50)).tolist()
            notes += unit_notes(median, near, step, data.camera, "the median depth") or far_notes(median)
    elif distance is not None and data.coordinates != "world":
        notes += unit_notes(distance, distance, None, None, "the distance of the longest chain")
    if not any(topic_of(note) == "depth unit" for note in notes):  # one sentence for one cause
        notes += radius_notes(chains, distance)
    return tuple(notes)


def topic_of(note: str) -> str | None:
    """Return the topic of a note that is printed once per run instead of for each frame; None for any other note.

    Such notes are those of these checks, with a topic such as "radius" in "check the radius: ...", and those about the method of
    segmentation.
    """
    if note.startswith(METHOD_PREFIX):
        return METHOD
    head, colon, _ = note.partition(":")
    return head.removeprefix(PREFIX).removeprefix("the ") if colon and head.startswith(PREFIX) else None
