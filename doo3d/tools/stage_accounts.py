"""Describe each stage of a detection in words: what it made and what it dropped."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from ..config import Config
from ..geometry.curves import Curves
from ..geometry.polyline import steps
from ..links import TOO_MANY
from ..pipeline import Stages
from ..scene.frame_facts import FrameFacts
from ..segment import Segmentation
from ..types.display import counted, length_text, tree_text
from .doubts import doubts

_InWords = Callable[[float], str]

MAX_LISTED_PATHS = 12
"""Greatest number of paths whose lengths are listed, longest first."""


@dataclass(frozen=True)
class Account:
    """Description of one stage in words: what it made and what it dropped.

    Attributes
    ----------
    stage
        name of the stage, such as "traverse".
    made
        what the stage made, such as "2 paths: 812.3 mm, 401.0 mm".
    dropped
        what the stage dropped and why, one phrase each; empty if it dropped nothing.
    """

    stage: str
    made: str
    dropped: tuple[str, ...] = ()

    def to_dict(self) -> dict[str, Any]:
        """Return {"stage", "made", "dropped"} (the attributes) as plain values for JSON."""
        return {"stage": self.stage, "made": self.made, "dropped": list(self.dropped)}


def accounts_of(stages: Stages, config: Config) -> tuple[Account, ...]:
    """Return the account of each stage, in the order of the stages.

    stages : the products of all stages. config : the configuration that the stages were run with.
    """
    in_words = _lengths(stages)
    return (
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


def _lengths(stages: Stages) -> _InWords:
    """Return the function that formats a length as text: in mm in 3-D, in px in 2-D."""
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
    """Return sentences about the pixels or points that were removed from a method's selection; unit : "pixels" or "points"."""
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
    """Return the account of the meetings of strands; empty if the detection did not look for branched objects."""
    found = stages.branched
    if not stages.scene.config.merge.branches:
        return []
    junctions = [
        f"chains {', '.join(str(end.chain) for end in each.ends)} (confidence {each.confidence:.2f})" for each in found.junctions
    ]
    made = tree_text(len(found.objects), len(found.chains), len(found.junctions))
    return [Account("branches", made + (f": {'; '.join(junctions)}" if junctions else ""))]


def _confidence(stages: Stages, config: Config) -> Account:
    """Return the account of the confidence: of each chain, the evidence against it, and the chains left out."""
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
