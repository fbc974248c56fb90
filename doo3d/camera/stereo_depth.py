"""Triangulate the strands of a stereo pair, as a frame with depth on its strands.

The 3-D method continues from there as from any RGB-D frame.
"""

import numpy as np
from scipy.spatial import cKDTree

from ..config import Config, load_config
from ..errors import InputError
from ..inputs import FrameData
from ..inputs.rig.pair_images import PairImages
from ..inputs.rig.stereo_pair import RectifiedPair
from ..pipeline import Stages, run_stages
from ..segment.working_picture import enlarged_chain, enlarged_mask
from ..types import Array, Bools, Floats, Frame, Image
from .strand_matching import MatchedStrand, match_strands
from .strand_profiles import SPACING_PX

MIN_SEEN = 0.5
"""Smallest fraction of samples whose profile is found in the right image: below it, the images do not match."""

EDGE_PX = 1.0
"""Distance in px beyond the radius of a strand within which pixels of the mask belong to it: masks are drawn wider than
strands."""

SHARED_SETTINGS = {"method", "ranges", "onnx", "min_component", "equal_widths", "hues"}
"""Settings of the segmentation with the same meaning in an image: they have no unit of length, or are in pixels."""

NEIGHBORS, APART_RADII = 16, 4.0
"""Number of nearest samples that are compared for a pixel, and distance along a strand, in radii, beyond which a sample is of
another stretch."""


def triangulate(images: PairImages, pair: RectifiedPair, config: Config) -> FrameData:
    """Return the rectified left image of a stereo pair with the depth of its strands.

    The strands are found in the left image by the 2-D method (preset `image`, with the segmentation, the number of chains and
    the branches of the settings), matched with the right one, and triangulated. Each pixel of the mask gets the depth of the
    front of its strand, a cylinder of the width in the image. Pixels next to the strands have no depth, nor have stretches
    that are hidden in the right image.

    Parameters
    ----------
    images
        both images as the cameras recorded them, and their masks.
    pair
        the calibration.
    config
        the settings of the 3-D method.

    Raises
    ------
    InputError : an image has another size than its camera, the config is for images, no strand is found in the
    left image, or too
        little of them in the right one.
    """
    left, right = pair.images(images.left, images.right)
    masks = [None if mask is None else pair.mask(mask, side) for side, mask in enumerate((images.left_mask, images.right_mask))]
    flat = _image_config(config)
    stages = run_stages(Image(left, images.name), flat, masks[0] if config.segment.method in ("auto", "mask") else None)
    if not stages.chains:
        reason = " ".join(stages.observed.segmentation.scene.notes) or "give masks, or color ranges (segment.ranges)"
        raise InputError(f"{images.name}: no strand is found in the left image: {reason}", code="object-missing")
    chains = [enlarged_chain(chain, stages.observed.scale) for chain in stages.chains]
    strands, _ = match_strands(
        [chain.joints for chain in chains],
        [chain.radii for chain in chains],
        left.astype(np.float32),
        right.astype(np.float32),
        pair.camera.fx,
        masks[1],
    )
    seen = np.concatenate([strand.known for strand in strands])
    if seen.mean() < MIN_SEEN:
        share = f"the right image shows {seen.mean():.0%} of the strands that were found in the left one"
        question = "do the images belong together, and to this calibration?"
        raise InputError(f"{images.name}: {share}: {question}", code="pair-unmatched")
    mask = _mask(stages, left.shape[:2])
    depth = _depth(strands, mask, pair)
    return FrameData(Frame(left, depth, pair.camera, images.name), mask)


def _image_config(config: Config) -> Config:
    """Return the preset `image` with the settings that describe the object."""
    if config.segment.method in ("background", "plane"):
        sentence = f"segment.method={config.segment.method} needs depth, or the view of one camera"
        raise InputError(f"{sentence}: give masks of a stereo pair, or a method for images", code="method-needs-depth")
    shared = {
        f"segment.{key}": value for key, value in config.segment.model_dump(include=SHARED_SETTINGS, exclude_unset=True).items()
    }
    return load_config("image", {**shared, "merge.chains": config.merge.chains, "seed": config.seed})


def _mask(stages: Stages, shape: tuple[int, ...]) -> Bools:
    """Return the mask (H, W) of the strands at full resolution."""
    mask = stages.observed.segmentation.scene.mask
    return enlarged_mask(mask, stages.observed.scale, shape)


def _depth(strands: list[MatchedStrand], mask: Bools, pair: RectifiedPair) -> Array:
    """Return the depth (H, W) float32 m of the front of strands; 0 off the mask."""
    names = ("points", "normals", "radius", "disparity", "known")
    points, normals, radius, disparity, known = (np.concatenate([getattr(each, name) for each in strands]) for name in names)
    pixels = np.argwhere(mask)[:, ::-1]
    distance, near = cKDTree(points).query(pixels, k=min(NEIGHBORS, len(points)))
    within = distance <= radius[near] + EDGE_PX
    # where two stretches cross: of the nearest samples of both, the one nearer to the camera
    apart = np.abs(near - near[:, :1]) > APART_RADII * radius[near] / SPACING_PX
    other = (within & apart).argmax(axis=1)
    rows = np.arange(len(pixels))
    over = within[rows, other] & apart[rows, other] & (disparity[near[rows, other]] > disparity[near[:, 0]])
    sample = near[rows, np.where(over, other, 0)]
    aside = np.einsum("ij,ij->i", pixels - points[sample], normals[sample])
    axis = pair.camera.fx * pair.pair.baseline / np.maximum(disparity[sample], 1.0)
    front: Floats = np.sqrt(np.maximum(radius[sample] ** 2 - aside**2, 0.0)) * axis / pair.camera.fx
    depth = np.zeros(mask.shape, dtype=np.float32)
    depth[pixels[:, 1], pixels[:, 0]] = np.where(within[:, 0] & known[sample], axis - front, 0.0)
    return depth
