"""Entangled tubes, tube by tube: which of those that are seen well enough are found right."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.optimize import linear_sum_assignment

from ...config import Config
from ...errors import ConfigError, DooError, InputError
from ...pipeline import detect
from ...types import Chain
from ..benchmark.cases import Case, scene_cases
from ..scenes.model import Truth
from ..scenes.registry import TUBES
from .alignment import follow
from .score import COVERED, OFF, covered, off_share

SEEN = 0.6  # least share of a tube's length that is seen for it to count


@dataclass(frozen=True)
class Tube:
    """One tube of one scene: the file it is from, the share of its length that is seen, and whether it is right.

    Right is what the rule of a frame asks, of this tube alone: one chain follows it and no other, without a wrong
    connection, along COVERED of it at least, and less than OFF of the chain off it.
    """

    file: str
    seen: float
    right: bool


def tube_cases(folder: str | Path, seeds: Iterable[int], sensor: str = "d435", size: tuple[int, int] = (1280, 720)) -> list[Case]:
    """Every tube configuration (.txt) in a folder, seen by a camera per seed.

    Raises
    ------
    InputError : there are none.
    """
    files = sorted(Path(folder).glob("*.txt"))
    if not files:
        raise InputError(f"{folder}: there is no tube configuration (*.txt) in it", code="tubes-missing")
    return scene_cases([f"{TUBES}:{file}" for file in files], seeds, sensor, size)


def evaluate_tubes(cases: Iterable[Case], config: Config) -> list[Tube]:
    """Detect in every scene with its mask and number of tubes given; nothing is right where the detection fails.

    Raises
    ------
    ConfigError : the config is for 2-D.
    InputError : a file is not a tube configuration.
    """
    if config.mode == "2d":
        raise ConfigError("tubes are known in 3-D, and the config is for 2-D", code="config-mode")
    tubes: list[Tube] = []
    for case in cases:
        known = case.load()
        merge = config.merge.model_copy(update={"chains": max(len(known.truths), 1)})
        try:
            chains: tuple[Chain, ...] = detect(known.data, config.model_copy(update={"merge": merge}), mask=known.mask).chains
        except DooError:
            chains = ()
        for truth, right in zip(known.truths, right_tubes(chains, known.truths), strict=True):
            tubes.append(Tube(case.family, 1.0 if truth.seen is None else float(truth.seen.mean()), right))
    return tubes


def right_tubes(chains: Sequence[Chain], truths: Sequence[Truth]) -> list[bool]:
    """Of each of the tubes, whether the chain that follows most of it is right."""
    chains, truths = tuple(chains), tuple(truths)
    walks = [follow(chain, truths) for chain in chains]
    overlap = np.array([walk.overlap(len(truths), chain.segment_length) for walk, chain in zip(walks, chains, strict=True)])
    overlap = overlap.reshape(len(chains), len(truths))
    right = [False] * len(truths)
    for c, t in zip(*linear_sum_assignment(-overlap), strict=True):
        alone = {track.cable for track in walks[c].tracks} == {t} and not walks[c].wrong
        right[t] = alone and covered(walks[c], truths[t], t) >= COVERED and off_share(chains[c], walks[c], truths) < OFF
    return right


def format_tubes(tubes: Sequence[Tube]) -> str:
    """A line per file and one in all: how many of the tubes of which SEEN is seen are right."""
    families = {file: [tube for tube in tubes if tube.file == file] for file in dict.fromkeys(tube.file for tube in tubes)}
    wide = max(map(len, [*families, "all"]))
    lines = [f"{'':{wide}s}  tubes  seen {SEEN:.0%}  right"]
    for name, own in {**families, "all": list(tubes)}.items():
        counted = [tube.right for tube in own if tube.seen >= SEEN]
        share = f"{sum(counted) / len(counted):.1%}" if counted else "-"
        lines.append(f"{name:{wide}s}  {len(own):5d}  {len(counted):8d}  {sum(counted):5d}  {share}")
    return "\n".join(lines)
