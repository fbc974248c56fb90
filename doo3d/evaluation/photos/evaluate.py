"""Run the 2-D mode over photographs with instance labels, and score it."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from ...config import Config
from ...errors import DooError, error_code
from ...types import Array, Bools, Detection
from .datasets import PhotoRef
from .score import CableTrace, PhotoScore, score_photo, trace_cable

Detector = Callable[[Array, Config, Bools], Detection]


@dataclass(frozen=True)
class Row:
    """One photograph, or one cable of it alone: its score and the detection, or the error.

    error, code : sentence and code of the error that ended the detection; None where it ended well. cable : number of the
    cable, and trace : its score; None for a whole photograph.
    """

    ref: PhotoRef
    score: PhotoScore
    detection: Detection
    error: str | None = None
    code: str | None = None
    cable: int | None = None
    trace: CableTrace | None = None

    @property
    def name(self) -> str:
        """Subset, photograph and cable."""
        cable = "" if self.cable is None else f" cable {self.cable}"
        return f"{self.ref.subset}/{self.ref.name}{cable}"

    @property
    def milliseconds(self) -> float:
        """The time from the mask to the chains; NaN where there was an error."""
        return float("nan") if self.error else 1e3 * sum(self.detection.seconds.values())

    @property
    def quality(self) -> float:
        """The sum of two scores by which the worst rows are chosen."""
        return self.trace.recall + self.trace.precision if self.trace else self.score.drawn + self.score.labelled


def evaluate_photos(
    refs: Iterable[PhotoRef], config: Config, known_count: bool = False, detect: Detector | None = None
) -> list[Row]:
    """Detect in every photograph and score.

    The first photograph of each subset is run twice and counted once, so that compiling is not timed.

    Parameters
    ----------
    refs
        the photographs.
    config
        for 2-D.
    known_count
        give the detection the number of cables; else the config decides.
    detect
        the detector that is measured, called with image, config and mask; None for this project's own.
    """
    rows = list[Row]()
    for ref in refs:
        photo = ref.load()
        used = _with_chains(config, photo.cables) if known_count else config
        if not rows or rows[-1].ref.subset != ref.subset:
            _run(photo.image, used, photo.mask, detect)
        detection, error, code = _run(photo.image, used, photo.mask, detect)
        rows.append(Row(ref, score_photo(detection.chains, photo.labels, photo.mask), detection, error, code))
    return rows


def evaluate_cables(refs: Iterable[PhotoRef], config: Config, detect: Detector | None = None) -> list[Row]:
    """Detect each cable of each photograph alone, one chain in its own labelled pixels, and score.

    Parameters
    ----------
    refs
        the photographs.
    config
        for 2-D.
    detect
        as of `evaluate_photos`.
    """
    rows, config = list[Row](), _with_chains(config, 1)
    for ref in refs:
        photo = ref.load()
        for cable in range(1, photo.cables + 1):
            mask = photo.labels == cable
            if not rows or rows[-1].ref.subset != ref.subset:
                _run(photo.image, config, mask, detect)
            detection, error, code = _run(photo.image, config, mask, detect)
            trace = trace_cable(detection.chains[0] if detection.chains else None, photo.labels, cable)
            score = score_photo(detection.chains, mask.astype(np.uint8), mask)
            rows.append(Row(ref, score, detection, error, code, cable, trace))
    return rows


def worst(rows: Iterable[Row], count: int) -> list[Row]:
    """Return the rows with the lowest scores, lowest first."""
    return sorted(rows, key=lambda row: row.quality)[:count]


def _with_chains(config: Config, chains: int) -> Config:
    return config.model_copy(update={"merge": config.merge.model_copy(update={"chains": max(chains, 1)})})


def _run(image: Array, config: Config, mask: Bools, detect: Detector | None) -> tuple[Detection, str | None, str | None]:
    """Return the detection, or an empty one with the sentence and code of the error, whatever was raised."""
    run: Callable[..., Detection]
    if detect is None:
        from ...pipeline import detect as run
    else:
        run = detect
    empty = Detection((), "2d", "image")
    try:
        return run(image, config, mask=mask), None, None
    except DooError as error:
        return empty, str(error), error.code
    except Exception as error:
        return empty, f"{type(error).__name__}: {error}", error_code(error)
