"""The explanation of a frame: what each stage made and dropped, and the cost of each connection.

Everything is read off the records that the stages keep; no stage runs again.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..config import Config, ConfigLike, as_config
from ..geometry.curves import Curves
from ..geometry.polyline import steps
from ..links import TOO_MANY, LinkCandidate, LinkDecision
from ..pipeline import Stages, run_stages
from ..scene.frame_facts import FrameFacts
from ..segment import Segmentation
from ..segment.working_picture import enlarged_points
from ..types import Array, Chain, Cloud, Floats, Frame, Image
from ..types.display import counted, length_text, tree_text
from .doubts import doubts

SCHEMA = "doo3d/explanation/1"

_InWords = Callable[[float], str]

MAX_LISTED_PATHS = 12
"""Paths whose lengths are listed, the longest first."""


@dataclass(frozen=True)
class Choice:
    """Two chain ends that were or could have been connected, and the cost of connecting them.

    Costs are in cost units, which the weights in section `merge` of the settings define: by default 1 per mm of distance (1 per
    px in 2-D) between the ends, and more for angles and for free space on the path between them.

    Attributes
    ----------
    ends
        names of the two ends, such as ("0 end", "3 start"): index of the chain after pruning, and which of its ends.
    points
        (2, D) m (px in 2-D), positions of the two ends.
    cost
        sum of `terms`; connections above `merge.max_cost` are not made, unless `merge.chains` forces them.
    terms
        name of the term -> cost, such as "distance", "direction", "curvature", "free space", "unknown", "bare surface".
    """

    ends: tuple[str, str]
    points: Floats
    cost: float
    terms: dict[str, float]

    @staticmethod
    def of(candidate: LinkCandidate, scale: int = 1) -> Choice:
        """Return the Choice for two ends that the merge stage considered.

        candidate : the merge stage's record of the two ends. scale : that of the stages. The terms "free space", "unknown" and
        "bare surface", the costs of the path across the gap, come last in `terms`.
        """
        gap = candidate.gap_cost
        terms = {**candidate.terms, "free space": gap.free_space, "unknown": gap.unknown, "bare surface": gap.bare}
        first, second = candidate.ends
        return Choice((str(first), str(second)), enlarged_points(candidate.points, scale), sum(terms.values()), terms)

    def to_dict(self) -> dict[str, Any]:
        """Return {"ends", "points", "cost", "terms"} (the attributes) as plain values for JSON."""
        return {"ends": list(self.ends), "points": self.points.tolist(), "cost": self.cost, "terms": self.terms}


@dataclass(frozen=True)
class Merge:
    """One connection that merging made.

    Attributes
    ----------
    chosen
        the two ends that were connected.
    runner_up
        the cheapest alternative: another connection of one of these two ends; None if no other connection was allowed.
    confidence
        0 to 1, from how much the total cost of all connections would rise without this one; 0 if it would not rise.
    kept
        True if the connection is in a chain of the result, False if that chain was dropped.
    """

    chosen: Choice
    runner_up: Choice | None
    confidence: float
    kept: bool = True

    @staticmethod
    def of(decision: LinkDecision, stages: Stages) -> Merge:
        """Return the Merge for one connection that the merge stage made.

        decision : the merge stage's record of the connection. stages : the products of all stages.
        """
        runner_up = Choice.of(decision.runner_up, stages.observed.scale) if decision.runner_up else None
        place = decision.chosen.points.mean(axis=0)
        kept = decision.kept and _distance(place, stages.chains) <= _distance(place, stages.verdict.unchosen)
        return Merge(Choice.of(decision.chosen, stages.observed.scale), runner_up, decision.confidence, kept)

    def to_dict(self) -> dict[str, Any]:
        """Return {"chosen", "runner_up", "confidence", "kept"} (the attributes) as plain values for JSON.

        "runner_up" is None if there is no alternative.
        """
        runner_up = self.runner_up.to_dict() if self.runner_up else None
        return {"chosen": self.chosen.to_dict(), "runner_up": runner_up, "confidence": self.confidence, "kept": self.kept}


@dataclass(frozen=True)
class Account:
    """What one stage did, in words.

    Attributes
    ----------
    stage
        name of the stage, such as "traverse".
    made
        what the stage made, such as "2 paths: 812.3 mm, 401.0 mm".
    dropped
        what the stage dropped and why, a phrase each; empty if it dropped nothing.
    """

    stage: str
    made: str
    dropped: tuple[str, ...] = ()

    def to_dict(self) -> dict[str, Any]:
        """Return {"stage", "made", "dropped"} (the attributes) as plain values for JSON."""
        return {"stage": self.stage, "made": self.made, "dropped": list(self.dropped)}


@dataclass(frozen=True)
class Explanation:
    """Why the chains of one frame are what they are.

    Attributes
    ----------
    accounts
        what each stage made and dropped, in the order of the stages.
    merges
        the connections that merging made, the cheapest first.
    pruned
        (S, 2, D) m (px in 2-D), first and last joint of each of the S segments that pruning removed.
    """

    accounts: tuple[Account, ...]
    merges: tuple[Merge, ...]
    pruned: Floats

    def to_dict(self) -> dict[str, Any]:
        """Return the explanation as plain values for JSON.

        Keys are "schema" ("doo3d/explanation/1"), "stages" (the accounts), "merges" and "pruned" (lists of joints).
        """
        return {
            "schema": SCHEMA,
            "stages": [account.to_dict() for account in self.accounts],
            "merges": [merge.to_dict() for merge in self.merges],
            "pruned": self.pruned.tolist(),
        }


def explain(data: Frame | Cloud | Image | Array, config: ConfigLike | None = None, mask: Array | None = None) -> Explanation:
    """Detect in one frame, and return what each stage made and dropped, and what each connection of two chain ends cost.

    Parameters
    ----------
    data
        a Frame or a Cloud. With a config whose `mode` is 2d: an Image, an array (H, W, 3) uint8 RGB, or a Frame with color.
    config
        settings of the detection, as `doo3d.detect` takes them; None for the preset "default".
    mask
        the caller's own segmentation, True on the object: (H, W) bool for a Frame or an image, (N,) bool for a Cloud made of N
        points, counting those with NaN. None segments as the config says.

    Returns
    -------
    An account of each stage in words; for each two chain ends that were joined, the cost of the join and that of the best
    alternative; and the segments that pruning removed.

    Raises
    ------
    InputError : the data cannot be used.
    """
    config = as_config(config)
    return explain_stages(run_stages(data, config, mask), config)


def explain_stages(stages: Stages, config: Config) -> Explanation:
    """Return the explanation of a frame whose stages have run already; no stage runs again.

    stages : the products of all stages. config : the configuration that the stages were run with.
    """
    in_words = _lengths(stages)
    accounts = (
        _segment(stages),
        _voxelize(stages, in_words),
        Account("thin", f"{len(stages.graph.skeleton.coords)} voxels of skeleton"),
        _traverse(stages, in_words),
        _fit(stages, in_words),
        _prune(stages),
        _merge(stages, config, in_words),
        Account("fill", f"{counted(sum(len(path.joins) for path in stages.filled), 'gap')} closed"),
        _refine(stages, in_words),
        *_branches(stages),
        _confidence(stages, config),
    )
    merges = tuple(Merge.of(decision, stages) for decision in stages.merged.decisions)
    return Explanation(accounts, merges, enlarged_points(stages.pruned.removed, stages.observed.scale))


def _distance(place: Floats, chains: Sequence[Chain]) -> float:
    """Return the distance from a point (D,) to the nearest joint of any chain, m (px in 2-D); infinite without chains."""
    return min((float(np.linalg.norm(chain.joints - place, axis=1).min()) for chain in chains), default=np.inf)


def _lengths(stages: Stages) -> _InWords:
    """Return the function that says a length in words: in mm in 3-D, in px in 2-D."""
    scale, unit = (1000.0, "mm") if stages.graph.grid.coords.shape[1] == 3 else (float(stages.observed.scale), "px")
    return lambda length: f"{scale * length:.1f} {unit}"


def _segment(stages: Stages) -> Account:
    segmentation, scale = stages.observed.segmentation, stages.observed.scale
    scene = segmentation.scene
    made, unit = f"{len(scene.points)} points by the method {segmentation.method}", "points"
    if scene.mask.size:
        unit = "pixels"
        made = f"{int(scene.mask.sum())} pixels, {2 * scale * FrameFacts(scene.mask).radius():.1f} px wide; {made}"
    if scale > 1:
        made += f"; the photograph was reduced by a factor of {scale} (segment.working_width)"
    dropped = [*scene.notes, *_selection(segmentation, unit)]
    if segmentation.repaired:
        dropped.append(f"{segmentation.repaired} pixels of the mask changed, so that it ends where the colors of the image do")
    if segmentation.base is not None:
        dropped += [f"{sentence}, before the mask was extended" for sentence in _selection(segmentation.base, unit)]
    if segmentation.without_depth:
        left = segmentation.without_depth - segmentation.inpainted
        rest = f"; {segmentation.inpainted} others got the depth of their surroundings" if segmentation.inpainted else ""
        dropped.append(f"{left} pixels without depth{rest}")
    if (smoothed := segmentation.smoothed) > 0:
        dropped.append(f"the depth of {smoothed} pixels was smoothed along the strand: it is torn, or comes in waves")
    if segmentation.outliers:
        reason = "points with few neighbors, or far from the rest"
        if scene.mask.size:
            reason = "readings that too few of their neighbors agree with (segment.outlier_slope)"
        dropped.append(f"{segmentation.outliers} {reason}")
    return Account("segment", made, tuple(dropped))


def _selection(segmentation: Segmentation, unit: str) -> list[str]:
    """Return the sentences on what was removed of the selection of a method; unit : "pixels" or "points"."""
    reasons = (
        (segmentation.removed_small, "in pieces that are too small (segment.min_component)"),
        (segmentation.removed_wide, "in regions wider than the object may be (segment.max_width, segment.max_width_ratio)"),
        (segmentation.split, "between strands that touch side by side, to split them"),
    )
    selected = f"the {segmentation.selected} {unit} selected by {segmentation.method}"
    return [f"{removed} of {selected}, {reason}" for removed, reason in reasons if removed]


def _voxelize(stages: Stages, in_words: _InWords) -> Account:
    grid = stages.graph.grid
    radius = stages.scene.radius if len(grid.coords) else 0.0
    made = f"{len(grid.coords)} voxels of {in_words(grid.size)}, for a radius of {in_words(radius)}"
    unused = len(stages.scene.points) - int(grid.counts.sum())
    reason = "near the edges of strands (voxelize.core_fraction) or in components too small"
    return Account("voxelize", made, (f"{unused} points {reason}",) * (unused > 0))


def _traverse(stages: Stages, in_words: _InWords) -> Account:
    lengths = sorted((float(steps(path.points).sum()) for path in stages.graph.paths), reverse=True)
    listed = ", ".join(in_words(length) for length in lengths[:MAX_LISTED_PATHS])
    more = ", ..." if len(lengths) > MAX_LISTED_PATHS else ""
    left_out = (
        (stages.graph.traversal.spur_length, "in spurs (traverse.min_branch)"),
        (stages.graph.traversal.loop_length, "in loops round holes in the surface"),
        (stages.graph.traversal.trimmed_length, "cut off at tips, and where strands touch at junctions"),
    )
    dropped = [f"{in_words(length)} of skeleton {reason}" for length, reason in left_out if length > 0]
    return Account("traverse", f"{counted(len(lengths), 'path')}: {listed}{more}", (*dropped, *stages.graph.traversal.notes))


def _fit(stages: Stages, in_words: _InWords) -> Account:
    length = stages.scene.config.fit.length
    short = sum(float(steps(path.points).sum()) < length for path in stages.graph.paths)
    dropped = (f"{counted(short, 'path')} shorter than a segment (fit.segment_length)",) * (short > 0)
    return Account("fit", f"{_segments(stages.fitted)} of {in_words(length)}", dropped)


def _prune(stages: Stages) -> Account:
    removed = len(stages.pruned.removed)
    dropped = (f"{counted(removed, 'segment')} that overlapped one of a longer chain (prune.width)",) * (removed > 0)
    return Account("prune", _segments(stages.pruned.chains), dropped)


def _merge(stages: Stages, config: Config, in_words: _InWords) -> Account:
    merged = stages.merged
    reasons = {
        "merge.chains": f"chains wanted: {config.merge.chains} (merge.chains)",
        "merge.min_length": f"shorter than {config.merge.min_length:g} radii (merge.min_length)",
    }
    made = f"{counted(len(merged.decisions), 'connection')}, {counted(len(merged.assemblies), 'chain')}"
    short = [
        f"a chain of {in_words(each.length)}: {reasons[each.setting]}" for each in merged.dropped if each.setting != TOO_MANY
    ]
    return Account("merge", made, (*short, *merged.notes))


def _refine(stages: Stages, in_words: _InWords) -> Account:
    # chains are cut at junctions, so that their number does not say how many were dropped
    refined = (*stages.chains, *stages.verdict.unchosen)
    dropped = 0 if stages.scene.config.merge.branches else len(stages.filled) - len(refined)
    reason = "shorter than half a segment, or thin beside a longer chain (refine.min_radius_ratio)"
    made = f"{counted(len(refined), 'chain')}: {', '.join(in_words(chain.length) for chain in refined)}"
    return Account("refine", made, (f"{counted(dropped, 'chain')} {reason}",) * (dropped > 0))


def _branches(stages: Stages) -> list[Account]:
    """Return what became of the places where strands meet; nothing if branched objects were not looked for."""
    found = stages.branched
    if not stages.scene.config.merge.branches:
        return []
    junctions = [
        f"chains {', '.join(str(end.chain) for end in each.ends)} (confidence {each.confidence:.2f})" for each in found.junctions
    ]
    made = tree_text(len(found.objects), len(found.chains), len(found.junctions))
    return [Account("branches", made + (f": {'; '.join(junctions)}" if junctions else ""))]


def _confidence(stages: Stages, config: Config) -> Account:
    """Return how confident the chains are, what speaks against each, and which are left out for it."""
    values, least = [chain.confidence for chain in stages.chains], config.output.min_confidence
    low = 0 if stages.is_given else sum(value < least for value in values)
    made = "; ".join([", ".join(f"{value:.2f}" for value in values) or "no chains", *doubts(stages)])
    unchosen = [
        f"a chain of {length_text(chain.length, chain.joints.shape[1] == 2)}, confidence {chain.confidence:.2f}: "
        f"chains wanted: {config.merge.chains} (merge.chains)"
        for chain in stages.verdict.unchosen
    ]
    hidden = (f"{counted(low, 'chain')} below {least:g} (output.min_confidence)",) * (low > 0)
    return Account("confidence", made, (*unchosen, *hidden))


def _segments(chains: Curves) -> str:
    return f"{counted(len(chains), 'chain')} of {counted(len(chains.points) - len(chains), 'segment')}"
