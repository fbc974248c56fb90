"""Choose the frames of a run that get a picture, and the format."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from ..errors import InputError
from ..outputs import PICTURES
from ..types.display import DOUBTFUL_CONFIDENCE
from ..types.plausibility import METHOD, topic_of

if TYPE_CHECKING:
    from .frame_record import FrameRecord

ALL, FAILED, NONE, EVERY = "all", "failed", "none", "every"

_EVERY = re.compile(rf"{EVERY}:(\d{{1,9}})")


@dataclass(frozen=True)
class Pictures:
    """The choice of frames that get a picture, and the format.

    Attributes
    ----------
    frames
        "all"; "failed": frames without a chain, with a doubtful chain, with a chain whose confidence is below 0.5, or with a note
        other than the method of segmentation; "none"; or "every".
    step
        with "every", the distance in frames from one picture to the next, starting at the first frame.
    kind
        format of the pictures: "jpg" or "png".
    instances
        whether every frame also gets an image of its instance labels.
    """

    frames: str = ALL
    step: int = 1
    kind: str = PICTURES[0]
    instances: bool = False

    @staticmethod
    def of(frames: str, kind: str = PICTURES[0], instances: bool = False) -> Pictures:
        """Parse a choice from texts such as "every:10" and "jpg".

        Raises
        ------
        InputError : a text is not among the choices.
        """
        if kind not in PICTURES:
            raise InputError(f"--picture-format {kind[:20]}: unknown, choose one of {', '.join(PICTURES)}", code="choice-unknown")
        every = _EVERY.fullmatch(frames)
        if every and int(every[1]):
            return Pictures(EVERY, int(every[1]), kind, instances)
        if frames not in (ALL, FAILED, NONE):
            raise InputError(
                f"--pictures {frames[:20]}: unknown, choose one of all, failed, none and every:N, such as every:10",
                code="choice-unknown",
            )
        return Pictures(frames, kind=kind, instances=instances)

    def of_frames(self, names: Sequence[str]) -> dict[str, Pictures]:
        """Return name of each frame -> its own choice, which is never "every"."""
        return {name: self.at(position) for position, name in enumerate(names)}

    def at(self, position: int) -> Pictures:
        """Return the choice for the frame at a position in the capture, from 0; it is never "every"."""
        return self if self.frames != EVERY else replace(self, frames=NONE if position % self.step else ALL, step=1)

    def wants(self, record: FrameRecord) -> bool:
        """Return whether a detected frame gets a picture; call it on the choice for this frame, from `at`."""
        if self.frames != FAILED:
            return self.frames == ALL
        is_noted = any(topic_of(note) != METHOD for note in record.notes)
        is_unsure = bool(record.doubtful) or min(record.confidences, default=1.0) < DOUBTFUL_CONFIDENCE
        return is_noted or not record.lengths or is_unsure


ALL_PICTURES = Pictures()
NO_PICTURES = Pictures(NONE)
