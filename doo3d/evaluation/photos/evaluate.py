"""Run the 2-D mode over photographs with instance labels, and score it."""

from functools import partial
from typing import Any

import numpy as np

from ...config import Config
from ...types import Array, Bools, Detection
from ...viz import draw
from ...viz.palette import DARK, chain_color
from ..benchmark.cases import Case
from ..benchmark.evaluate import detect_safely
from ..benchmark.run import Benchmark
from ..metrics.record import Record, Records, amount, failures, flags, number, share
from .datasets import Photo
from .score import score_photo, trace_cable

_MISSED = (128, 128, 128)
"""RGB color of a labelled cable without a matching chain."""

_UNLABELLED = (70, 70, 70)
"""RGB color of mask pixels where no cable is labelled."""

_TIMES = (
    number(("ms", ""), 7, "ms", 1),
    number(("95 %", ""), 7, "ms", 1, partial(np.percentile, q=95), name="ms_95"),
    amount(("errors", ""), 6, "errors", failures),
)
PHOTO_COLUMNS = (
    amount(("images", ""), 6, "images", len),
    *(number((key, ""), width, key, 2, np.mean, 100) for key, width in (("drawn", 7), ("instances", 10))),
    share(("count correct", ""), 18, "counts", flags("correct")),
    *_TIMES,
)
"""Columns: number of photographs; the two DICE scores of `score_photo` in %; photographs with the right number of chains;
median and 95th percentile of the time in ms; number of errors."""

CABLE_COLUMNS = (
    amount(("cables", ""), 6, "cables", len),
    share(("traced", ""), 18, "traced", flags("traced")),
    *(number((key, ""), width, key, 2, np.mean, 100) for key, width in (("recall", 7), ("precision", 9))),
    *_TIMES,
)
"""Columns: number of cables; cables traced (see `trace_cable`); mean recall and precision in %; time and errors as for
photographs."""


def photo_benchmark(config: Config, known_count: bool = False, give_mask: bool = True) -> Benchmark:
    """Return the benchmark of photographs; a failed detection counts as one without chains.

    Parameters
    ----------
    config
        the configuration of the detection, of the 2-D mode.
    known_count
        True gives the detection the true number of cables; False leaves the number to the config.
    give_mask
        False gives the detection no mask, so that it segments the image by the config; the score then uses its mask.
    """
    measure = partial(measure_photo, config=config, known_count=known_count, give_mask=give_mask)
    return Benchmark(measure, PHOTO_COLUMNS, photo_panels, caption, lambda row: -row.drawn - row.instances)


def cable_benchmark(config: Config) -> Benchmark:
    """Return the benchmark of single cables: each is detected alone, with its labelled pixels as the mask, as one chain."""
    measure = partial(measure_cables, config=_with_chains(config, 1))
    return Benchmark(measure, CABLE_COLUMNS, photo_panels, caption, lambda row: -row.recall - row.precision)


def measure_photo(case: Case, config: Config, known_count: bool, give_mask: bool) -> list[Record]:
    """Run the detection in a photograph, and return its record; arguments are as for `photo_benchmark`."""
    photo: Photo = case.load()
    used = _with_chains(config, photo.cables) if known_count else config
    detection, end = _detect(photo.image, used, photo.mask if give_mask else None)
    return [case.record(score_photo(detection, photo.labels) | end, detection)]


def measure_cables(case: Case, config: Config) -> list[Record]:
    """Run the detection for each cable of a photograph alone, and return their records; see `cable_benchmark`."""
    photo, rows = case.load(), []
    for cable in range(1, photo.cables + 1):
        mask = photo.labels == cable
        detection, end = _detect(photo.image, config, mask)
        trace = trace_cable(detection.chains[0] if detection.chains else None, photo.labels, cable)
        score = score_photo(detection, mask.astype(np.uint8))
        rows.append(case.record({"cable": cable} | score | trace | {"correct": trace.traced} | end, detection))
    return rows


def _detect(image: Array, config: Config, mask: Bools | None) -> tuple[Detection, dict[str, Any]]:
    """Run the detection; return it, empty after any exception, and the last values of its record, with the stages' time."""
    detection, end = detect_safely(image, config, mask, Exception)
    if end["error"]:
        return Detection((), "2d", "image"), end | {"ms": float("nan")}
    return detection, end | {"ms": 1e3 * sum(detection.seconds.values())}


def _with_chains(config: Config, chains: int) -> Config:
    return config.model_copy(update={"merge": config.merge.model_copy(update={"chains": max(chains, 1)})})


def name(row: Record) -> str:
    """Return the name `subset/photograph`, followed by the number of the cable if the record is of one cable."""
    return f"{row.family}/{row.frame}" + (f" cable {row.cable}" if "cable" in row else "")


def caption(row: Record) -> str:
    """Return a caption for the picture of a record, in one line: name, scores in %, and the error if there was one."""
    if "recall" in row:
        text = f"recall {100 * row.recall:.1f}   precision {100 * row.precision:.1f}"
    else:
        dice = "   ".join(f"{key} {100 * row[key]:.1f}" for key in ("drawn", "instances"))
        text = f"{dice}   {row.chains} of {row.cables} chains"
    return f"{name(row)}   {text}" + (f"   {row.error}" if row.error else "")


def remarks(rows: Records) -> list[str]:
    """Return lines that name photographs with errors or a wrong number of chains, and cables that are not traced."""
    lines = [
        f"error: {error} [{code}]: {', '.join(name(row) for row in rows if row.error == error)}"
        for error, code in dict.fromkeys((row.error, row.code) for row in rows if row.error)
    ]
    wrong = [row for row in rows if not (row.correct or row.error)]
    if counts := [f"{name(row)} {row.chains} of {row.cables}" for row in wrong if "cable" not in row]:
        lines.append(f"count wrong: {', '.join(counts)}")
    if missed := [name(row) for row in wrong if "cable" in row]:
        lines.append(f"not traced: {', '.join(missed)}")
    return lines


def photo_panels(row: Record) -> tuple[Array, Array]:
    """Draw the chains over a photograph, and its labels, (H, W, 3) uint8 RGB each.

    A labelled cable has the color of the chain matched with it, or is gray if there is none. It is darker where the mask does not
    contain it. Unlabelled pixels of the mask are dark gray.
    """
    photo: Photo = row.case.load()
    labels = (photo.labels == row.cable).astype(np.uint8) if "cable" in row else photo.labels
    mask = labels > 0 if "cable" in row else photo.mask
    colors = [DARK, *(_MISSED if chain < 0 else chain_color(int(chain)) for chain in row.match)]
    out = np.array(colors, np.uint8)[labels]
    out[mask & (labels == 0)] = _UNLABELLED
    out[~mask & (labels > 0)] //= 2
    return draw(photo.image, row.detection), np.asarray(out)
