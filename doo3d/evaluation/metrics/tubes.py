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
        name of the text file that describes the tubes of the scene.
    seen_fraction
        fraction of the tube's length that the camera sees, 0 to 1.
    correct
        whether a chain follows the tube correctly: it follows no other tube, has no wrong connection, covers at least 94 % of the
        tube and has less than 3 % of its own length off it.
    """

    file: str
    seen_fraction: float
    correct: bool


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


def evaluate_tubes(cases: Iterable[Case], config: Config) -> list[Tube]:
    """Detect in every scene, given its true mask and number of tubes, and tell which tubes are correct.

    If the detection fails in a scene, all tubes of this scene count as wrong.

    Parameters
    ----------
    cases
        the scenes, from `tube_cases`.
    config
        the configuration of the detection, of a 3-D mode.

    Returns
    -------
    A result for each tube of each scene, scene by scene.

    Raises
    ------
    ConfigError : the config is for 2-D.
    InputError : a file cannot be read, or is not a tube configuration.
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
    """Return, for each true tube, whether a chain follows it correctly: a list of bool in the order of `truths`.

    Tubes and chains are matched one to one by the greatest total length in common. A tube is correct if its chain follows no
    other tube, has no wrong connection, covers at least 94 % of the tube and has less than 3 % of its own length off it.

    Parameters
    ----------
    chains
        the detected chains, m.
    truths
        the true tubes, m, in the frame of the chains.
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
    """Return a text table of results, with a line for each file of tubes and a line for all.

    The columns are:

    - the name of the file;
    - the number of its tubes, over all scenes;
    - the number of tubes with at least 60 % of their length seen;
    - the number of these that are correct (see `Tube.correct`);
    - this number in percent of the tubes that are seen well enough; "-" if there are none.
    """
    groups = {file: [tube for tube in tubes if tube.file == file] for file in dict.fromkeys(tube.file for tube in tubes)}
    name_width = max(map(len, [*groups, "all"]))
    lines = [f"{'':{name_width}s}  tubes  seen {MIN_SEEN_FRACTION:.0%}  correct"]
    for name, group in {**groups, "all": list(tubes)}.items():
        counted = [tube.correct for tube in group if tube.seen_fraction >= MIN_SEEN_FRACTION]
        share = f"{sum(counted) / len(counted):.1%}" if counted else "-"
        lines.append(f"{name:{name_width}s}  {len(group):5d}  {len(counted):8d}  {sum(counted):7d}  {share}")
    return "\n".join(lines)
