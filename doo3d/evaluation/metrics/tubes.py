"""Score entangled tubes one by one: the fraction of those seen well enough that is correct."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from scipy.optimize import linear_sum_assignment

from ...config import Config
from ...errors import ConfigError, DooError, InputError
from ...pipeline import detect
from ...types import Chain
from ..benchmark.cases import Case, scene_cases
from ..scenes.model import Truth
from ..scenes.registry import TUBES
from .alignment import align_chain, overlaps
from .distances import measure_distances
from .score import MAX_OFF_FRACTION, MIN_COVERAGE, covered_fraction

MIN_SEEN_FRACTION = 0.6
"""Least fraction of a tube's length that must be seen for the tube to count."""


@dataclass(frozen=True)
class Tube:
    """One tube of one scene: its file, the fraction of its length that is seen, and whether it is correct.

    It is correct by the rule of a frame, applied to this tube alone: one chain follows it and no other tube, without a
    wrong connection, along MIN_COVERAGE of it at least, and with less than MAX_OFF_FRACTION of the chain off it.
    """

    file: str
    seen_fraction: float
    correct: bool


def tube_cases(folder: str | Path, seeds: Iterable[int], sensor: str = "d435", size: tuple[int, int] = (1280, 720)) -> list[Case]:
    """Return a case for each tube configuration (.txt) in a folder and each seed, which sets the camera.

    Parameters
    ----------
    folder
        with the tube configurations.
    seeds
        one camera each.
    sensor
        a key of SENSORS.
    size
        (width, height) px of the image.

    Raises
    ------
    InputError : there are no configurations.
    """
    files = sorted(Path(folder).glob("*.txt"))
    if not files:
        raise InputError(f"{folder}: there is no tube configuration (*.txt) in it: give another folder", code="tubes-missing")
    return scene_cases([f"{TUBES}:{file}" for file in files], seeds, sensor, size)


def evaluate_tubes(cases: Iterable[Case], config: Config) -> list[Tube]:
    """Detect in every scene with its mask and number of tubes given; a failed detection makes all its tubes wrong.

    Raises
    ------
    ConfigError : the config is for 2-D.
    InputError : a file is not a tube configuration.
    """
    if config.mode == "2d":
        raise ConfigError("tubes are evaluated in 3-D, and the config is for 2-D: use tubes or default", code="config-mode")
    tubes: list[Tube] = []
    for case in cases:
        known = case.load()
        merge = config.merge.model_copy(update={"chains": max(len(known.truths), 1)})
        try:
            chains: tuple[Chain, ...] = detect(known.data, config.model_copy(update={"merge": merge}), mask=known.mask).chains
        except DooError:
            chains = ()
        for truth, correct in zip(known.truths, correct_tubes(chains, known.truths), strict=True):
            tubes.append(Tube(case.family, 1.0 if truth.seen is None else float(truth.seen.mean()), correct))
    return tubes


def correct_tubes(chains: Sequence[Chain], truths: Sequence[Truth]) -> list[bool]:
    """Tell of each tube whether the chain matched with it is correct."""
    chains, truths = tuple(chains), tuple(truths)
    alignments = [align_chain(chain, truths) for chain in chains]
    result = [False] * len(truths)
    for c, t in zip(*linear_sum_assignment(-overlaps(chains, alignments, len(truths))), strict=True):
        alignment = alignments[c]
        result[t] = (
            {stretch.cable for stretch in alignment.stretches} == {t}
            and not alignment.wrong
            and covered_fraction(alignment, truths[t], t) >= MIN_COVERAGE
            and measure_distances(chains[c], alignment, truths).off_fraction < MAX_OFF_FRACTION
        )
    return result


def format_tubes(tubes: Sequence[Tube]) -> str:
    """Return a line per file and one for all: tubes, those seen well enough, and how many of these are correct."""
    groups = {file: [tube for tube in tubes if tube.file == file] for file in dict.fromkeys(tube.file for tube in tubes)}
    name_width = max(map(len, [*groups, "all"]))
    lines = [f"{'':{name_width}s}  tubes  seen {MIN_SEEN_FRACTION:.0%}  correct"]
    for name, group in {**groups, "all": list(tubes)}.items():
        counted = [tube.correct for tube in group if tube.seen_fraction >= MIN_SEEN_FRACTION]
        share = f"{sum(counted) / len(counted):.1%}" if counted else "-"
        lines.append(f"{name:{name_width}s}  {len(group):5d}  {len(counted):8d}  {sum(counted):7d}  {share}")
    return "\n".join(lines)
