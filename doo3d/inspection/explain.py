"""Why the chains of a frame are what they are: what each stage kept and dropped, and what each connection cost."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from ..config import Config
from ..geometry.mask import mask_radius
from ..geometry.polyline import steps
from ..pipeline import Stages
from ..stages.merge.merge import Joined, join
from ..stages.segment.methods import SEGMENTERS, resolve_method
from ..types import Array, Chain, Cloud, Floats, Frame, Image
from ..visibility import Visibility

SCHEMA = "doo3d/explanation/1"


@dataclass(frozen=True)
class Choice:
    """Two ends that are or could be joined, and what that costs.

    ends : which, such as "3 end": the pieces are numbered as pruning left them. points : (2, D) m (px in 2-D), where they are.
    cost : the sum of `terms`, name -> cost.
    """

    ends: tuple[str, str]
    points: Floats
    cost: float
    terms: dict[str, float]

    def to_dict(self) -> dict[str, Any]:
        """What the JSON holds."""
        return {"ends": list(self.ends), "points": self.points.tolist(), "cost": self.cost, "terms": self.terms}


@dataclass(frozen=True)
class Merge:
    """A connection: what was chosen, the cheapest other way to join either of its ends (None where there is no other), and how
    sure it is, 0 to 1. kept : it is in a chain of the result, and not in one that was dropped.
    """

    chosen: Choice
    runner_up: Choice | None
    confidence: float
    kept: bool = True

    def to_dict(self) -> dict[str, Any]:
        """What the JSON holds."""
        other = self.runner_up.to_dict() if self.runner_up else None
        return {"chosen": self.chosen.to_dict(), "runner_up": other, "confidence": self.confidence, "kept": self.kept}


@dataclass(frozen=True)
class Account:
    """What a stage made of what it was given, and what it dropped and why, a sentence each."""

    stage: str
    made: str
    dropped: tuple[str, ...] = ()

    def to_dict(self) -> dict[str, Any]:
        """What the JSON holds."""
        return {"stage": self.stage, "made": self.made, "dropped": list(self.dropped)}


@dataclass(frozen=True)
class Explanation:
    """accounts : of the stages, in order. merges : in the order in which they are made, the cheapest first.
    pruned : (S, 2, D), the segments that pruning took away.
    """

    accounts: tuple[Account, ...]
    merges: tuple[Merge, ...]
    pruned: Floats

    def to_dict(self) -> dict[str, Any]:
        """What the JSON holds (schema doo3d/explanation/1)."""
        return {
            "schema": SCHEMA,
            "stages": [account.to_dict() for account in self.accounts],
            "merges": [merge.to_dict() for merge in self.merges],
            "pruned": self.pruned.tolist(),
        }


def explain(data: Frame | Cloud | Image, stages: Stages, config: Config, mask: Array | None = None) -> Explanation:
    """What became of a frame, from what `pipeline.run_with_stages` made of it with this config and mask."""
    pruned = pruned_segments(stages.fitted, stages.pruned)
    merges = _merges(stages, config)
    told = _told(data, config, mask) if config.extend_mask.max_length == 0 else None
    return Explanation((_segmented(stages, told), *_accounts(stages, config, pruned, merges)), merges, pruned)


def _told(data: Frame | Cloud | Image, config: Config, mask: Array | None) -> int:
    """Pixels or points that the method took, before anything was dropped."""
    if mask is None:
        given = isinstance(data, Cloud) and data.segmented
        mask = SEGMENTERS["everything" if given else resolve_method(data, config.segment)](data, config.segment, config.seed)
    return int(np.count_nonzero(mask))


def pruned_segments(before: list[Chain], after: list[Chain]) -> Floats:
    """The segments (S, 2, D) of the chains before that are in none of those after."""
    left = {pair.tobytes() for chain in after for pair in _segments(chain.joints)}
    gone = [pair for chain in before for pair in _segments(chain.joints) if pair.tobytes() not in left]
    dim = before[0].joints.shape[1] if before else 3
    return np.array(gone) if gone else np.zeros((0, 2, dim))


def _segments(joints: Floats) -> Floats:
    return np.ascontiguousarray(np.stack((joints[:-1], joints[1:]), axis=1))


def _merges(stages: Stages, config: Config) -> tuple[Merge, ...]:
    if not stages.pruned:
        return ()
    visibility = Visibility.of(stages.context.foreground, config.visibility, stages.context.grid.radius)
    joined = join(stages.pruned, config.merge, stages.context.grid.radius, config.fill, visibility)
    kept = _in_result(stages)
    order = sorted(range(len(joined.links)), key=lambda i: joined.links[i][2])
    return tuple(
        Merge(_choice(joined, (a, b)), _runner_up(joined, (a, b)), joined.confidence[i], bool(kept[a // 2]))
        for i in order
        for a, b, _ in [joined.links[i]]
    )


def _choice(joined: Joined, pair: tuple[int, int]) -> Choice:
    a, b = min(pair), max(pair)
    free, unknown = joined.ways([(a, b)])[0]
    terms = {name: float(term[a, b]) for name, term in joined.terms.items()}
    terms |= {"free space": float(free), "unknown": float(unknown)}
    ends = tuple(f"{end // 2} {'end' if end % 2 else 'start'}" for end in (a, b))
    return Choice((ends[0], ends[1]), joined.ends.points[[a, b]], sum(terms.values()), terms)


def _runner_up(joined: Joined, pair: tuple[int, int]) -> Choice | None:
    """The cheapest other pair that has one of the two ends, by what the straight ways cost."""
    costs = np.minimum(joined.others, joined.others.T)
    costs[pair[0], pair[1]] = costs[pair[1], pair[0]] = np.inf
    own = costs[list(pair)]
    at = int(np.argmin(own))
    return _choice(joined, (pair[at // len(costs)], at % len(costs))) if np.isfinite(own.flat[at]) else None


def _in_result(stages: Stages) -> Array:
    """Which of the pruned chains are in an assembly that merging kept: (C,) bool."""
    kept = {_key(piece) for assembly in stages.merged for piece in assembly.pieces}
    return np.array([_key(chain.joints) in kept for chain in stages.pruned], dtype=bool)


def _key(joints: Floats) -> bytes:
    """The same for a chain and for it reversed."""
    return min(np.ascontiguousarray(joints).tobytes(), np.ascontiguousarray(joints[::-1]).tobytes())


def _segmented(stages: Stages, told: int | None) -> Account:
    """Of the segmentation; told : pixels or points that the method took, where that is known."""
    foreground = stages.context.foreground
    made, dropped, left = f"{len(foreground.points)} points", list(foreground.notes), len(foreground.points)
    if foreground.mask is not None:
        left = int(foreground.mask.sum())
        made = f"{left} pixels, {2 * mask_radius(foreground.mask):.1f} px wide; {made}"
    if told is not None and told > left:
        ways = "specks, or wider than the object may be" if foreground.mask is not None else "points that stand alone"
        dropped.append(
            f"{told - left} of {told} taken at first: {ways} (segment.min_component, max_width, max_ratio, cloud_support)"
        )
    if foreground.mask is not None and foreground.depth is not None and foreground.pixels is not None:
        held = np.zeros_like(foreground.mask)
        held[foreground.pixels[:, 1], foreground.pixels[:, 0]] = True
        if silent := int((foreground.mask & (foreground.depth <= 0)).sum()):
            bridged = int((held & (foreground.depth <= 0)).sum())
            dropped.append(
                f"{silent - bridged} of {silent} pixels without depth; the others got that of their surroundings (holes)"
            )
        if flying := int((foreground.mask & (foreground.depth > 0) & ~held).sum()):
            dropped.append(f"{flying} readings that agree with too few of their neighbours (segment.edge_support)")
    return Account("segment", made, tuple(dropped))


def _accounts(stages: Stages, config: Config, pruned: Floats, merges: tuple[Merge, ...]) -> list[Account]:
    unit = "mm" if stages.context.grid.coords.shape[1] == 3 else "px"
    scale = 1000.0 if unit == "mm" else 1.0
    grid = stages.context.grid

    def said(length: float) -> str:
        return f"{scale * length:.1f} {unit}"

    least = config.fit.segment_length
    rest = len(stages.context.foreground.points) - int(grid.counts.sum())
    lengths = [float(steps(path.points).sum()) for path in stages.paths]
    short = sum(length < least for length in lengths)
    cut = _off_paths(stages)
    lone = [chain for chain, kept in zip(stages.pruned, _in_result(stages), strict=True) if not kept] if stages.pruned else []
    gone = len(stages.filled) - len(stages.chains)
    last = (
        f"chains wanted: {config.merge.chains} (merge.chains)"
        if config.merge.chains is not None
        else f"shorter than {config.merge.min_length:g} radii (merge.min_length)"
    )
    return [
        Account(
            "voxelize",
            f"{len(grid.coords)} voxels of {said(grid.size)}, for a radius of {said(grid.radius)}",
            (f"{rest} points at the rim of strands (voxelize.core) or in pieces too small (voxelize.min_component)",)
            * (rest > 0),
        ),
        Account("thin", f"{len(stages.skeleton.coords)} voxels of skeleton"),
        Account(
            "traverse",
            f"{_counted(len(lengths), 'path')}: {', '.join(said(length) for length in sorted(lengths, reverse=True)[:12])}"
            f"{', ...' if len(lengths) > 12 else ''}",
            (f"{cut} voxels of skeleton: spurs (traverse.min_branch), and where strands touch at junctions (separation)",)
            * (cut > 0),
        ),
        Account(
            "fit",
            f"{_laid(stages.fitted)} of {said(least)}",
            (f"{_counted(short, 'path')} shorter than a segment (fit.segment_length)",) * (short > 0),
        ),
        Account(
            "prune",
            _laid(stages.pruned),
            (f"{len(pruned)} segments that overlapped one of a longer chain (prune.width)",) * (len(pruned) > 0),
        ),
        Account(
            "merge",
            f"{_counted(len(merges), 'connection')}, {_counted(len(stages.merged), 'chain')}",
            tuple(f"a chain of {said(chain.length)}: {last}" for chain in lone),
        ),
        Account("fill", f"{_counted(sum(len(path.joins) for path in stages.filled), 'gap')} closed"),
        Account(
            "refine",
            f"{_counted(len(stages.chains), 'chain')}: {', '.join(said(chain.length) for chain in stages.chains)}",
            (f"{_counted(gone, 'chain')} shorter than half a segment, or thin beside the thickest (refine.min_width)",)
            * (gone > 0),
        ),
    ]


def _counted(count: int, what: str) -> str:
    return f"{count} {what}{'s' * (count != 1)}"


def _laid(chains: Sequence[Chain]) -> str:
    return f"{_counted(len(chains), 'chain')} of {_counted(sum(len(chain.joints) - 1 for chain in chains), 'segment')}"


def _off_paths(stages: Stages) -> int:
    """Voxels of the skeleton that no path passes within two voxels."""
    points = stages.skeleton.points
    if not len(points) or not stages.paths:
        return len(points)
    tree = cKDTree(np.concatenate([path.points for path in stages.paths]))
    return int((tree.query(points)[0] > 2 * stages.context.voxel).sum())
