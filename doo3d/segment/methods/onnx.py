"""Select the pixels of one class of the user's own segmentation network, an ONNX file."""

import hashlib
import os
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from threading import Lock
from typing import Any

import cv2
import numpy as np

from ...config import OnnxConfig, SegmentConfig
from ...errors import InputError, unread_code
from ...guard.isolation import isolated
from ...types import Array, Bools, Cloud, Frame, Image
from .result import color_of

_MAX_FIRST_RUN_BYTES = 8 << 30
"""Maximum memory of the first run, bytes. Source: the 8 GB of a laptop, where a network that needs more would fail later, too."""

_MAX_FIRST_RUN_S = 120.0
"""Maximum time of the first run, s. Source: a capture of a minute has 1800 frames, which take 2.5 days at this speed."""


def mask(data: Frame | Cloud | Image, config: SegmentConfig, seed: int) -> Bools:
    """Select the pixels of one class of a segmentation network, run by OpenCV.

    The color image is resized to the network's input; `mean` is subtracted and the result multiplied by `scale`, in the order
    (1, 3, H, W). The output is (1, C, h, w) scores; (1, h, w) and (h, w) are one class. The scores are resized to the image. With
    one class a pixel is selected if its score is above `threshold`, with more if the wanted class has the highest score.

    Parameters
    ----------
    data
        a Frame with color, or an Image.
    config
        section `segment` of the settings: `onnx`.
    seed
        not used.

    Returns
    -------
    (H, W) bool.

    Raises
    ------
    InputError : the data has no color image; the model cannot be read, is no ONNX model, does not run on an input of this size,
        or ends the process of its first run; its output is no image; it has no such class.
    """
    color, settings = color_of(data, "onnx"), config.onnx
    scores = _scores(run_model(str(settings.model), _input(color, settings)), settings)
    size = color.shape[1], color.shape[0]
    if len(scores) == 1:
        return np.asarray(cv2.resize(scores[0], size, interpolation=cv2.INTER_LINEAR) > settings.threshold)
    best = np.full(size[::-1], -np.inf, dtype=np.float32)
    for index, score in enumerate(scores):
        if index != settings.class_index:
            np.maximum(best, cv2.resize(score, size, interpolation=cv2.INTER_LINEAR), out=best)
    return np.asarray(cv2.resize(scores[settings.class_index], size, interpolation=cv2.INTER_LINEAR) > best)


def _input(color: Array, settings: OnnxConfig) -> Array:
    """Return the network's input (1, 3, H, W) float32."""
    size = settings.input_size or (color.shape[1], color.shape[0])
    image = cv2.resize(np.ascontiguousarray(color), tuple(size), interpolation=cv2.INTER_LINEAR).astype(np.float32)
    image = (image - np.array(settings.mean, np.float32)) * np.array(settings.scale, np.float32)
    if settings.channels == "bgr":
        image = image[..., ::-1]
    return np.ascontiguousarray(image.transpose(2, 0, 1)[None])


@dataclass(frozen=True, eq=False)
class _Model:
    """A model that has been read. name : its name in errors. digest : SHA-256 of its content."""

    name: str
    content: bytes
    digest: str


_FORWARD = Lock()
"""Held while a network runs, since threads share the network, which stores its input and output."""

_tried: set[tuple[str, tuple[int, ...]]] = set()
"""Digests and input shapes of the models that passed their first run, in a separate process."""


def run_model(path: str, image: Array, is_trusted: bool = False) -> Array:
    """Return the output of the model for an image (1, 3, H, W).

    Some damaged models crash OpenCV. Unless the model is trusted, the first image of each shape is therefore run in a separate
    process first.
    """
    try:
        status = os.stat(path)
        model = _read(path, status.st_mtime_ns, status.st_size)
    except OSError as error:
        raise InputError(f"segment.onnx.model {path}: cannot be read ({error.strerror})", code=unread_code(error)) from None
    if not is_trusted and (model.digest, image.shape) not in _tried:
        bounds: dict[str, Any] = {"memory": _MAX_FIRST_RUN_BYTES, "seconds": _MAX_FIRST_RUN_S}
        isolated(_forward, model, image, where=model.name, code="onnx-unreadable", **bounds)
        _tried.add((model.digest, image.shape))
    return _forward(model, image)


@lru_cache(maxsize=2)
def _read(path: str, modified: int, size: int) -> _Model:
    """Return the model of a file; its time of modification and its size are part of the key of the cache."""
    content = Path(path).read_bytes()
    return _Model(f"segment.onnx.model {path}", content, hashlib.sha256(content).hexdigest())


@lru_cache(maxsize=2)
def _load(model: _Model) -> cv2.dnn.Net:
    """Return the network of a model."""
    try:
        network = cv2.dnn.readNetFromONNX(np.frombuffer(model.content, np.uint8)) if model.content else cv2.dnn.Net()
    except (cv2.error, SystemError) as error:
        raise InputError(
            f"{model.name}: not an ONNX model that OpenCV can run ({_sentence(error)})", code="onnx-unreadable"
        ) from None
    if network.empty():
        raise InputError(f"{model.name}: not an ONNX model", code="onnx-unreadable")
    return network


def _forward(model: _Model, image: Array) -> Array:
    """Return the output of a model for an image (1, 3, H, W)."""
    network = _load(model)
    try:
        with _FORWARD:
            network.setInput(image)
            return np.array(network.forward())
    except (cv2.error, SystemError) as error:
        raise InputError(
            f"{model.name}: does not run on an input of shape {image.shape} ({_sentence(error)}); "
            "set segment.onnx.input_size to the size that the model was exported with",
            code="onnx-input",
        ) from None


def _scores(output: Array, settings: OnnxConfig) -> Array:
    """Return the scores (C, h, w) float32 of C classes."""
    scores = output[0] if output.ndim > 2 and len(output) == 1 else output
    scores = scores[None] if scores.ndim == 2 else scores
    if scores.ndim != 3 or 0 in scores.shape:
        raise InputError(
            f"segment.onnx.model {settings.model}: its output has shape {output.shape}, expected (1, classes, height, width)",
            code="onnx-output",
        )
    if settings.class_index >= len(scores):
        raise InputError(
            f"segment.onnx.class_index is {settings.class_index}, but the model has {len(scores)} classes, from 0",
            code="onnx-class",
        )
    return np.ascontiguousarray(scores, dtype=np.float32)


def _sentence(error: Exception) -> str:
    """Return the last line of OpenCV's message."""
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    return lines[-1][:200] if lines else type(error).__name__
