"""Evaluate the detection of branched objects on rendered harnesses."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any, Literal

import numpy as np

from ...config import Config
from ...errors import DooError
from ...pipeline import detect
from ...types import Detection
from ..metrics.trees import TreeScore, score_trees, total
from ..rendering.ragged_mask import ragged_mask
from ..rendering.renderer import render
from ..scenes.model import Scene
from ..scenes.registry import MOTION, TREES, family_rng, make_scene

SCHEMA = "doo3d/tree-evaluation/1"

Masking = Literal["given", "ragged", "auto"]
"""The true mask, the true mask spoiled as by `ragged_mask`, or none, so that the config decides."""


@dataclass(frozen=True)
class TreeRow:
    """The result for one rendered scene.

    Attributes
    ----------
    family
        name of the family of scenes.
    name
        name of the scene.
    score
        the counts.
    seconds
        duration of the detection, s; NaN if unknown.
    error, code
        message and machine-readable code of the error that ended the detection; None if there was none.
    detection
        what was found; None if it is not at hand.
    scene
        builds the scene once more; None if that is not at hand.
    sensor
        the simulated depth camera.
    """

    family: str
    name: str
    score: TreeScore
    seconds: float = float("nan")
    error: str | None = None
    code: str | None = None
    detection: Detection | None = None
    scene: Callable[[], Scene] | None = None
    sensor: str = "d435"


def tree_families(motion: Sequence[Path]) -> list[str]:
    """Return the names of all families of branched objects, and of one for each file of motion capture."""
    return [*TREES, *(f"{MOTION}:{path}" for path in motion)]


def evaluate_trees(
    families: Iterable[str],
    seeds: Iterable[int],
    config: Config,
    sensor: str = "d435",
    size: tuple[int, int] = (1280, 720),
    mask: Masking = "given",
) -> Iterator[TreeRow]:
    """Render scenes of branched objects, detect in them, and yield the score of each.

    If the detection fails, the scene is scored without chains and its row holds the error.

    Parameters
    ----------
    families
        names as `make_scene` takes them.
    seeds
        integers, 0 or more; one scene of each family for each seed.
    config
        the settings, with `merge.branches`.
    sensor
        simulated depth camera.
    size
        (width, height) px of the image.
    mask
        the mask that the detection gets; the same ragged mask for every call.

    Raises
    ------
    ValueError : there is no such family.
    RuntimeError : no scene of a family fits an image of this size.
    InputError : a file of motion capture cannot be read.
    """
    seeds = list(seeds)
    for family in families:
        name = family.rpartition("/")[2]
        for seed in seeds:
            build = partial(make_scene, family, seed, size)
            scene = build()
            rendered = render(scene, sensor)
            given = rendered.mask if mask != "auto" else None
            if given is not None and mask == "ragged":
                given = ragged_mask(given, family_rng(f"{scene.name}/ragged", 0))
            error = code = None
            start = time.perf_counter()
            try:
                detection = detect(rendered.frame, config, given)
            except DooError as failure:
                detection, error, code = Detection(()), str(failure), failure.code
            seconds = time.perf_counter() - start
            yield TreeRow(name, scene.name, score_trees(detection, scene), seconds, error, code, detection, build, sensor)


def worst_trees(rows: Sequence[TreeRow], count: int) -> list[TreeRow]:
    """Return the rows of each family with the most faults, `count` of each, family by family."""
    return [row for family in _by_family(rows).values() for row in sorted(family, key=lambda row: -row.score.faults)[:count]]


def tree_table(rows: Sequence[TreeRow]) -> str:
    """Return the scores as text: a line per family, and one for all.

    The columns are:

    - objects right: of all true objects;
    - spurious: detected objects that are none of the right ones;
    - junctions found: of all true junctions;
    - false: detected junctions at no true one;
    - crossings found: crossings at which a crossing and no junction was detected, of all crossings;
    - taken: crossings at which a junction was detected;
    - told apart: junctions and crossings found, of all;
    - ms: duration of the detection, median over scenes, if known.
    """
    titles = ("objects right", "spurious", "junctions found", "false", "crossings found", "taken", "told apart", "ms")
    lines = ["".join([f"{'family':<23}", *(f"{title:>{len(title) + 3}}" for title in titles)])]
    groups = _by_family(rows)
    for name, members in (*groups.items(), *([("all", list(rows))] if len(groups) > 1 else [])):
        each = total(row.score for row in members)
        seconds = [row.seconds for row in members if np.isfinite(row.seconds)]
        cells = (
            f"{_share(each.right, each.objects)}",
            str(each.spurious),
            f"{_share(each.found, each.junctions)}",
            str(each.false),
            f"{each.crossed}/{each.crossings}",
            str(each.taken),
            f"{100 * each.told_apart:.1f} %" if each.junctions + each.crossings else "",
            f"{1000 * float(np.median(seconds)):.0f}" if seconds else "",
        )
        lines.append("".join([f"{name:<23}", *(f"{cell:>{len(title) + 3}}" for title, cell in zip(titles, cells, strict=True))]))
    failed = sum(row.error is not None for row in rows)
    return "\n".join([*lines, *([f"{failed} of {len(rows)} scenes failed"] if failed else [])])


def tree_document(rows: Sequence[TreeRow], settings: Mapping[str, Any] | None = None) -> dict[str, Any]:
    """Return the scores as plain numbers, ready for JSON.

    The keys are schema, settings, "all" and "families" (sums of the counts, with the share told apart), and "frames" (for each
    scene family, name, counts, ms, error and code).
    """
    frames = [
        {
            "family": row.family,
            "name": row.name,
            **asdict(row.score),
            "correct": row.score.correct,
            "ms": round(1000 * row.seconds, 1) if np.isfinite(row.seconds) else None,
            "error": row.error,
            "code": row.code,
        }
        for row in rows
    ]
    families = {name: _sums(members) for name, members in _by_family(rows).items()}
    return {"schema": SCHEMA, "settings": dict(settings or {}), "all": _sums(rows), "families": families, "frames": frames}


def _by_family(rows: Sequence[TreeRow]) -> dict[str, list[TreeRow]]:
    groups: dict[str, list[TreeRow]] = {}
    for row in rows:
        groups.setdefault(row.family, []).append(row)
    return groups


def _sums(rows: Sequence[TreeRow]) -> dict[str, Any]:
    each = total(row.score for row in rows)
    return {"scenes": len(rows), **asdict(each), "told_apart": round(each.told_apart, 4)}


def _share(part: int, whole: int) -> str:
    return f"{part}/{whole}" + (f" {100 * part / whole:.0f} %" if whole else "")
