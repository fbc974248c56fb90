"""Measure the detection with camera rigs: `python -m doo3d.evaluation.benchmark.rigs`.

With `--pairs FOLDER --cameras FILE` it measures real stereo pairs instead of rendered ones.
"""

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np

from ...camera.depth_cameras import load_best
from ...camera.open_rig import PairLoader, open_rig
from ...camera.stereo_depth import triangulate
from ...config import Config, load_config
from ...inputs import FrameData
from ...inputs.bag.undistortion import Lens
from ...inputs.rig.pair_images import PairImages
from ...inputs.rig.stereo_pair import RectifiedPair, StereoPair
from ...kernels import medial_axis
from ...pipeline import detect
from ...types import Bools, Chain, Detection, Floats
from ..metrics.record import Record, added, amount, number
from ..metrics.score import score
from ..rendering.renderer import render
from ..scenes.model import Scene, corners, cuboid, moved_scene
from ..scenes.registry import make_scene
from .fused_views import RenderedView, circle_poses, fused_score, rendered_views, seen_by_any
from .run import print_lines
from .tables import markdown_table

FAMILIES = ("open", "crossing", "crossings", "several", "air", "occluded", "hairpin", "knots", "tangle")
"""Families of the rendered scenes."""

PAIR_SIZE, RIG_SIZE = (1280, 720), (640, 480)
"""Width and height of the images in px: of a stereo pair without depth, and of a depth camera."""

BASELINE = 0.06
"""Distance in m from the left to the right camera of a pair."""

TILT_DEGREES = 20.0
"""Angle in degrees between the scene's own camera and each of the two depth cameras, one to each side."""

BLOCK_SIZE, BLOCK_PLACE = (0.05, 0.05, 0.02), 0.35
"""Block that hides the first cable's middle from one camera: edges in m, position as a fraction of the line to the camera."""

NEAR_PX = 5.0
"""Distance in px from the center line of a drawn chain within which a mask pixel is covered, whatever the chain's width."""


def pair_score(scene: Scene, config: Config, masks: int) -> Record:
    """Run the detection in a rendered stereo pair without depth, and return the score.

    masks : 1 for a mask of the left view only, 2 for masks of both.
    """
    shift, camera = np.array([BASELINE, 0.0, 0.0]), scene.camera
    aside = moved_scene(scene, lambda points: points - shift, lambda vector: vector, f"{scene.name}/right")
    left, right = (render(each, "none") for each in (scene, aside))
    pair = StereoPair(Lens(camera), Lens(camera), tuple(np.eye(3).ravel().tolist()), tuple((-shift).tolist()), scene.name)
    images = PairImages(np.asarray(left.frame.color), np.asarray(right.frame.color), left.mask, right.mask if masks > 1 else None)
    loaded = triangulate(images, pair.rectified(), config)
    return score(_detected(loaded, config).chains, left.truths, camera=camera)


