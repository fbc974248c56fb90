"""Check the frames of a run for implausible data: collect evidence from each frame, and report on the capture.

The registration of color to depth, and exchanged color channels, are checked in a few frames only, chosen by their position in
the capture, so that the evidence does not depend on the number of workers or on interruptions.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ..config import Config
from ..errors import DooError
from ..inputs import FrameData
from ..types import Cloud, Detection, Frame, Image
from ..types.plausibility import METHOD, topic_of
from ..types.plausibility.lengths import ChainLength, is_whole, length_notes
from ..types.plausibility.registration import ColorShift, color_shift, registration_notes
from .frame_record import OK, FrameRecord

MIN_FRAMES_APART = 32
"""Least distance, in frames, between two thorough checks; a check takes 3 ms, hence 0.1 ms per frame of a capture."""

MAX_THOROUGH = 8
"""Greatest number of frames of a capture that are checked thoroughly."""

SHIFT, EXCHANGED, LENGTHS, WIDTH = "shift", "exchanged", "lengths", "width"
"""Keys of a frame's evidence. SHIFT: (right, down, gain) of the color against the depth, px. EXCHANGED: number of chains found
with red and blue exchanged. LENGTHS: (id, length) of the chains fully in view, m or px. WIDTH: width of the image, px."""


def thorough_frames(names: Sequence[str]) -> frozenset[str]:
    """Return the names of the frames to check thoroughly: the first, and at most seven more, evenly spaced."""
    return frozenset(names[:: max(MIN_FRAMES_APART, math.ceil(len(names) / MAX_THOROUGH))])


def frame_evidence(
    loaded: FrameData, detection: Detection, config: Config, detect: Callable[[Frame | Cloud | Image], Detection]
) -> dict[str, Any]:
    """Return the evidence of one frame about registration and channels, for `capture_notes`.

    Parameters
    ----------
    loaded
        the frame.
    detection
        the chains found in it.
    config
        the settings of the detection.
    detect
        function that detects in other data with the same settings; called if color ranges are set and no chain was found.
    """
    data, evidence = loaded.data, dict[str, Any]()
    if config.mode != "2d" and isinstance(data, Frame) and (shift := color_shift(data)) is not None:
        evidence |= {SHIFT: list(shift), WIDTH: data.depth.shape[1]}
    by_color = config.segment.method in ("auto", "hsv") and config.segment.ranges and loaded.mask_for(config) is None
    if by_color and not detection.chains and (exchanged := _exchanged(data)) is not None:
        try:
            evidence[EXCHANGED] = len(detect(exchanged).chains)
        except DooError:
            pass  # the settings do not fit these colors either
    return evidence


def chain_evidence(detection: Detection, data: Frame | Cloud | Image) -> dict[str, Any]:
    """Return the lengths of the tracked chains that are fully in view, as evidence for `capture_notes`."""
    chains = detection.in_camera().chains
    border = None if isinstance(data, Cloud) else data
    whole = [chain for chain in chains if chain.id is not None and is_whole(chain, border)]
    return {LENGTHS: [[chain.id, chain.length] for chain in whole]} if whole else {}


def capture_notes(records: Sequence[FrameRecord]) -> tuple[str, ...]:
    """Return sentences about implausible data that only the frames of a run together show.

    records : the records of all frames, in the order of the capture.
    """
    succeeded = [record for record in records if record.status == OK]
    shifts, exchanged, lengths, width = list[ColorShift](), list[int](), list[ChainLength](), 0
    for record in succeeded:
        try:
            if SHIFT in record.evidence:
                right, down, gain = record.evidence[SHIFT]
                shifts.append(ColorShift(int(right), int(down), float(gain)))
                width = max(width, int(record.evidence[WIDTH]))
            exchanged += [int(record.evidence[EXCHANGED])] if EXCHANGED in record.evidence else []
            lengths += [ChainLength(int(number), record.name, float(each)) for number, each in record.evidence.get(LENGTHS, ())]
        except (TypeError, ValueError, KeyError, OverflowError):
            continue  # a journal that was edited; the results do not depend on it
    units = succeeded[0].units if succeeded else "m"
    return (
        *registration_notes(shifts, width),
        *_exchange_notes(exchanged, sum(bool(record.lengths) for record in succeeded)),
        *length_notes(lengths, units),
    )


def run_notes(records: Sequence[FrameRecord]) -> tuple[str, ...]:
    """Return the first note of each topic from the checks of single frames, then the notes of `capture_notes`.

    A note of the first kind ends with the name of its frame and the number of frames with a note of its topic.
    """
    first, counts = dict[str, str](), dict[str, int]()
    for record in records:
        for topic, note in {topic: note for note in record.notes if (topic := topic_of(note)) not in (None, METHOD)}.items():
            first.setdefault(topic, f"{note} (frame {record.name}")
            counts[topic] = counts.get(topic, 0) + 1
    of_frames = (f"{note}; so in {counts[topic]} of {len(records)} frames)" for topic, note in first.items())
    return (*of_frames, *capture_notes(records))


def _exchange_notes(exchanged: Sequence[int], with_chains: int) -> list[str]:
    """Return a sentence if no frame has a chain, but some frames have chains once red and blue are exchanged."""
    found = [count for count in exchanged if count]
    if with_chains or 2 * len(found) <= len(exchanged):
        return []
    chains = "1 chain is found" if max(found) == 1 else f"{max(found)} chains are found"
    return [
        f"check the colors: nothing is found in segment.ranges, but with red and blue exchanged {chains} (in {len(found)} of "
        f"{len(exchanged)} frames tried): the images seem to be BGR where RGB is expected, or the ranges were made from "
        "such images: convert the images (OpenCV writes files from BGR), or make the ranges anew with doo3d tune"
    ]


def _exchanged(data: Frame | Cloud | Image) -> Frame | Cloud | Image | None:
    """Return the data with red and blue exchanged; None without color."""
    if isinstance(data, Cloud):
        return None
    return None if data.color is None else replace(data, color=np.ascontiguousarray(data.color[..., ::-1]))
