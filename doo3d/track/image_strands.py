"""Find the strands of a frame without depth, in its color image alone."""

from dataclasses import replace

import numpy as np

from ..config import Config
from ..errors import InputError
from ..geometry.polyline import unit
from ..pipeline import detect_with_stages
from ..segment import segment
from ..types import Array, Bools, Frame, Image, check_mask
from .observations import ObservedStrand, observe
from .registration import STEPS_PER_SEGMENT


def strands_in_image(frame: Frame, config: Config, mask: Array | None) -> tuple[ObservedStrand, ...]:
    """Return the strands in the color image of a frame without depth on the object.

    The object is detected as if it were on a sphere around the camera: directions and angles are then right at any distance. A
    chain has a whole number of segments, so segments are as short as the steps in which strands are placed along the object.
    Ends are joined greedily, which takes half the time: the neighboring frames decide which strands follow each other.

    Parameters
    ----------
    frame
        the frame.
    config
        the settings of the stages. The radius of the sphere is the geometric mean of `segment.min_depth` and `max_depth`.
    mask
        (H, W) bool, the caller's segmentation; None segments the color image according to the settings.

    Returns
    -------
    Strands without depth, as `ObservedStrand` describes them; empty if the image does not show the object.
    """
    distance = float(np.sqrt(config.segment.min_depth * config.segment.max_depth))
    try:
        selected = _mask_of_image(frame, config, distance) if mask is None else check_mask(mask, frame.depth.shape)
        pixels = np.argwhere(selected)[:, ::-1]
        depth = np.zeros_like(frame.depth)
        depth[selected] = distance * unit(frame.camera.unproject(pixels, np.ones(len(pixels))))[:, 2]
        fine = config.fit.model_copy(update={"segment_length": config.fit.length / STEPS_PER_SEGMENT})
        merge = config.merge.model_copy(update={"strategy": "greedy"})
        config = config.model_copy(update={"fit": fine, "merge": merge})
        detection, stages = detect_with_stages(replace(frame, depth=depth), config, selected)
    except InputError:
        return ()
    return tuple(_without_depth(strand) for strand in observe(detection, stages, config).strands)


def _mask_of_image(frame: Frame, config: Config, distance: float) -> Bools:
    """Return the mask (H, W) bool of the object in the color image of a frame.

    distance : m, assumed distance of the strands, which gives their largest width in px.
    """
    if frame.color is None:
        return np.zeros(frame.depth.shape, dtype=bool)
    widest = config.segment.max_width * frame.camera.fx / distance
    settings = config.segment.model_copy(update={"max_width": widest})
    mask = segment(Image(frame.color), settings, seed=config.seed).scene.mask
    assert mask is not None
    return mask


def _without_depth(strand: ObservedStrand) -> ObservedStrand:
    """Return a strand on a sphere around the camera as a strand of unknown depth."""
    distance = np.linalg.norm(strand.points, axis=1).mean()
    rays = unit(strand.points)
    return replace(strand, points=rays, arcs=strand.arcs / distance, length=strand.length / distance, chain=-1, sight=rays)