def hidden_views(scene: Scene, hidden: int) -> tuple[Scene, list[RenderedView]]:
    """Return a scene with a block that hides the first cable's middle from one of two depth cameras, and both views of it."""
    poses = circle_poses(scene, 2, TILT_DEGREES)
    axis = scene.cables[0].axis
    middle, eye = axis[len(axis) // 2], poses[hidden][:3, 3]
    block = cuboid(middle + BLOCK_PLACE * (eye - middle) + corners(BLOCK_SIZE))
    blocked = replace(scene, occluders=(*scene.occluders, block))
    return blocked, rendered_views(blocked, poses, f"{scene.name}/{hidden}")


def rig_score(scene: Scene, views: Sequence[RenderedView], config: Config) -> Record:
    """Run the detection in the views of a rig of depth cameras, and return the score.

    A part of a cable counts as seen if any camera sees it.
    """
    loaded = load_best(views[0].ref(), [(view.ref(), view.pose) for view in views], config, None)
    truths = [replace(cable, seen=seen) for cable, seen in zip(scene.cables, seen_by_any(views), strict=True)]
    return score(_detected(loaded, config).chains, truths)


def _detected(loaded: FrameData, config: Config) -> Detection:
    return detect(loaded.data, config, loaded.mask_for(config), loaded.base_pose)


def drawn_into(chains: Sequence[Chain], pair: RectifiedPair, side: int, mask: Bools) -> tuple[float, float, float]:
    """Draw chains into the left (side 0) or right (side 1) camera's own image, and compare them with the object's mask there.

    Returns
    -------
    Fraction of the mask that the chains cover at their own width; fraction within 5 px of their center lines; median distance in
    px of the drawn center lines from the center line of the mask.
    """
    line, wide = (np.zeros(mask.shape, dtype=np.uint8) for _ in range(2))
    for chain in chains:
        points = [np.rint(16 * pair.pixels(chain.joints, side)).astype(np.int32)]
        width = 2 * chain.radius * pair.camera.fx / float(np.median(chain.joints[:, 2]))
        cv2.polylines(line, points, chain.closed, 255, 1, cv2.LINE_8, 4)
        cv2.polylines(wide, points, chain.closed, 255, max(1, round(width)), cv2.LINE_8, 4)
    near = cv2.distanceTransform(255 - line, cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    middle = np.full(mask.shape, 255, dtype=np.uint8)
    rows, columns, _ = medial_axis(mask)
    middle[rows, columns] = 0
    away = cv2.distanceTransform(middle, cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    distance = float(np.median(away[line > 0])) if line.any() else float("inf")
    return float((wide[mask] > 0).mean()), float((near[mask] <= NEAR_PX).mean()), distance


def real_pairs(folder: Path, cameras: Path, masks: Path | None, left_only: bool) -> Iterator[str]:
    """Yield the lines of a Markdown table: agreement of each pair's chains with the masks of both views.

    The chains come from the left view and its stereo depth.
    """
    config = load_config("default")
    yield "| frame | chains | left: covered | within 5 px | distance, px | right: covered | within 5 px | distance, px |"
    yield "|---|---|---|---|---|---|---|---|"
    rows: list[Floats] = []
    for frame in open_rig(folder, cameras, config, masks):
        assert isinstance(frame.loader, PairLoader)
        images, pair = frame.loader.images(), frame.loader.pair.rectified()
        given = replace(images, right_mask=None) if left_only else images
        chains = _detected(triangulate(given, pair, config), config).chains
        masks_of = (images.left_mask, images.right_mask)
        found = [drawn_into(chains, pair, k, mask) for k, mask in enumerate(masks_of) if mask is not None]
        rows.append(np.concatenate(found))
        cells = " | ".join(f"{covered:.1%} | {near:.1%} | {distance:.1f}" for covered, near, distance in found)
        yield f"| {frame.name} | {len(chains)} | {cells} |"
    worst, median = np.min(rows, axis=0), np.median(rows, axis=0)
    ends = [f"{worst[k]:.1%} | {worst[k + 1]:.1%} | {median[k + 2]:.1f}" for k in (0, 3)]
    yield f"| least; median distance | | {' | '.join(ends)} |"


PAIR_COLUMNS = (
    amount(("frames", ""), 0, "frames", len),
    amount(("correct", ""), 0, "correct", added("correct")),
    amount(("right in", "the image"), 0, "image_correct", added("image_correct")),
    number(("RMS seen,", "mm, median"), 0, "rms_seen", 1),
)
"""Columns of the table of rendered stereo pairs; the table of depth cameras has only the first two."""


def rendered(seeds: int) -> Iterator[str]:
    """Yield the lines of two Markdown tables: rendered stereo pairs, and two depth cameras, each blocked in turn."""
    config, pairs, rigs = load_config("default"), list[Record](), list[Record]()
    for family, seed in itertools.product(FAMILIES, range(1, seeds + 1)):
        for masks, name in ((2, "masks of both views"), (1, "mask of the left view")):
            pairs.append(Record(pair_score(make_scene(family, seed, PAIR_SIZE), config, masks) | {"variant": name}))
        for hidden in (0, 1):
            blocked, views = hidden_views(make_scene(family, seed, RIG_SIZE), hidden)
            for name, k in (("the camera with the block", hidden), ("the other camera", 1 - hidden)):
                rigs.append(Record(fused_score(blocked, [views[k]], config) | {"variant": name}))
            rigs.append(Record(rig_score(blocked, views, config) | {"variant": "both"}))
    yield from markdown_table("pairs", pairs, PAIR_COLUMNS)
    yield ""
    yield from markdown_table("two depth cameras", rigs, PAIR_COLUMNS[:2])


def main(
    seeds: int = 3, pairs: Path | None = None, cameras: Path | None = None, masks: Path | None = None, left_only: bool = False
) -> Iterator[str]:
    """Measure rigs of cameras, and yield the lines of tables.

    seeds : number of rendered scenes of each family. pairs : folder of real stereo pairs with masks, which are measured instead;
    cameras : their rig file or calibration; masks : folder of their masks, if these are elsewhere; left_only : use the masks of
    the left view only.
    """
    if pairs is None or cameras is None:
        return rendered(seeds)
    return real_pairs(pairs, cameras, masks, left_only)


if __name__ == "__main__":
    print_lines(main)
