"""Evaluate the detection of branched objects on rendered harnesses."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any

from ...config import Config
from ...pipeline import detect
from ..metrics.trees import TreeScore, score_trees, total
from ..rendering.renderer import render
from ..scenes.registry import MOTION, TREES, make_scene


@dataclass(frozen=True)
class TreeRow:
    """The score of one rendered scene: its family, its name and the counts."""

    family: str
    name: str
    score: TreeScore


def tree_families(motion: Sequence[Path]) -> list[str]:
    """Return the names of all families of branched objects, and of one for each file of motion capture."""
    return [*TREES, *(f"{MOTION}:{path}" for path in motion)]


def evaluate_trees(
    families: Iterable[str],
    seeds: Iterable[int],
    config: Config,
    sensor: str = "d435",
    size: tuple[int, int] = (1280, 720),
    given_mask: bool = True,
) -> Iterable[TreeRow]:
    """Render scenes of branched objects, detect in them, and yield the score of each.

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
    given_mask
        whether the detection gets the true mask; the config decides otherwise.
    """
    seeds = list(seeds)
    for family in families:
        for scene in map(partial(make_scene, family, size=size), seeds):
            rendered = render(scene, sensor)
            detection = detect(rendered.frame, config, rendered.mask if given_mask else None)
            yield TreeRow(family.rpartition("/")[2], scene.name, score_trees(detection, scene))


def tree_table(rows: Sequence[TreeRow]) -> str:
    """Return the scores as text: a line per family, and one for all."""
    lines = [f"{'family':<16}{'objects right':>15}{'spurious':>10}{'junctions':>12}{'false':>7}{'taken':>10}{'told apart':>12}"]
    groups = {family: [row.score for row in rows if row.family == family] for family in dict.fromkeys(row.family for row in rows)}
    for name, scores in (*groups.items(), *([("all", [row.score for row in rows])] if len(groups) > 1 else [])):
        each = total(scores)
        right, found, taken = f"{each.right}/{each.objects}", f"{each.found}/{each.junctions}", f"{each.taken}/{each.crossings}"
        lines.append(f"{name:<16}{right:>15}{each.spurious:>10}{found:>12}{each.false:>7}{taken:>10}{each.told_apart:>12.1%}")
    lines.append("junctions: found of all; false: at no junction; taken: crossings taken for junctions, of all crossings")
    return "\n".join(lines)


def tree_document(rows: Sequence[TreeRow]) -> dict[str, Any]:
    """Return the scores as plain numbers, ready for JSON: "all", and each frame with its family and counts."""
    frames = [{"family": row.family, "name": row.name, **asdict(row.score)} for row in rows]
    return {"all": asdict(total(row.score for row in rows)), "frames": frames}
