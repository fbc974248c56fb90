"""Notes on a frame in which nothing was found, or a coil."""

from collections.abc import Sequence

from ..geometry.polyline import net_turns
from ..scene.scene import Scene
from ..types import Chain

HINTS = {
    "segment": "widen the segmentation{colors}",
    "voxelize": "the pieces are smaller than 12 voxels: lower voxelize.size{mask}",
    "traverse": "lower traverse.min_branch; doo3d explain says what was dropped",
    "fit": "the object is shorter than a segment: {length}",
    "prune": "lower prune.width",
    "merge": "lower merge.min_length; doo3d explain says what was dropped",
    "refine": "{length}",
}
"""Stage -> what to try where nothing is left after it. `doo3d tune` proposes settings for images only."""

TUNED = {"colors": "; doo3d tune proposes color ranges and shows them", "mask": ", or see with doo3d tune what the mask takes"}
LENGTH, PROPOSED = "lower fit.segment_length", "; doo3d tune proposes one"


def lost_notes(left: Sequence[int], scene: Scene) -> tuple[str, ...]:
    """Return the note that says after which stage nothing was left, and what to try; none where chains are left.

    left : number of products of each stage of HINTS, of `refine` the chains. scene : what was captured.
    """
    has_image = scene.mask.size > 0
    hints = {name: text * has_image for name, text in TUNED.items()} | {"length": LENGTH + PROPOSED * has_image}
    for (stage, hint), count in zip(HINTS.items(), left, strict=True):
        if not count:
            what = "what is left is shorter than half a segment" if stage == "refine" else "nothing is left after this stage"
            sign = ":" if stage == "refine" else ";"
            return (f"{stage}: {what}{sign} {hint.format(**hints)}",)
    return ()


COIL = "coil"
"""First word of the note on a coil, and the word at the coil in the picture."""

COIL_TURNS, COIL_SHARE = 1.5, 0.3
"""Least number of net turns of a chain, and share of its joints where strands lie side by side, of a coil. Knots and tangles turn
as much, bundles lie side by side as much, none does both: `docs/measure_coils.py` counts 0 of 372 frames of other families."""


def coil_notes(chains: Sequence[Chain], scene: Scene) -> tuple[str, ...]:
    """Return the note on the chain that turns the most among those that are coils; none without a coil."""
    turns = [net_turns(chain.joints) for chain in chains if scene.share_side_by_side(chain.joints) >= COIL_SHARE]
    if max(turns, default=0.0) < COIL_TURNS:
        return ()
    return (
        f"{COIL}: a chain makes {max(turns):.1f} turns that touch or overlap, the order of its turns is not certain; "
        "spread the turns apart, so that each of them is seen",
    )
