"""Read sequences of a moving cable with truth, written to disk by another renderer."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...errors import InputError
from ...types import Frame
from ..benchmark.cases import Case, capture_cases
from ..rendering.renderer import Rendered
from ..truth_arrays import FILE, with_seen


@dataclass(frozen=True)
class RecordedSequence:
    """A capture of one cable in motion, for `sequence_case`, with the depth of the capture.

    Attributes
    ----------
    name
        name of the capture's folder.
    cases
        a case for each frame; in all frames, the axis of the cable starts at the same material point.
    """

    name: str
    cases: tuple[Case, ...]
    seed: int | None = None

    def __len__(self) -> int:
        """Return the number of frames."""
        return len(self.cases)

    def frame(self, index: int, sensor: str = "") -> Rendered:
        """Read a frame with its truth; the depth is that of the capture, whatever the sensor is."""
        known = self.cases[index].load()
        data: Frame = known.data
        mask = np.zeros(data.depth.shape, dtype=bool) if known.mask is None else known.mask
        truths = with_seen(self.cases[index].truths, data.camera, None, mask)
        return Rendered(data, mask.astype(np.uint8), mask, truths, np.asarray(data.depth, dtype=float))

    def frames(self, sensor: str = "") -> Iterator[Rendered]:
        """Read all frames, one after the other."""
        return (self.frame(index) for index in range(len(self)))


def recorded_sequences(folders: Iterable[Path], frames: int) -> list[RecordedSequence]:
    """Return the captures of moving cables in or below folders, with the first `frames` frames of each.

    Raises
    ------
    InputError : there is no capture, one cannot be read, or it does not show exactly one cable.
    """
    result = []
    for folder in folders:
        files = sorted(folder.rglob(FILE))
        if not files:
            raise InputError(f"{folder}: nothing below it has a {FILE} beside it", code="truth-missing")
        for file in files:
            cases = capture_cases(file.parent)
            if any(len(case.truths) != 1 for case in cases):
                raise InputError(f"{file}: shows another number of cables than one: leave it out", code="truth-invalid")
            result.append(RecordedSequence(file.parent.name, tuple(cases[:frames])))
    return result
