"""Select the pixels that a network for thin objects, trained by `doo3d train`, takes for the object."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np
from scipy.special import logit

from ...config import SegmentConfig
from ...errors import InputError
from ...geometry.noise import SURFACE_SAMPLES
from ...kernels import MaskEdge
from ...scene.appearance import BAND_PX, RING_PX, Appearance
from ...scene.surround import BLUR_PX
from ...types import Array, Bools, Cloud, Frame, Image
from ..judged_parts import judged_mask, set_apart
from ..mask_repair import ITERATIONS
from ..thin_lines import find_lines
from . import strands
from .onnx import run_model
from .selected import SHADOWS, Selected, left_out_note
from .strands import IMAGE_PIXELS, MAX_ASPECT

PACKAGED = Path(__file__).parents[1] / "network.onnx"
"""The network that comes with doo3d."""

IS_PACKAGED = PACKAGED.is_file()

PYRAMID = (1.0, 1.4)
"""Sizes at which the network looks at a photograph, whose strands have any width; a frame is looked at once, at video rate.
Chosen on CVF3D-DLO and 50 photographs of others, where a third size of 0.75 made nothing better. With 1.5 for 1.4 a photograph
takes 18 ms more, and CVF3D-DLO has half a percent less."""

RULES_PIXELS = IMAGE_PIXELS // 6
"""Pixels that a photograph is scaled down to before the rules look at it: on CVF3D-DLO and the photographs of others the colors
make up for what they see less than in more pixels."""

PHOTOGRAPH_ODDS, FRAME_ODDS = (3.0, 2.0), (4.0, 4.0)
"""Factors by which a pixel's odds rise if the rules select it, and fall if not. Chosen for photographs on CVF3D-DLO and 50
photographs of others: given the network's odds, those of the labelled pixels there are 2.7 and 1.9 times as high where the rules
select, and 4.7 and 1.9 times as low elsewhere. In a frame the rules know depth: the network outdoes them from 0.8 on, and its
say on what they select begins at 0.2."""

THIN_PX = 4.0
"""px of the image scaled to 640 x 360 pixels: measured width of a line below which the network may see none. Of a dark one on
plain grey it finds nothing up to 2.3 px, and at 2.9 px, measured as up to 4, less than half."""

LINE_PROBABILITY = 0.9
"""Probability of the pixels of a line that the network misses, at least; it says nothing of them."""

STRIDE_PX = 32
"""The network takes images whose sides are multiples of this."""


def mask(data: Frame | Cloud | Image, config: SegmentConfig, seed: int) -> Selected:
    """Select the pixels of thin objects, such as cables, ropes and hoses, by a network that OpenCV runs, and by the rules.

    A photograph is looked at in 640 x 360 pixels at most, and with sides 1.4 times as long. The rules of the method `strands`,
    which know edges of color, vote on each pixel, and then its color does: by how frequent it is in what is found and around it.
    Lines that are too thin for the network, or that it finds in part, are added (see `find_lines`).
    In a frame the rules select, which know depth, too. Where not every part of what they select is a strand told by its color,
    the frame is scaled to 640 x 360 pixels at most and the network judges the parts (see `judged_mask`); one of your own always
    does.

    Parameters
    ----------
    data
        a Frame with color, or an Image.
    config
        section `segment` of the settings: `onnx.model`, a file that `doo3d train` wrote, without which the packaged network is
        used, and `onnx.threshold`.
    seed
        seed of the random draws of the rules.

    Returns
    -------
    (H, W) bool, with a note on what was left out as shadows or as flat; of a photograph also the probability of each pixel by the
    network and the rules, of a frame the plane that the rules found.

    Raises
    ------
    InputError : the data has no color image; there is no network; the file cannot be read, or is no network of `doo3d train`.
    """
    if isinstance(data, Cloud) or data.color is None:
        raise InputError("segment.method is network, which needs a color image", code="method-needs-color")
    if config.onnx.model is None and not IS_PACKAGED:
        raise InputError(
            "segment.method is network, but none is installed: set segment.onnx.model to a file that doo3d train wrote",
            code="network-missing",
        )
    color = data.color
    is_too_long = max(color.shape[:2]) > MAX_ASPECT * min(color.shape[:2])
    if isinstance(data, Image):
        rules = strands.select_in_image(color, RULES_PIXELS)
        if is_too_long:
            return rules
        probability = object_probability(color, config.onnx.model, PYRAMID)
        probability = _with_votes(probability, rules.mask, PHOTOGRAPH_ODDS)
        selected = _with_colors(probability, np.ascontiguousarray(color)) > logit(np.clip(config.onnx.threshold, 0, 1))
        lines = find_lines(color, selected, THIN_PX / _shrink(color))
        selected |= lines
        probability[lines] = np.maximum(probability[lines], LINE_PROBABILITY)
        left_out = sum(1 for band in rules.left_out if selected.ravel()[band].sum() < len(band) / 2)
        note = "" if selected.any() else left_out_note("network", left_out, SHADOWS)
        return Selected(selected, note, probability=probability)
    rules = strands.mask(data, config, seed)
    if is_too_long or (rules.is_certain and config.onnx.model is None):
        return rules
    voted = rules.mask
    if rules.bands is not None:
        voted = voted.copy()
        voted.ravel()[rules.bands.parts.pixels] = True
    probability = _with_votes(object_probability(color, config.onnx.model), voted, FRAME_ODDS)
    found = (probability > config.onnx.threshold) | set_apart(rules, data, 2 * THIN_PX / _shrink(color))
    return rules._replace(mask=judged_mask(rules, found, color))


def _with_votes(probability: Array, voted: Bools, odds: tuple[float, float]) -> Array:
    """Return the probability (H, W) float32 of pixels after the rules' votes (H, W) bool; odds : factors for and against."""
    raised = np.where(voted, np.float32(odds[0]), np.float32(1 / odds[1]))
    raised *= probability
    whole = 1 - probability
    whole += raised
    raised /= whole
    return np.asarray(raised)


