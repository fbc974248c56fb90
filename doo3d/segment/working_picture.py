"""Large photographs: the stages work on a smaller copy, whose pixels the settings and constants in px suit.

A phone takes the same cable four times as wide as a webcam. The photograph is reduced by the largest whole factor that leaves it
as many pixels as the network looks at, and its strands `segment.working_width` wide. What is found is given in the pixels of the
photograph as it is.
"""

from dataclasses import replace

import cv2
import numpy as np

from ..config import Config, SegmentConfig
from ..scene.frame_facts import FrameFacts
from ..scene.image import ImageScene
from ..types import Array, Bools, Chain, Detection, Floats, Image, check_mask
from . import NETWORK_PIXELS, Segmentation, object_in_mask_image, segment

LENGTHS = {
    "segment": ("max_width",),
    "voxelize": ("radius", "core_margin_px"),
    "fit": ("segment_length",),
    "prune": ("width",),
    "merge": ("max_gap",),
}
"""Sections, and their settings that are lengths in px of the picture as it is, where they are set."""


def segment_picture(image: Image, config: Config, mask: Array | None) -> tuple[Segmentation, Image, Config, int]:
    """Segment a photograph, reduced if it is large and its strands are wide enough.

    Parameters
    ----------
    image
        the photograph.
    config
        the settings; `segment.working_width` is the least width in px that strands are reduced to.
    mask
        (H, W), the caller's own segmentation; None segments as the config says. A large photograph is then reduced before its
        strands are measured, half as far as the network does.

    Returns
    -------
    segmentation : of the reduced photograph.
    image : the reduced photograph; `image` itself if the factor is 1.
    config : the settings in its pixels.
    scale : the factor, the pixels of the photograph along the side of a reduced one.

    Raises
    ------
    InputError : as of `segment`.
    """
    shape, width = image.color.shape[:2], config.segment.working_width
    if width is None or config.segment.reference is not None:
        return _segment_at(1, image, config, mask)
    largest = max(1, int((shape[0] * shape[1] / NETWORK_PIXELS) ** 0.5))
    scale = max(1, largest // 2)
    first = None
    if mask is None:
        first = _segment_at(scale, image, config, None)
        assert isinstance(first[0].scene, ImageScene)
        facts = first[0].scene.facts
    else:
        mask = check_mask(mask, shape)
        facts = FrameFacts(_reduced_mask(mask, scale))
    wanted = max(1, min(largest, int(2 * scale * facts.radius() / width))) if facts.count else 1
    return first if first is not None and wanted == scale else _segment_at(wanted, image, config, mask)


def _segment_at(scale: int, image: Image, config: Config, mask: Array | None) -> tuple[Segmentation, Image, Config, int]:
    if scale > 1:
        image, config = _reduced(image, scale), _in_reduced_pixels(config, scale)
        mask = None if mask is None else _reduced_mask(mask, scale)
    return segment(image, segment_config(config), mask, config.seed), image, config, scale


def segment_config(config: Config) -> SegmentConfig:
    """Return the settings of segmentation: strands of branched objects differ in width, and are not divided by it."""
    return config.segment.model_copy(update={"equal_widths": False}) if config.merge.branches else config.segment


def _in_reduced_pixels(config: Config, scale: int) -> Config:
    sections = {}
    for name, lengths in LENGTHS.items():
        section = getattr(config, name)
        values = {key: value / scale for key in lengths if (value := getattr(section, key)) is not None}
        sections[name] = section.model_copy(update=values)
    return config.model_copy(update=sections)


def _reduced(image: Image, scale: int) -> Image:
    # an image of a mask keeps its two values
    how = cv2.INTER_AREA if object_in_mask_image(image.color) is None else cv2.INTER_NEAREST
    return replace(image, color=_shrunk(image.color, scale, how))


def _reduced_mask(mask: Bools, scale: int) -> Bools:
    """Return a mask (H, W) bool reduced by a whole factor: a pixel is True where more than half of its pixels are."""
    return mask if scale == 1 else _shrunk(np.where(mask, np.uint8(255), np.uint8(0)), scale, cv2.INTER_AREA) > 127


def _shrunk(image: Array, scale: int, how: int) -> Array:
    """Return an image (H, W) or (H, W, 3) uint8 reduced by a whole factor; the last pixels are repeated to make up whole ones."""
    height, width = image.shape[:2]
    padded = cv2.copyMakeBorder(image, 0, -height % scale, 0, -width % scale, cv2.BORDER_REPLICATE)
    return np.asarray(cv2.resize(padded, (padded.shape[1] // scale, padded.shape[0] // scale), interpolation=how))


def enlarged_points(points: Floats, scale: int) -> Floats:
    """Return positions (..., 2) px of a reduced picture in the pixels of the picture; whole numbers are middles of pixels."""
    return points if scale == 1 else np.asarray((points + 0.5) * scale - 0.5)


def enlarged_mask(mask: Bools, scale: int, shape: tuple[int, ...]) -> Bools:
    """Return a mask of a reduced picture in the pixels of the picture, of shape (H, W)."""
    return np.asarray(mask.repeat(scale, axis=0).repeat(scale, axis=1)[: shape[0], : shape[1]])


def enlarged_chain(chain: Chain, scale: int) -> Chain:
    """Return a chain of a reduced picture in the pixels of the picture."""
    if scale == 1:
        return chain
    return replace(
        chain,
        joints=enlarged_points(chain.joints, scale),
        segment_length=scale * chain.segment_length,
        radius=scale * chain.radius,
        radii=scale * chain.radii,
    )


def enlarged(detection: Detection, scale: int) -> Detection:
    """Return a detection of a reduced picture in the pixels of the picture."""
    if scale == 1:
        return detection
    return replace(
        detection,
        chains=tuple(enlarged_chain(chain, scale) for chain in detection.chains),
        crossings=tuple(replace(each, point=enlarged_points(each.point, scale)) for each in detection.crossings),
        junctions=tuple(
            replace(each, position=enlarged_points(each.position, scale), radii=scale * each.radii)
            for each in detection.junctions
        ),
    )
