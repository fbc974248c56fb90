"""Score entangled tubes one by one: the fraction of the sufficiently visible tubes that is correct."""

from collections.abc import Iterable, Sequence
from functools import partial
from pathlib import Path

from ...config import Config
from ...errors import ConfigError, InputError
from ...types import Chain
from ..metrics.correct import MAX_OFF_FRACTION, MIN_COVERAGE
from ..metrics.observed import Observed
from ..metrics.record import Record, Records, amount, flags, share
from ..scenes.model import Truth
from ..scenes.registry import TUBES
from .cases import Case, KnownFrame, scene_cases
from .evaluate import case_config, detect_safely
from .pictures import frame_panels
from .run import Benchmark

MIN_SEEN_FRACTION = 0.6
"""Least fraction of a tube's length that must be seen for the tube to count."""


def _counted(rows: Records) -> tuple[int, int]:
    return flags("correct")([row for row in rows if row.counts])


COLUMNS = (
    amount(("tubes", ""), 6, "tubes", len),
    amount((f"seen {MIN_SEEN_FRACTION:.0%}", ""), 9, "tubes_seen", lambda rows: _counted(rows)[0]),
    amount(("correct", ""), 8, "tubes_correct", lambda rows: _counted(rows)[1]),
    share(("", ""), 7, "share", _counted, "{2:.1f}%"),
)
"""Columns: number of tubes; number with at least 60 % of their length seen; correct ones among these, and their share in %."""


def tube_cases(folder: str | Path, seeds: Iterable[int], sensor: str = "d435", size: tuple[int, int] = (1280, 720)) -> list[Case]:
    """Return a case (a frame with known truth) for each file of tubes (*.txt) in a folder and each seed, sorted by file name.

    Parameters
    ----------
    folder
        the folder with the text files, in the format that `read_tubes` reads; subfolders are not searched.
    seeds
        integers, 0 or more; a seed sets the camera's pose and the tubes' color.
    sensor
        simulated depth camera: "d435", "d455", "zivid", or "none" for exact depth.
    size
        (width, height) px of the image.

    Raises
    ------
    InputError : the folder holds no *.txt.
    """
    files = sorted(Path(folder).glob("*.txt"))
    if not files:
        raise InputError(f"{folder}: there is no tube configuration (*.txt) in it: give another folder", code="tubes-missing")
    return scene_cases([f"{TUBES}:{file}" for file in files], seeds, sensor, size)


def tube_benchmark(config: Config) -> Benchmark:
    """Return the benchmark of tubes, for which the detection is given the true mask and the number of tubes.

    If the detection fails in a scene, all tubes of this scene count as wrong.

    Raises
    ------
    ConfigError : the config is for 2-D.
    """
    if config.mode == "2d":
        raise ConfigError("tubes are evaluated in 3-D, and the config is for 2-D: use tubes or default", code="config-mode")
    return Benchmark(
        partial(measure_tubes, config=config), COLUMNS, frame_panels, lambda row: str(row.frame), lambda row: not row.correct
    )


def measure_tubes(case: Case, config: Config) -> list[Record]:
    """Run the detection in a scene, and return a record for each tube: its seen fraction (0 to 1), `counts` and `correct`.

    `correct` is as for `correct_tubes`. `counts` is true if at least 60 % of the tube's length is seen.
    """
    known: KnownFrame = case.load()
    detection, end = detect_safely(known.data, case_config(config, known.truths, True, "mask"), known.mask)
    rows = []
    for number, (truth, correct) in enumerate(zip(known.truths, correct_tubes(detection.chains, known.truths), strict=True)):
        seen = 1.0 if truth.seen is None else float(truth.seen.mean())
        values = {"cable": number + 1, "seen": seen, "counts": seen >= MIN_SEEN_FRACTION, "correct": correct}
        rows.append(case.record(values | end, detection))
    return rows


def correct_tubes(chains: Sequence[Chain], truths: Sequence[Truth]) -> list[bool]:
    """Return for each true tube whether a chain follows it correctly, in the order of `truths`.

    Tubes and chains are matched one to one so that their total common length is greatest. A tube is correct if its chain follows
    no other tube, has no wrong connection, covers at least 94 % of the tube and has less than 3 % of its own length off it.

    Parameters
    ----------
    chains
        the detected chains, m.
    truths
        the true tubes, m, in the frame of the chains.
    """
    observed = Observed(tuple(chains), tuple(truths))
    result = [False] * len(truths)
    for chain, tube in observed.pairs:
        alignment = observed.alignments[chain]
        follows = {stretch.cable for stretch in alignment.stretches} == {tube} and not alignment.wrong
        off = observed.distances[chain].off_fraction
        result[tube] = follows and observed.coverage[tube] >= MIN_COVERAGE and off < MAX_OFF_FRACTION
    return result
