"""Run the 2-D mode over photographs with instance labels, and score it."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from ...config import Config
from ...errors import DooError, error_code
from ...stages.segment import segment
from ...types import Array, Bools, Detection, Image
from .datasets import PhotoRef
from .score import CableTrace, PhotoScore, score_photo, trace_cable

Detector = Callable[[Array, Config, Bools | None], Detection]


@dataclass(frozen=True)
class Row:
    """The result for one photograph, or for one cable of a photograph detected alone.

    Attributes
    ----------
    ref
        the photograph.
    score
        the score of the detected chains against the labels.
    detection
        the detection; without chains if there was an error.
    error, code
        message and machine-readable code of the error that ended the detection; None if there was none.
    cable
        number of the cable in the labels, from 1; None for a whole photograph.
    trace
        how well the chain follows the cable `cable`; None for a whole photograph.
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
        """The name `subset/photograph`, followed by the number of the cable if the row is for one cable."""
        cable = "" if self.cable is None else f" cable {self.cable}"
        return f"{self.ref.subset}/{self.ref.name}{cable}"

    @property
    def milliseconds(self) -> float:
        """The duration of the detection in ms, from the mask to the chains; NaN if there was an error."""
        return float("nan") if self.error else 1e3 * sum(self.detection.seconds.values())

    @property
    def quality(self) -> float:
        """A value to rank rows by, 0 (worst) to 2.

        For a single cable, recall + precision; for a photograph, the sum of the DICE scores `drawn` and `labelled`.
        """
        return self.trace.recall + self.trace.precision if self.trace else self.score.drawn + self.score.labelled


def evaluate_photos(
    refs: Iterable[PhotoRef],
    config: Config,
    known_count: bool = False,
    detect: Detector | None = None,
    give_mask: bool = True,
) -> list[Row]:
    """Detect in every photograph and score the result.

    The first photograph of each subset is run twice and counted once, so that compilation is not timed.

    Parameters
    ----------
    refs
        the photographs, subset by subset.
    config
        the configuration of the detection, of the 2-D mode.
    known_count
        True gives the detection the true number of cables; False leaves the number to the config.
    detect
        another detector to measure, called as detect(image, config, mask=mask) with the photograph (H, W, 3) uint8 RGB and its
        mask (H, W) bool; None for `doo3d.detect`.
    give_mask
        False gives the detection no mask, so that it selects the object by the config; the score then takes the mask selected.

    Returns
    -------
    A row for each photograph; a failed detection counts as one without chains, and its row holds the error.
    """
    rows = list[Row]()
    for ref in refs:
        photo = ref.load()
        used = _with_chains(config, photo.cables) if known_count else config
        if not rows or rows[-1].ref.subset != ref.subset:
            _run(photo.image, used, photo.mask if give_mask else None, detect)
        detection, error, code = _run(photo.image, used, photo.mask if give_mask else None, detect)
        own = None if give_mask or error else segment(Image(photo.image), used.segment, seed=used.seed).foreground.mask
        rows.append(
            Row(ref, score_photo(detection.chains, photo.labels, photo.mask if own is None else own), detection, error, code)
        )
    return rows


def evaluate_cables(refs: Iterable[PhotoRef], config: Config, detect: Detector | None = None) -> list[Row]:
    """Detect each cable of each photograph alone, with its labelled pixels as the mask, and score the result.

    The detection is told to find one chain. The first cable of each subset is run twice and counted once, so that compilation is
    not timed.

    Parameters
    ----------
    refs
        the photographs, subset by subset.
    config
        the configuration of the detection, of the 2-D mode.
    detect
        another detector to measure, called as detect(image, config, mask=mask) with the photograph (H, W, 3) uint8 RGB and the
        cable's pixels (H, W) bool; None for `doo3d.detect`.

    Returns
    -------
    A row for each cable, photograph by photograph; a failed detection counts as one without a chain, and its row holds the error.
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
    """Return the `count` rows of the lowest quality (see `Row.quality`), lowest first."""
    return sorted(rows, key=lambda row: row.quality)[:count]


def _with_chains(config: Config, chains: int) -> Config:
    return config.model_copy(update={"merge": config.merge.model_copy(update={"chains": max(chains, 1)})})


def _run(image: Array, config: Config, mask: Bools | None, detect: Detector | None) -> tuple[Detection, str | None, str | None]:
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
