"""Select thin objects with a neural network, trained by `doo3d train`, together with the rules of the method `strands`."""

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
from ..mask_parts import drawn
from ..mask_repair import ITERATIONS
from ..thin_lines import find_lines
from . import strands
from .onnx import run_model
from .result import SHADOWS, MethodResult, color_of, rejection_note
from .strands import IMAGE_PIXELS, MAX_ASPECT

PACKAGED = Path(__file__).parents[1] / "network.onnx"
"""The network that is installed with doo3d."""

IS_PACKAGED = PACKAGED.is_file()

PYRAMID = (1.0, 1.4)
"""Scales at which the network examines a photograph, whose strands have any width. A frame is examined at one scale, at video
rate. Chosen on CVF3D-DLO and 50 photographs of other sources, where a third scale of 0.75 gave no improvement. With 1.5 in place
of 1.4, a photograph takes 18 ms more, and the result on CVF3D-DLO is half a percent lower."""

RULES_PIXELS = IMAGE_PIXELS // 6
"""Number of pixels to which a photograph is scaled down for the rules: on CVF3D-DLO and the photographs of other sources, the
votes of the colors make up for the lower resolution."""

PHOTOGRAPH_ODDS, FRAME_ODDS = (3.0, 2.0), (4.0, 4.0)
"""Factors by which a pixel's odds are multiplied if the rules select it, and divided if not. Chosen for photographs on CVF3D-DLO
and 50 photographs of other sources: compared with the network's odds, the odds of the labelled pixels there are 2.7 and 1.9 times
as high where the rules select, and 4.7 and 1.9 times as low elsewhere. In a frame the rules use depth: the network overrules them
from a probability of 0.8 where they select nothing, and below 0.2 where they select."""

THIN_PX = 4.0
"""Measured width of a line, in px of the image scaled to 640 x 360 pixels, below which the network may miss it. Of a dark line on
plain grey it finds nothing up to 2.3 px, and less than half at 2.9 px, which is measured as up to 4 px."""

LINE_PROBABILITY = 0.9
"""Minimum probability assigned to the pixels of a line that the network misses; it cannot estimate theirs."""

STRIDE_PX = 32
"""px; width and height of the network's input must be multiples of this."""


def mask(data: Frame | Cloud | Image, config: SegmentConfig, seed: int) -> MethodResult:
    """Select the pixels of thin objects, such as cables, ropes and hoses, by a network that OpenCV runs, and by rules.

    A photograph is examined with at most 640 x 360 pixels, and with sides 1.4 times as long. The rules of the method `strands`,
    which use edges of color, vote on each pixel. Then its color votes: by its frequency on the object compared with that around
    the object. Lines that are too thin for the network, or that it finds in part, are added (see `find_lines`).
    In a frame the rules use depth, too. If some part of their mask is no strand detected by its color, the frame is scaled to at
    most 640 x 360 pixels, and the network filters the parts (see `judged_mask`). The user's own network always does so.

    Parameters
    ----------
    data
        a Frame with color, or an Image.
    config
        section `segment` of the settings: `onnx.model`, a file that `doo3d train` wrote (None: the packaged network), and
        `onnx.threshold`.
    seed
        seed of the random draws of the rules.

    Returns
    -------
    (H, W) bool, with a note on the bands rejected as shadows or as flat; for a photograph also the probability of each pixel by
    the network and the rules, for a frame the plane that the rules found.

    Raises
    ------
    InputError : the data has no color image; there is no network; the file cannot be read, or is no network of `doo3d train`.
    """
    color, model = color_of(data, "network"), config.onnx.model
    is_own = model is not None
    if not (is_own or IS_PACKAGED):
        raise InputError(
            "segment.method is network, but none is installed: set segment.onnx.model to a file that doo3d train wrote",
            code="network-missing",
        )
    is_too_long = max(color.shape[:2]) > MAX_ASPECT * min(color.shape[:2])
    if not isinstance(data, Frame):
        rules = strands.select_in_image(color, RULES_PIXELS)
        if is_too_long:
            return rules
        probability = object_probability(color, model, PYRAMID)
        probability = _with_votes(probability, rules.mask, PHOTOGRAPH_ODDS)
        selected = _with_colors(probability, np.ascontiguousarray(color)) > logit(np.clip(config.onnx.threshold, 0, 1))
        lines = find_lines(color, selected, THIN_PX / _shrink(color))
        selected |= lines
        probability[lines] = np.maximum(probability[lines], LINE_PROBABILITY)
        rejected = sum(1 for band in rules.rejected if selected.ravel()[band].sum() < len(band) / 2)
        note = "" if selected.any() else rejection_note("network", rejected, SHADOWS)
        return MethodResult(selected, note, probability=probability)
    rules = strands.mask(data, config, seed)
    if is_too_long or (rules.is_certain and not is_own):
        return rules
    voted = rules.mask | drawn(rules.bands.parts.pixels, rules.mask.shape)
    probability = _with_votes(object_probability(color, model), voted, FRAME_ODDS)
    found = (probability > config.onnx.threshold) | set_apart(rules, data, 2 * THIN_PX / _shrink(color))
    return rules._replace(mask=judged_mask(rules, found, color))


def _with_votes(probability: Array, voted: Bools, odds: tuple[float, float]) -> Array:
    """Return the probability (H, W) float32 after the votes (H, W) bool of the rules; odds : factors for and against."""
    raised = np.where(voted, np.float32(odds[0]), np.float32(1 / odds[1]))
    raised *= probability
    whole = 1 - probability
    whole += raised
    raised /= whole
    return np.asarray(raised)


def _with_colors(probability: Array, color: Array) -> Array:
    """Return the log-odds (H, W) of pixels after the vote of their colors: the frequency on the object over that around it.

    The colors are learned from the object by the given probability first, then from the object found. probability : (H, W).
    color : (H, W, 3) uint8 RGB.
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


def object_probability(color: Array, model: str | None = None, scales: Sequence[float] = (1,)) -> Array:
    """Return the probability (H, W) float32 that a pixel belongs to a thin object.

    color : (H, W, 3) uint8 RGB. model : path of the network; None takes the packaged network. scales : factors of the size of the
    image, which is at most 640 x 360 pixels at 1; the probabilities at all scales are averaged.
    """
    path = str(PACKAGED) if model is None else model
    shrink = _shrink(color)
    found = np.zeros(color.shape[:2], np.float32)
    for scale in scales:
        found += _at_scale(np.ascontiguousarray(color), path, shrink * scale)
    return found / len(scales)


def _shrink(color: Array) -> float:
    """Return the scale at which an image (H, W, 3) has at most IMAGE_PIXELS pixels, 1 at most."""
    return float(min(1.0, (IMAGE_PIXELS / (color.shape[0] * color.shape[1])) ** 0.5))


def _at_scale(image: Array, path: str, scale: float) -> Array:
    """Return the network's probability (H, W) for an image (H, W, 3) that it examines at a scale."""
    shape = image.shape[:2]
    if scale < 1:  # to sides that are multiples of STRIDE_PX, so that the image needs no padding
        width, height = (STRIDE_PX * max(1, round(side * scale / STRIDE_PX)) for side in shape[::-1])
        # down to half of the sides, bilinear interpolation uses every pixel, and is seven times as fast as INTER_AREA
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
