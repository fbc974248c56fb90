"""A tiny segmentation network as the bytes of an ONNX file: one 1x1 convolution, written without the package onnx."""

from __future__ import annotations

import numpy as np


def _varint(value: int) -> bytes:
    out = bytearray()
    while value > 127:
        out.append(value & 127 | 128)
        value >>= 7
    return bytes([*out, value])


def _field(number: int, value: int | bytes | str) -> bytes:
    """Return one field of a protobuf message: an integer, or bytes with their length."""
    if isinstance(value, int):
        return _varint(number << 3) + _varint(value)
    content = value.encode() if isinstance(value, str) else value
    return _varint(number << 3 | 2) + _varint(len(content)) + content


def _tensor(name: str, values: np.ndarray) -> bytes:
    sizes = b"".join(_field(1, size) for size in values.shape)
    return sizes + _field(2, 1) + _field(8, name) + _field(9, values.astype("<f4").tobytes())


def _value(name: str, shape: tuple[int, ...]) -> bytes:
    sizes = b"".join(_field(1, _field(1, size)) for size in shape)
    return _field(1, name) + _field(2, _field(1, _field(1, 1) + _field(2, sizes)))


def convolution(weights: np.ndarray, bias: np.ndarray, size: tuple[int, int]) -> bytes:
    """Return a model whose C classes score weights @ color + bias at each pixel.

    weights : (C, 3). bias : (C,). size : (height, width) of input and output.
    """
    classes = len(weights)
    node = _field(1, "image") + _field(1, "weights") + _field(1, "bias") + _field(2, "scores") + _field(4, "Conv")
    kernel = _field(1, "kernel_shape") + _field(8, 1) + _field(8, 1) + _field(20, 7)
    node += _field(5, kernel)
    graph = _field(1, node) + _field(2, "tiny")
    graph += _field(5, _tensor("weights", weights.reshape(classes, 3, 1, 1))) + _field(5, _tensor("bias", bias))
    graph += _field(11, _value("image", (1, 3, *size))) + _field(12, _value("scores", (1, classes, *size)))
    return _field(1, 8) + _field(7, graph) + _field(8, _field(1, "") + _field(2, 13))
