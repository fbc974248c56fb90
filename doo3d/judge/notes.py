"""Notes on a frame in which nothing was found."""

from collections.abc import Sequence

from ..scene.scene import Scene

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

TUNED = {"colors": "; doo3d tune proposes colour ranges and shows them", "mask": ", or see with doo3d tune what the mask takes"}
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
