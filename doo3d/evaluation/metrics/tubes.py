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
    """The result for one tube of one scene.

    Attributes
    ----------
    file
        name of the text file of tubes that the scene was made from.
    seen_fraction
        fraction of the tube's length that the camera sees, 0 to 1.
    correct
        whether the chain matched with the tube follows no other one, has no wrong connection, covers at least 94 % of the tube
        and has less than 3 % of its length off it.
    """

    file: str
    seen_fraction: float
    correct: bool


def tube_cases(folder: str | Path, seeds: Iterable[int], sensor: str = "d435", size: tuple[int, int] = (1280, 720)) -> list[Case]:
    """Return a case for each tube configuration (*.txt) in a folder and each seed, sorted by file name.

    Parameters
    ----------
    folder
        with the configurations: text files of tubes made of straight cylinders; subfolders are not searched.
    seeds
        0 or more each; a seed sets the camera's pose and the tubes' color.
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


def evaluate_tubes(cases: Iterable[Case], config: Config) -> list[Tube]:
    """Detect in every scene, given its true mask and number of tubes, and tell which tubes are correct.

    A failed detection makes all tubes of its scene wrong.

    Parameters
    ----------
    cases
        the scenes, from `tube_cases`.
    config
        of the detection, for 3-D.

    Returns
    -------
    A result for each tube of each scene, scene by scene.

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
    """Tell for each true tube, in the order of `truths`, whether a chain follows it correctly.

    Tubes and chains are matched one to one by the greatest total length in common. The chain is correct if it follows no other
    tube, has no wrong connection, covers at least 94 % of the tube and has less than 3 % of its length off it.
    """
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
    """Return a text table with a line for each file and one for all.

    Columns: number of tubes, number of tubes with at least 60 % of their length seen, and correct ones of these (number and %).
    """
    groups = {file: [tube for tube in tubes if tube.file == file] for file in dict.fromkeys(tube.file for tube in tubes)}
    name_width = max(map(len, [*groups, "all"]))
    lines = [f"{'':{name_width}s}  tubes  seen {MIN_SEEN_FRACTION:.0%}  correct"]
    for name, group in {**groups, "all": list(tubes)}.items():
        counted = [tube.correct for tube in group if tube.seen_fraction >= MIN_SEEN_FRACTION]
        share = f"{sum(counted) / len(counted):.1%}" if counted else "-"
        lines.append(f"{name:{name_width}s}  {len(group):5d}  {len(counted):8d}  {sum(counted):7d}  {share}")
    return "\n".join(lines)