def _with_colors(probability: Array, color: Array) -> Array:
    """Return the log-odds (H, W) of pixels after their colors' vote, as frequent as these are on the object and around it.

    What is on the object is learned from the probability first, then from what was found. probability : (H, W). color : (H, W, 3)
    uint8 RGB.
    """
    least = np.finfo(np.float32).eps
    bounded = probability.clip(0, 1)
    given = np.log((bounded + least) / (1 - bounded + least))
    cells = (color[..., 0] & 240).astype(np.uint16) << 4 | color[..., 1] & 240 | color[..., 2] >> 4
    found = given
    for _ in range(ITERATIONS):
        edge = MaskEdge(found > 0, BAND_PX, RING_PX)
        if not len(edge.inside()) or not len(edge.around(1)):
            break
        appearance = Appearance(color, edge.inside(), edge.around(SURFACE_SAMPLES))
        found = cv2.GaussianBlur(appearance.log_odds.take(cells), (0, 0), BLUR_PX)
        found += given
    return found


def object_probability(color: Array, model: str | None = None, scales: Sequence[float] = (1.0,)) -> Array:
    """Return the probability (H, W) float32 that a pixel belongs to a thin object.

    color : (H, W, 3) uint8 RGB. model : path of the network; None takes the packaged one. scales : sizes, of 640 x 360 pixels at
    most, at which the network looks at the image; their probabilities are averaged.
    """
    path = str(PACKAGED if model is None else model)
    shrink = _shrink(color)
    found = np.zeros(color.shape[:2], np.float32)
    for scale in scales:
        found += _at_scale(np.ascontiguousarray(color), path, shrink * scale)
    return found / len(scales)


def _shrink(color: Array) -> float:
    """Return the scale at which an image (H, W, 3) has IMAGE_PIXELS at most."""
    return float(min(1.0, (IMAGE_PIXELS / (color.shape[0] * color.shape[1])) ** 0.5))


def _at_scale(image: Array, path: str, scale: float) -> Array:
    shape = image.shape[:2]
    if scale < 1:  # to sides that the network takes, so that it looks at no pixel beyond the image
        width, height = (STRIDE_PX * max(1, round(side * scale / STRIDE_PX)) for side in shape[::-1])
        # down to half as long sides, bilinear interpolation sees every pixel, and is seven times as fast as by area
        image = cv2.resize(image, (width, height), interpolation=cv2.INTER_AREA if 2 * scale < 1 else cv2.INTER_LINEAR)
    elif scale > 1:
        image = cv2.resize(image, None, fx=scale, fy=scale, interpolation=cv2.INTER_LINEAR)
    height, width = image.shape[:2]
    padded = cv2.copyMakeBorder(image, 0, -height % STRIDE_PX, 0, -width % STRIDE_PX, cv2.BORDER_REPLICATE)
    output = run_model(path, cv2.dnn.blobFromImage(padded, 1 / 255), is_trusted=path == str(PACKAGED))
    rows, columns = padded.shape[0] // 2, padded.shape[1] // 2
    if output.shape != (1, 8, rows, columns):
        raise InputError(
            f"segment.onnx.model {path}: its output has shape {output.shape}, expected (1, 8, {rows}, {columns}): the method "
            "network takes files of doo3d train, the method onnx any other",
            code="onnx-output",
        )
    shuffled = np.empty((rows, 2, columns, 2), np.float32)
    for channel in range(4):
        shuffled[:, channel // 2, :, channel % 2] = output[0, channel]
    found = np.ascontiguousarray(shuffled.reshape(2 * rows, 2 * columns)[:height, :width])
    return np.asarray(cv2.resize(found, shape[::-1], interpolation=cv2.INTER_LINEAR))
